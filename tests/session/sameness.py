"""Whether two values are the same bit by bit, whatever they are made of."""

import struct
from collections.abc import Mapping
from dataclasses import fields, is_dataclass

import numpy as np


def differences(a, b, at="value"):  # noqa: PLR0911  (one for every kind of value)
    """Where two values differ: types, lengths, keys, or any bit of a number."""
    if type(a) is not type(b):
        return [f"{at}: {type(a).__name__} against {type(b).__name__}"]
    if isinstance(a, np.ndarray):
        same = (a.dtype, a.shape, a.tobytes()) == (b.dtype, b.shape, b.tobytes())
        return [] if same else [f"{at}: {a.dtype}{a.shape} against {b.dtype}{b.shape}"]
    if is_dataclass(a):
        return _of_parts({f.name: (getattr(a, f.name), getattr(b, f.name)) for f in fields(a)}, at)
    if isinstance(a, Mapping):
        if list(a) != list(b):
            return [f"{at}: {list(a)} against {list(b)}"]
        return _of_parts({key: (a[key], b[key]) for key in a}, at)
    if isinstance(a, list | tuple):
        if len(a) != len(b):
            return [f"{at}: {len(a)} against {len(b)} elements"]
        return _of_parts(dict(enumerate(zip(a, b, strict=True))), at)
    if isinstance(a, float):
        return [] if struct.pack("<d", a) == struct.pack("<d", b) else [f"{at}: {a!r} against {b!r}"]
    return [] if a == b else [f"{at}: {a!r} against {b!r}"]


def _of_parts(parts, at):
    return [found for name, (a, b) in parts.items() for found in differences(a, b, f"{at}.{name}")]
