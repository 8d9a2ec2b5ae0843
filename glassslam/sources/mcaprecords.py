"""Records of an mcap file: parsed one by one, and found again behind damage.

The format is described in the MCAP specification, section Records.
"""

import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass

from glassslam.sources.windows import BrokenRecordError, Window, exactly, matches

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX = 1, 2, 3, 4, 5, 6, 7
DATA_END = 15
PREFIX_BYTES = 9
MESSAGE_HEAD_BYTES = 22

_LARGEST_OP = 15
# The length of a chunk below 2^40, its fixed fields, and the name of its compression.
_CHUNK_MARK = re.compile(
    rb"(?=\x06[\s\S]{5}\x00\x00\x00[\s\S]{28}(?:\x00{4}|\x03\x00\x00\x00lz4|\x04\x00\x00\x00zstd))"
)
_MESSAGE_MARK = re.compile(rb"(?=\x05[\s\S]{4}\x00{4})")
_MARK_BYTES = 64

_prefix = struct.Struct("<BQ").unpack
_message_head = struct.Struct("<HIQQ").unpack
_chunk_head = struct.Struct("<QQQI").unpack
_u16, _u32, _u64 = (struct.Struct(f"<{kind}").unpack_from for kind in "HIQ")


@dataclass(frozen=True, slots=True)
class Record:
    """A record: its kind, and where it, its content and its end are."""

    op: int
    start: int
    content: int
    end: int


@dataclass(frozen=True, slots=True)
class ChunkHead:
    """What a chunk says of itself: times (ns), where its data is, how it is packed, and what it claims."""

    start_time: int
    end_time: int
    data: int
    size: int
    compression: str
    claimed: int
    crc: int


def read_record(window: Window, position: int) -> Record:
    """The record at a position; its end may lie beyond that of the window.

    Raises
    ------
    BrokenRecordError
        There is none.
    """
    op, length = _prefix(exactly(window, position, PREFIX_BYTES))
    if not 0 < op <= _LARGEST_OP:
        raise BrokenRecordError("a record of unknown kind")
    content = position + PREFIX_BYTES
    return Record(op, position, content, content + length)


def content_of(window: Window, record: Record) -> bytes:
    """The content of a record."""
    return exactly(window, record.content, record.end - record.content)


def message_head(window: Window, record: Record) -> tuple[int, int]:
    """Channel and record time (ns) of a message."""
    if record.end - record.content < MESSAGE_HEAD_BYTES:
        raise BrokenRecordError("a message without its head")
    channel, _, time, _ = _message_head(exactly(window, record.content, MESSAGE_HEAD_BYTES))
    return channel, time


def chunk_head(window: Window, record: Record) -> ChunkHead:
    """What a chunk says of itself.

    Raises
    ------
    BrokenRecordError
        Its lengths contradict each other.
    """
    start_time, end_time, claimed, crc = _chunk_head(exactly(window, record.content, 28))
    (length,) = _u32(exactly(window, record.content + 28, 4))
    if length > 64:
        raise BrokenRecordError("a chunk with an impossible name of its compression")
    name = exactly(window, record.content + 32, length)
    (size,) = _u64(exactly(window, record.content + 32 + length, 8))
    data = record.content + 40 + length
    if data + size != record.end:
        raise BrokenRecordError("a chunk whose lengths contradict each other")
    return ChunkHead(start_time, end_time, data, size, name.decode(errors="replace"), claimed, crc)


def next_chunk(window: Window, position: int) -> Record | None:
    """The first chunk at or behind a position, if there is any; it may reach beyond the end."""
    for start in matches(window, _CHUNK_MARK, position, _MARK_BYTES):
        try:
            record = read_record(window, start)
            chunk_head(window, record)
        except BrokenRecordError:
            continue
        return record
    return None


def next_message(window: Window, position: int, end: int, channels: set[int]) -> Record | None:
    """The first whole message of a known channel at or behind a position and before an end."""
    for start in matches(window, _MESSAGE_MARK, position, _MARK_BYTES):
        if start >= end:
            return None
        try:
            record = read_record(window, start)
            channel, _ = message_head(window, record)
            followed = record.end == end or 0 < exactly(window, record.end, 1)[0] <= _LARGEST_OP
        except BrokenRecordError:
            continue
        if record.end <= end and channel in channels and followed:
            return record
    return None


def strings(content: bytes, position: int, count: int) -> Iterator[str]:
    """Texts that follow each other, each behind its length.

    Raises
    ------
    BrokenRecordError
        The content ends before, or holds no text.
    """
    for _ in range(count):
        text = content[position + 4 : position + 4 + _length(content, position)]
        position += 4 + len(text)
        try:
            yield text.decode()
        except UnicodeDecodeError as error:
            raise BrokenRecordError("a text that is none") from error


def _length(content: bytes, position: int) -> int:
    if position + 4 > len(content):
        raise BrokenRecordError("a record that ends within a text")
    length = int(_u32(content, position)[0])
    if position + 4 + length > len(content):
        raise BrokenRecordError("a text that reaches beyond its record")
    return length


def numbers16(content: bytes, count: int) -> tuple[int, ...]:
    """The first numbers of 16 bits of a record."""
    if len(content) < 2 * count:
        raise BrokenRecordError("a record that is too short")
    return tuple(int(_u16(content, 2 * k)[0]) for k in range(count))


def index_count(content: bytes) -> int:
    """How many messages a message index tells of."""
    if len(content) < 6:
        raise BrokenRecordError("an index that is too short")
    return int(_u32(content, 2)[0]) // 16
