"""Bytes of a file or a chunk, read by position and never beyond an end fixed at opening."""

import re
from collections.abc import Iterator
from typing import BinaryIO, Protocol

# Read ahead little at first: what is looked for is mostly near.
_FIRST_BLOCK, _LARGEST_BLOCK = 1 << 12, 1 << 20


class BrokenRecordError(Exception):
    """The bytes at a position are no record."""


class Window(Protocol):
    """A readable stretch of bytes."""

    size: int

    def read(self, position: int, count: int) -> bytes:
        """Up to `count` bytes at a position; fewer at the end."""
        ...


class FileWindow:
    """A file up to the size it has now: what a recorder appends later is not seen."""

    def __init__(self, file: BinaryIO, size: int) -> None:
        self._file = file
        self.size = size

    def read(self, position: int, count: int) -> bytes:
        """Up to `count` bytes at a position."""
        self._file.seek(position)
        return self._file.read(max(0, min(count, self.size - position)))


class BytesWindow:
    """The content of a chunk."""

    def __init__(self, content: bytes) -> None:
        self._content = content
        self.size = len(content)

    def read(self, position: int, count: int) -> bytes:
        """Up to `count` bytes at a position."""
        return self._content[position : position + count]


def exactly(window: Window, position: int, count: int) -> bytes:
    """Read `count` bytes.

    Raises
    ------
    BrokenRecordError
        The window ends before.
    """
    # Asked of the window first, lest a claimed size becomes memory.
    if count < 0 or position + count > window.size:
        raise BrokenRecordError("a record reaches beyond the end")
    found = window.read(position, count)
    if len(found) < count:
        raise BrokenRecordError("the file became shorter while it was read")
    return found


def matches(window: Window, pattern: re.Pattern[bytes], position: int, longest: int) -> Iterator[int]:
    """Positions from `position` on where a pattern of at most `longest` bytes begins."""
    length = _FIRST_BLOCK
    while position < window.size:
        block = window.read(position, length + longest)
        if not block:
            return
        for match in pattern.finditer(block):
            if match.start() < length:
                yield position + match.start()
        position += length
        length = min(2 * length, _LARGEST_BLOCK)
