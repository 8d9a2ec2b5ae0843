"""Recordings damaged message by message: odd values in every field, messages lost or in other places."""

import copy
import math
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from random import Random
from typing import Any, TypeAlias

import numpy as np
from rosbags.highlevel import AnyReader
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

_MOST_MESSAGES = 120
ODD_FLOATS = (
    *(math.nan, math.inf, -math.inf, 0.0, -0.0, -1.0, 1e-300, 1e-9, 0.001, 1.0, 1e4, 1e6, 1e30, 1e308),
    *(-1e30, 3.14159, 65.533, 1e-40, 1e5),
)
ODD_TEXTS = ("", "/", "laser", "/laser", "map", "odom", "base_link", "é 日本", "a" * 5000, "x\ny", "../../up")
Place: TypeAlias = tuple[Any, str]


@dataclass(frozen=True)
class Sent:
    """One message with its topic and the time of its record, ns."""

    topic: str
    msgtype: str
    time: int
    message: Any


@dataclass(frozen=True)
class Take:
    """A short recording; `ros` is 1 or 2, `store` knows its types."""

    ros: int
    store: Any
    sent: tuple[Sent, ...]


def take_of(path: Path, scans: int) -> Take:
    """The beginning of a recording up to a number of scans (or points, or ranges), decoded."""
    with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        return Take(2 if reader.is2 else 1, reader.typestore, tuple(_beginning(reader, scans)))


def _beginning(reader: Any, scans: int) -> Iterator[Sent]:
    seen = {True: 0, False: 0}
    for connection, time, raw in reader.messages():
        name = connection.msgtype
        try:
            message = reader.deserialize(raw, name)
        except Exception:  # noqa: S112  (a type without a definition is left out)
            continue
        is_scan = name.endswith(("Scan", "/Range", "/PointCloud2"))
        seen[is_scan] += 1
        if is_scan or seen[False] < _MOST_MESSAGES:
            yield Sent(connection.topic, name, time, message)
        if seen[True] >= scans:
            return


def write_take(take: Take, path: Path, storage: str) -> Path:
    """Write a ROS1 bag (storage none, bz2, lz4) or a ROS2 directory (storage sqlite3, mcap)."""
    if take.ros == 1:
        return _write1(take, path.with_name(path.name + ".bag"), storage)
    shutil.rmtree(path, ignore_errors=True)
    with Writer2(path, version=9, storage_plugin=StoragePlugin[storage.upper()]) as writer:
        _fill(writer, take, take.store.serialize_cdr)
    return path


def _write1(take: Take, path: Path, storage: str) -> Path:
    path.unlink(missing_ok=True)
    writer = Writer1(path)
    if storage != "none":
        writer.set_compression(Writer1.CompressionFormat[storage.upper()])
    writer.chunk_threshold = 4000
    with writer:
        _fill(writer, take, take.store.serialize_ros1)
    return path


def _fill(writer: Any, take: Take, serialize: Callable[[Any, str], Any]) -> None:
    connections: dict[tuple[str, str], Any] = {}
    for sent in take.sent:
        key = (sent.topic, sent.msgtype)
        try:
            raw = serialize(sent.message, sent.msgtype)
        except Exception:  # noqa: S112  (a value that this field cannot hold)
            continue
        if key not in connections:
            connections[key] = writer.add_connection(*key, typestore=take.store)
        writer.write(connections[key], max(sent.time, 0), raw)


def damaged(take: Take, random: Random) -> Take:
    """The recording with one to three kinds of damage."""
    sent = list(take.sent)
    for _ in range(random.choice((1, 1, 2, 3))):
        sent = random.choices(_DAMAGES, weights=_WEIGHTS)[0](sent, random)
    return Take(take.ros, take.store, tuple(sent))


def _affected(sent: list[Sent], random: Random) -> range | list[int]:
    """Which messages of one topic are damaged: one, all, or all from somewhere on."""
    topic = random.choice(sent).topic if sent else ""
    own = [k for k, one in enumerate(sent) if one.topic == topic]
    if not own:
        return own
    return random.choice((own, own, own[random.randrange(len(own)) :], [random.choice(own)], own[::3]))


def _odd_fields(sent: list[Sent], random: Random) -> list[Sent]:
    affected, out = _affected(sent, random), list(sent)
    if not affected:
        return out
    choice, change = random.random(), random.randrange(1 << 30)
    for k in affected:
        message = copy.deepcopy(sent[k].message)
        places = list(_places(message))
        if places:
            owner, name = places[int(choice * len(places))]
            _set_odd(owner, name, Random(change))
        out[k] = Sent(sent[k].topic, sent[k].msgtype, sent[k].time, message)
    return out


