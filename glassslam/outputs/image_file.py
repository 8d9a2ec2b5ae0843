"""Pictures read from files of anybody: what is damaged or absurdly large is refused before it is decoded."""

import re
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from glassslam.errors import OutputError
from glassslam.regularfile import regular

MOST_PIXELS = 400_000_000
_PNG = b"\x89PNG\r\n\x1a\n"
# Decoders complain of the others, though nothing of a picture depends on them.
_CRITICAL = (b"IHDR", b"PLTE", b"tRNS", b"IDAT", b"IEND")
_CHANNELS = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}
# First pixel and step, along x and y, of the passes of an interlaced picture (PNG specification, 8.2).
_WHOLE = ((0, 0, 1, 1),)
_PASSES = (
    (0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2),
)  # fmt: skip
_NETPBM = re.compile(rb"P([1-6])(?:\s|#[^\n]*\n)+(\d{1,9})(?:\s|#[^\n]*\n)+(\d{1,9})\s")


def read_image(location: Path, *, colour: bool = False) -> NDArray[np.uint8]:
    """Pixels of a picture as OpenCV gives them, shape (rows, columns) or (rows, columns, 3) in BGR.

    Decoders write to standard error as they please, and believe any size that a header states: PNG is
    checked before it is decoded.

    Parameters
    ----------
    location : Path
        PGM, PNG, or what else OpenCV reads.
    colour : bool
        Whether the colours are wanted, rather than shades of grey.

    Raises
    ------
    OutputError
        The file cannot be read, is no picture or a damaged one, or has too many pixels.
    """
    import cv2  # noqa: PLC0415  (only pictures need it)

    try:
        data = regular(location).read_bytes()
    except OSError as error:
        raise OutputError(f"cannot read {location}: {error.strerror}") from error
    sound = _checked(data, location)
    level = cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    try:
        mode = cv2.IMREAD_COLOR if colour else cv2.IMREAD_GRAYSCALE
        image = cv2.imdecode(np.frombuffer(sound, dtype=np.uint8), mode) if sound else None
    except cv2.error:
        image = None
    finally:
        cv2.utils.logging.setLogLevel(level)
    if image is None:
        raise OutputError(f"{location} is not an image")
    return np.asarray(image, dtype=np.uint8)


def _checked(data: bytes, location: Path) -> bytes:
    """The file as it can be given to a decoder."""
    if data.startswith(_PNG):
        return _checked_png(data, location)
    if match := _NETPBM.match(data):
        kind, width, height = (int(group) for group in match.groups())
        _check_size(width, height, location)
        least = {4: width * height // 8, 5: width * height, 6: 3 * width * height}.get(kind, 0)
        if len(data) - match.end() < least:
            raise _damaged(location)
    return data


def _checked_png(data: bytes, location: Path) -> bytes:
    """The chunks a picture consists of, all of them sound."""
    try:
        chunks = list(_chunks(data))
        header = struct.unpack(">IIBBBBB", chunks[0][1])
        packed = b"".join(content for name, content in chunks if name == b"IDAT")
    except (struct.error, IndexError, ValueError, zlib.error) as error:
        raise _damaged(location) from error
    width, height, depth, kind, _, _, interlaced = header
    _check_size(width, height, location)
    if chunks[0][0] != b"IHDR" or not width * height or kind not in _CHANNELS or interlaced > 1:
        raise _damaged(location)
    rows = list(_rows(width, height, depth * _CHANNELS[kind], _PASSES if interlaced else _WHOLE))
    if not _inflates(packed, rows):
        raise _damaged(location)
    return _PNG + b"".join(_packed(*chunk) for chunk in chunks if chunk[0] in _CRITICAL)


def _chunks(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Name and content of the chunks up to the end mark; a ValueError where one is damaged."""
    at, name = len(_PNG), b""
    while name != b"IEND":
        length, name = struct.unpack_from(">I4s", data, at)
        content = data[at + 8 : at + 8 + length]
        if data[at : at + 12 + length] != _packed(name, content):
            raise ValueError
        yield name, content
        at += 12 + length


def _packed(name: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))


def _rows(
    width: int, height: int, bits: int, passes: tuple[tuple[int, int, int, int], ...]
) -> Iterator[tuple[int, int]]:
    """Number and length in bytes of the rows of every pass, each with its filter in front."""
    for x, y, step_x, step_y in passes:
        columns, rows = -(-(width - x) // step_x), -(-(height - y) // step_y)
        if columns > 0 and rows > 0:
            yield rows, 1 + (columns * bits + 7) // 8


def _inflates(packed: bytes, rows: list[tuple[int, int]]) -> bool:
    """Whether the packed pixels are whole, and every row begins with a filter that exists."""
    size = sum(count * length for count, length in rows)
    unpacker = zlib.decompressobj()
    try:
        pixels = np.frombuffer(unpacker.decompress(packed, size + 1), dtype=np.uint8)
    except zlib.error:
        return False
    if pixels.size != size or not unpacker.eof:
        return False
    at, sound = 0, True
    for count, length in rows:
        sound = sound and bool((pixels[at : at + count * length : length] <= 4).all())
        at += count * length
    return sound


def _check_size(width: int, height: int, location: Path) -> None:
    if width * height > MOST_PIXELS:
        raise OutputError(f"{location}: a picture of {width} x {height} pixels is too large")


def _damaged(location: Path) -> OutputError:
    return OutputError(f"{location} is a damaged image", "copy it again")
