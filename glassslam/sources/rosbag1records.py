"""Records of a ROS1 bag (format 2.0): parsed one by one, and found again behind damage.

The format is described in the ROS wiki, page Bags/Format/2.0.
"""

import re
import struct
from collections.abc import Collection
from dataclasses import dataclass

from glassslam.sources.windows import BrokenRecordError, Window, exactly, matches

MAGIC_BYTES = 13
MESSAGE, BAG_HEADER, INDEX, CHUNK, CHUNK_INFO, CONNECTION = 2, 3, 4, 5, 6, 7

# The fields a record must have, and the size of those whose size is known.
_FIELDS: dict[int, dict[bytes, int | None]] = {
    MESSAGE: {b"conn": 4, b"time": 8},
    BAG_HEADER: {b"index_pos": 8},
    INDEX: {b"conn": 4, b"count": 4},
    CHUNK: {b"compression": None, b"size": 4},
    CHUNK_INFO: {b"chunk_pos": 8, b"count": 4},
    CONNECTION: {b"conn": 4, b"topic": None},
}
# Real headers have some 100 bytes; a topic may be long.
_LARGEST_HEADER = 1 << 16
_MARK = re.compile(rb"\x04\x00\x00\x00op=[\x02\x05\x07]")
_MARK_BYTES = 8
# Fields stand in the order of their names: at most one stands before "op".
_BEFORE_MARK = 64

_u32 = struct.Struct("<I").unpack_from
_u64 = struct.Struct("<Q").unpack_from
_time = struct.Struct("<II").unpack_from


@dataclass(frozen=True, slots=True)
class Record:
    """A record: its kind, header fields, and where it and its data begin and end."""

    op: int
    fields: dict[bytes, bytes]
    start: int
    data: int
    end: int

    def number(self, name: bytes) -> int:
        """A field of 4 or 8 bytes."""
        value = self.fields[name]
        return int((_u32 if len(value) == 4 else _u64)(value)[0])

    @property
    def time(self) -> int:
        """Record time of a message, ns."""
        seconds, nanoseconds = _time(self.fields[b"time"])
        return int(seconds) * 10**9 + int(nanoseconds)


def read_record(window: Window, position: int) -> Record:
    """The record at a position; its end may lie beyond that of the window.

    Raises
    ------
    BrokenRecordError
        There is none.
    """
    (length,) = _u32(exactly(window, position, 4))
    if length > _LARGEST_HEADER:
        raise BrokenRecordError("a record with an impossible header")
    header = exactly(window, position + 4, length + 4)
    fields = read_fields(header[:length])
    op = fields.get(b"op", b"")
    wanted = _FIELDS.get(op[0]) if len(op) == 1 else None
    if wanted is None:
        raise BrokenRecordError("a record of unknown kind")
    for name, size in wanted.items():
        if name not in fields or (size is not None and len(fields[name]) != size):
            raise BrokenRecordError(f"a record without a proper field {name.decode()!r}")
    data = position + 4 + length + 4
    return Record(op[0], fields, position, data, data + _u32(header, length)[0])


def read_fields(header: bytes) -> dict[bytes, bytes]:
    """Header fields, each a length and `name=value`.

    Raises
    ------
    BrokenRecordError
        The bytes are no header.
    """
    fields: dict[bytes, bytes] = {}
    position, size = 0, len(header)
    while position < size:
        if position + 4 > size:
            raise BrokenRecordError("a header that ends within a field")
        (length,) = _u32(header, position)
        name, separator, value = header[position + 4 : position + 4 + length].partition(b"=")
        position += 4 + length
        if not separator or position > size:
            raise BrokenRecordError("a header that holds no fields")
        fields[name] = value
    return fields


def next_record(window: Window, position: int, ops: Collection[int]) -> Record | None:
    """The first message, chunk or connection, as far as wanted, at or behind a position, if there is any."""
    for mark in matches(window, _MARK, position, _MARK_BYTES):
        for start in range(mark - 4, max(position, mark - _BEFORE_MARK) - 1, -1):
            try:
                record = read_record(window, start)
            except BrokenRecordError:
                continue
            whole = record.end <= window.size or record.op == CHUNK
            if record.op in ops and record.data >= mark + _MARK_BYTES + 4 and whole:
                return record
    return None
