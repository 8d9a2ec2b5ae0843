"""Files damaged without regard to what they mean: bytes, words of a text, leaves of a YAML tree."""

import copy
import gzip
from collections.abc import Iterator
from random import Random
from typing import Any

import yaml

_WORDS = (
    *("nan", "inf", "-inf", "0", "-1", "1e308", "1e-320", "99999999999999999999", "1e999", "", "é", "x"),
    *(
        "1_0",
        "0x10",
        "NaN",
        "+",
        "-",
        "1.2.3",
        "'",
        '"',
        "{",
        "[",
        ":",
        "\t",
        "\x00",
        "2001-99-99",
        "!!int x",
    ),
    *("9" * 5000, "[" * 3000, "&a [*a]", "!!python/object:os.system x", "~", "true", "1e5", "1000000"),
)
_NUMBERS = (
    b"\x00" * 4,
    b"\xff" * 4,
    b"\xff\xff\xff\x7f",
    b"\x00\x00\x00\x80",
    b"\x01\x00\x00\x00",
    b"\xff" * 8,
)
_LEAVES: tuple[Any, ...] = (
    *(
        float("nan"),
        float("inf"),
        -float("inf"),
        0,
        -1,
        1,
        1e308,
        1e-320,
        10**30,
        "",
        "x",
        "off",
        "auto",
        None,
    ),
    *(True, [], {}, [[]], {"x": 1}, [1, 2], "../../x", "é 日本", 0.5, 2.5, 90, 1e6, "2001-99-99"),
)


def damaged_bytes(content: bytes, random: Random) -> bytes:
    """A prefix, or a few flipped, overwritten, removed, repeated or inserted bytes."""
    kind = random.randrange(8)
    if kind <= 1 or not content:
        return content[: random.randrange(len(content) + 1)]
    out = bytearray(content)
    for _ in range(random.choice((1, 1, 2, 4, 16))):
        at = random.randrange(len(out) + 1)
        if random.random() < 0.4:  # headers and indices stand at both ends
            at = random.choice((min(at, 4096), max(len(out) - 2048, 0) + at % 2048))
        length = random.choice((1, 2, 4, 8, 40, 400))
        if kind <= 3 and at < len(out):
            out[at] ^= 1 << random.randrange(8)
        elif kind == 4:
            number = random.choice(_NUMBERS)
            out[at : at + len(number)] = number
        elif kind == 5:
            del out[at : at + length]
        elif kind == 6:
            out[at:at] = out[max(at - length, 0) : at]
        else:
            out[at : at + length] = random.randbytes(length)
    return bytes(out)


def damaged_log(content: bytes, random: Random) -> bytes:
    """A text log, packed or not, with words or lines or bytes damaged."""
    packed = content.startswith(b"\x1f\x8b")
    if packed and random.random() < 0.3:
        return damaged_bytes(content, random)
    text = gzip.decompress(content) if packed else content
    damaged = damaged_bytes(text, random) if random.random() < 0.35 else damaged_words(text, random)
    return gzip.compress(damaged, mtime=0) if packed else damaged


def damaged_words(content: bytes, random: Random) -> bytes:
    """A text with some words replaced, or lines lost, doubled, cut or out of order."""
    lines = content.decode("utf-8", "surrogateescape").split("\n")
    for _ in range(random.choice((1, 1, 2, 5, 20))):
        k, kind = random.randrange(len(lines)), random.randrange(8)
        if kind <= 3:
            words = lines[k].split(" ")
            words[random.randrange(len(words))] = random.choice(_WORDS)
            lines[k] = " ".join(words)
        elif kind == 4:
            lines = _replaced_everywhere(lines, random)
        elif kind == 5:
            lines[k : k + 1] = random.choice(([], [lines[k]] * 2, [""], [lines[k][: len(lines[k]) // 2]]))
        elif kind == 6:
            other = random.randrange(len(lines))
            lines[k], lines[other] = lines[other], lines[k]
        else:
            lines[k:k] = [random.choice(_WORDS)]
        lines = lines or [""]
    return "\n".join(lines).encode("utf-8", "surrogateescape")


def _replaced_everywhere(lines: list[str], random: Random) -> list[str]:
    """One column gets the same odd word in every line."""
    column, word = random.randrange(max(len(line.split(" ")) for line in lines)), random.choice(_WORDS[:16])
    out = []
    for line in lines:
        words = line.split(" ")
        if column < len(words) > 1:
            words[column] = word
        out.append(" ".join(words))
    return out


def damaged_yaml(text: str, random: Random) -> bytes:
    """A YAML text with odd leaves, lost or misspelt names, or damaged words."""
    if random.random() < 0.4:
        return damaged_words(text.encode(), random)
    tree = yaml.safe_load(text)
    for _ in range(random.choice((1, 1, 2, 4))):
        places = list(_leaves(tree))
        if not places:
            break
        owner, key = random.choice(places)
        kind = random.randrange(6)
        if kind == 0:
            del owner[key]
        elif kind == 1 and isinstance(owner, dict):
            owner[f"{key}x"] = owner.pop(key)
        else:
            owner[key] = copy.deepcopy(random.choice(_LEAVES))  # it may be damaged in turn
    return yaml.safe_dump(tree, sort_keys=False).encode()


def odd_numbers(text: str, random: Random) -> bytes:
    """A YAML text with one to three of its numbers changed."""
    tree = yaml.safe_load(text)
    numbers = [(owner, key) for owner, key in _leaves(tree) if type(owner[key]) in (int, float)]
    for owner, key in random.choices(numbers, k=random.choice((1, 1, 2, 3))):
        value = owner[key]
        odd = (0, -value, 10 * value, value / 1000, value + 0.001, 1000, 1e6, 1e-9, -1e9, 1e30, 1e308)
        owner[key] = random.choice((*odd, *(value + 0.3 * k for k in range(-6, 7))))
    return yaml.safe_dump(tree, sort_keys=False).encode()


def _leaves(tree: Any) -> Iterator[tuple[Any, Any]]:
    """Owner and key of everything in nested mappings and lists."""
    keys = list(tree) if isinstance(tree, dict) else range(len(tree)) if isinstance(tree, list) else ()
    for key in keys:
        yield tree, key
        yield from _leaves(tree[key])