def _places(message: Any) -> Iterator[Place]:
    """Every field that holds a value: large arrays count several times, for they matter most."""
    for field in fields(message):
        value = getattr(message, field.name)
        if is_dataclass(value):
            yield from _places(value)
        elif isinstance(value, list):
            yield message, field.name
            for part in value[:4]:
                if is_dataclass(part):
                    yield from _places(part)
        elif not field.name.startswith("__"):
            yield from [(message, field.name)] * (3 if isinstance(value, np.ndarray) else 1)


def _set_odd(owner: Any, name: str, random: Random) -> None:
    value: Any = getattr(owner, name)
    odd: Any = None
    match value:
        case bool():
            odd = not value
        case int():
            odd = random.choice((0, 1, -1, 2**31 - 1, -(2**31), 2**32 - 1, 255, value + 1, value - 3600))
        case float():
            odd = random.choice((*ODD_FLOATS, -value, value * 1.01, value + 3600.0))
        case str():
            odd = random.choice(ODD_TEXTS)
        case np.ndarray():
            odd = odd_array(value, random)
        case list():
            odd = random.choice((value[:0], value[: len(value) // 2], value + value[:1], value[::-1]))
    if odd is not None:
        object.__setattr__(owner, name, odd)


def odd_array(values: Any, random: Random) -> Any:
    """An array of another length, or with odd values at some, many or all places."""
    out, size = values.copy(), len(values)
    shape = random.randrange(8)
    if shape < 3:
        return (out[:0], out[: size // 2], np.concatenate((out, out[: max(size // 3, 1)])))[shape]
    scale = np.array(random.choice(ODD_FLOATS))
    with np.errstate(all="ignore"):
        odd = scale.astype(out.dtype)
    if shape == 3 or size == 0:
        out[:] = odd
    elif shape == 4:
        out[random.randrange(size)] = odd
    elif shape == 5:
        out[random.randrange(size) :: random.randrange(1, 5)] = odd
    elif shape == 6:
        out = out[::-1].copy()
    else:
        out[size // 3 : size // 2] = odd
    return out


def _lost(sent: list[Sent], random: Random) -> list[Sent]:
    affected = set(_affected(sent, random))
    return [one for k, one in enumerate(sent) if k not in affected]


def _doubled(sent: list[Sent], random: Random) -> list[Sent]:
    affected = set(_affected(sent, random))
    return [one for k, one in enumerate(sent) for _ in range(1 + (k in affected))]


def _out_of_order(sent: list[Sent], random: Random) -> list[Sent]:
    out = list(sent)
    random.shuffle(out)
    return out


def _other_times(sent: list[Sent], random: Random) -> list[Sent]:
    """Record times and stamps that jump, stand or run backwards."""
    affected, out = set(_affected(sent, random)), []
    shift = random.choice((-(10**6), -(10**9), -3600 * 10**9, 10**13, 3 * 10**7, 10**10))
    still, stamps_too = random.random() < 0.3, random.random() < 0.7
    for k, one in enumerate(sent):
        time = sent[0].time if still else one.time + shift
        if k in affected:
            message = copy.deepcopy(one.message)
            if stamps_too and hasattr(message, "header"):
                stamp = message.header.stamp
                object.__setattr__(stamp, "sec", max(time // 10**9, 0) % 2**31)
                object.__setattr__(stamp, "nanosec", time % 10**9)
            out.append(Sent(one.topic, one.msgtype, max(time, 0), message))
        else:
            out.append(one)
    return out


def _second_topic(sent: list[Sent], random: Random) -> list[Sent]:
    affected = set(_affected(sent, random))
    name = random.choice(("/scan2", "/map", "odom", "/tf_static", "/é 日本", "../up"))
    return [
        renamed
        for k, one in enumerate(sent)
        for renamed in ((one, Sent(name, one.msgtype, one.time, one.message)) if k in affected else (one,))
    ]


def _other_frames(sent: list[Sent], random: Random) -> list[Sent]:
    """Transforms that loop, have two parents, leading slashes or a map frame; other kinds stay."""
    out = []
    pair = random.choice(
        (("laser", "base_link"), ("map", "odom"), ("/odom", "/base_link"), ("base_link", "laser"), ("a", "a"))
    )
    for one in sent:
        message = one.message
        if one.msgtype.lower().endswith("tfmessage") and message.transforms:
            message = copy.deepcopy(message)
            added = copy.deepcopy(message.transforms[0])
            object.__setattr__(added.header, "frame_id", pair[0])
            object.__setattr__(added, "child_frame_id", pair[1])
            object.__setattr__(message, "transforms", [*message.transforms, added])
        out.append(Sent(one.topic, one.msgtype, one.time, message))
    return out


_DAMAGES = (
    _odd_fields, _lost, _doubled, _out_of_order, _other_times, _second_topic, _other_frames,
)  # fmt: skip
_WEIGHTS = (12, 1, 1, 1, 3, 1, 2)
