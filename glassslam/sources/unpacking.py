"""Compressed chunks unpacked within bounds, and as far as they go."""

import bz2
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lz4.frame import LZ4FrameDecompressor  # type: ignore[import-untyped]

from glassslam.sources.failures import describe

if sys.version_info >= (3, 14):
    from compression.zstd import ZstdDecompressor
else:
    from backports.zstd import ZstdDecompressor

# Recorders write chunks of about 1 MB; one message more than that fills a chunk of its own.
LARGEST_CHUNK = 128 << 20

_DECOMPRESSORS: dict[str, Callable[[], Any]] = {
    "bz2": bz2.BZ2Decompressor,
    "lz4": LZ4FrameDecompressor,
    "zstd": ZstdDecompressor,
}
_STORED = ("none", "")
# Small enough to keep what comes before the damage: a decompressor that fails returns nothing of that step.
_STEP_BYTES = 1024
_READ_BYTES = 1 << 20


@dataclass(frozen=True, slots=True)
class Content:
    """The content of a chunk up to its end or the first damage, and what is wrong with it ("": nothing)."""

    data: bytes
    problem: str = ""


def unpack(data: bytes, compression: str, claimed: int = LARGEST_CHUNK, *, exact: bool = True) -> Content:
    """Unpack a chunk; memory never exceeds what it claims to hold, nor the largest chunk allowed.

    Parameters
    ----------
    data : bytes
        The chunk as stored.
    compression : str
        "none" or "", "bz2", "lz4" or "zstd".
    claimed : int
        Size of the content as the file announces it, bytes.
    exact : bool
        Whether less content than claimed is a fault.
    """
    if compression in _STORED:
        return Content(data)
    if compression not in _DECOMPRESSORS:
        return Content(b"", f"Compression {compression!r} is not supported")
    if claimed > LARGEST_CHUNK:
        limit = f"{LARGEST_CHUNK / 1e6:.0f} MB"
        return Content(b"", f"a chunk claims to hold {claimed / 1e6:.0f} MB, more than the {limit} allowed")
    try:
        parts = b"".join(_unpacked(data, compression, claimed, max(len(data), 1)))
    except Exception as error:  # each library has exceptions of its own
        return Content(_as_far_as_it_goes(data, compression, claimed), describe(error))
    problem = ""
    if len(parts) > claimed:
        problem = f"a chunk holds more than the {claimed} bytes it claims"
    elif len(parts) < claimed and exact:
        problem = f"a chunk holds {len(parts)} of the {claimed} bytes it claims"
    return Content(parts[:claimed], problem)


def _as_far_as_it_goes(data: bytes, compression: str, claimed: int) -> bytes:
    found = bytearray()
    try:
        for part in _unpacked(data, compression, claimed, _STEP_BYTES):
            found += part
    except Exception:  # noqa: S110  (it failed before: what matters is what came until then)
        pass
    return bytes(found[:claimed])


def _unpacked(data: bytes, compression: str, claimed: int, step: int) -> Iterator[bytes]:
    """The content in parts, at most one byte more than claimed; frames that follow each other are joined."""
    decompressor = _DECOMPRESSORS[compression]()
    room, position = claimed + 1, 0
    fed = b""
    while room > 0:
        if decompressor.eof:
            rest = decompressor.unused_data or b""
            if not rest and position >= len(data):
                return
            decompressor, fed = _DECOMPRESSORS[compression](), rest
        elif decompressor.needs_input and not fed:
            if position >= len(data):
                return
            fed, position = data[position : position + step], position + step
        part = decompressor.decompress(fed, max_length=room)
        fed = b""
        room -= len(part)
        yield part


def unpacked_size(path: Path, most: int) -> int:
    """Bytes a zstd file unpacks to, counted without keeping them and no further than just above `most`."""
    total = 0
    with path.open("rb") as file:
        decompressor = ZstdDecompressor()
        while total <= most:
            if decompressor.eof:
                fed = decompressor.unused_data or file.read(_READ_BYTES)
                decompressor = ZstdDecompressor()
            else:
                fed = file.read(_READ_BYTES) if decompressor.needs_input else b""
            if not fed and decompressor.needs_input:
                return total
            total += len(decompressor.decompress(fed, max_length=_READ_BYTES))
    return total
