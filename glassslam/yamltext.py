"""YAML texts of strangers become plain data, or a `yaml.YAMLError`."""

from collections.abc import Iterator
from typing import Any

import yaml

_MOST_VALUES = 1_000_000


def parse_yaml(text: str) -> Any:
    """Plain data of a YAML text, which may come from anywhere.

    Aliases that stand for more than a million values, or for a part of themselves, are refused: a few lines
    of them fill any memory as soon as somebody writes them out.

    Parameters
    ----------
    text : str
        The text; tags of other languages are refused, as by `yaml.safe_load`.

    Raises
    ------
    yaml.YAMLError
        The text is no YAML, nests too deeply, holds an impossible date or number, or is such a bomb.

    Examples
    --------
    >>> parse_yaml("{a: [1, 2.5]}")
    {'a': [1, 2.5]}
    """
    try:
        data = yaml.safe_load(text)
        size = _size(data, {})
    except yaml.YAMLError:
        raise
    except RecursionError as error:
        raise yaml.YAMLError("it nests too deeply") from error
    except Exception as error:
        # dates of a 13th month, numbers of ten thousand digits, keys that are lists
        line = (str(error).splitlines() or [type(error).__name__])[0]
        raise yaml.YAMLError(f"a value makes no sense: {line}") from error
    if size > _MOST_VALUES:
        raise yaml.YAMLError("its aliases stand for more than a million values")
    return data


def unreadable(error: BaseException) -> str:
    """Why a YAML file cannot be read, in one line, with the line at fault where one is."""
    if isinstance(error, OSError):
        return error.strerror or type(error).__name__
    if isinstance(error, UnicodeDecodeError):
        return f"it is no text, byte {error.start} is no UTF-8"
    if isinstance(error, yaml.MarkedYAMLError) and error.problem_mark is not None:
        return f"line {error.problem_mark.line + 1}: {error.problem or error.context}"
    return (str(error).splitlines() or [type(error).__name__])[0]


def _size(data: Any, known: dict[int, int]) -> int:
    """Values that the data has when every alias is written out; 0 in `known` marks what is being counted."""
    if not isinstance(data, dict | list | tuple | set):
        return 1
    if id(data) in known:
        if known[id(data)] == 0:
            raise yaml.YAMLError("a value is a part of itself")
        return known[id(data)]
    known[id(data)] = 0
    known[id(data)] = total = 1 + sum(_size(part, known) for part in _parts(data))
    return total


def _parts(data: Any) -> Iterator[Any]:
    if isinstance(data, dict):
        yield from data.keys()
        yield from data.values()
    else:
        yield from data
