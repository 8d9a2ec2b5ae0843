"""SQLite files read page by page, without the tree that leads to the pages.

The format is described in "Database File Format" of the SQLite documentation, sections 1.3, 1.6 and 2.1.
"""

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, TypeAlias

from glassslam.sources.sqlitelogs import Overlay, read_overlay
from glassslam.sources.windows import BrokenRecordError

Value: TypeAlias = "int | bytes | str | float | None"

HEADER_BYTES = 100
_LEAF, _INTERIOR = 0x0D, 0x05
_INTEGER_BYTES = {1: 1, 2: 2, 3: 3, 4: 4, 5: 6, 6: 8}
_NULL, _REAL, _ZERO, _ONE, _FIRST_BLOB = 0, 7, 8, 9, 12
_MOST_COLUMNS = 100


def announced_size(path: Path) -> int:
    """How long the file should be by its header, bytes."""
    with path.open("rb") as file:
        header = file.read(HEADER_BYTES)
    return int.from_bytes(header[28:32], "big") * _page_size(header)


def change_counter(path: Path) -> bytes:
    """The bytes of the header that every transaction changes."""
    with path.open("rb") as file:
        return file.read(HEADER_BYTES)[24:32]


def overlay_of(path: Path, *, even_empty: bool = False) -> Overlay | None:
    """The pages a recorder has left beside a database; None where the file holds all.

    Parameters
    ----------
    path : Path
        The file.
    even_empty : bool
        Whether to give an overlay without pages, rather than None.

    Raises
    ------
    BrokenRecordError
        Not even the size of a page can be told.
    """
    with path.open("rb") as file:
        pages = PageFile(path, file)
        found = read_overlay(path, pages.page_size, pages.count)
        if found is None and even_empty:
            found = Overlay(path, pages.page_size)
            found.commit(pages.count)
        return found


def _page_size(header: bytes) -> int:
    size = int.from_bytes(header[16:18], "big")
    # The largest page size does not fit into its two bytes and is written as 1.
    return 65536 if size == 1 else size


@dataclass(frozen=True, slots=True)
class Cell:
    """A row: its number, where it stands (page and offset in it), and the length of its record."""

    rowid: int
    page: int
    offset: int
    length: int


class PageFile:
    """The whole pages a file holds at this moment.

    Raises
    ------
    BrokenRecordError
        Not even the size of a page can be told.
    """

    def __init__(self, path: Path, file: BinaryIO, overlay: Overlay | None = None) -> None:
        header = file.read(HEADER_BYTES)
        self.page_size = _page_size(header)
        if len(header) < HEADER_BYTES or self.page_size < 512 or self.page_size & (self.page_size - 1):
            raise BrokenRecordError("a header that tells no size of pages")
        self._usable = self.page_size - header[20]
        self._file = file
        self._overlay = overlay
        self._held = path.stat().st_size // self.page_size
        self.count = self._held if overlay is None else overlay.count

    def page(self, number: int) -> bytes:
        """One page; the first has number 1."""
        if self._overlay is not None and number in self._overlay:
            return self._overlay.page(number)
        if not 0 < number <= min(self.count, self._held):
            raise BrokenRecordError("a page that the file does not hold")
        self._file.seek((number - 1) * self.page_size)
        return self._file.read(self.page_size)

    def holds(self, number: int) -> bool:
        """Whether the page of this number can be read."""
        return 0 < number <= self._held or (self._overlay is not None and number in self._overlay)

    def leaves(self) -> Iterator[int]:
        """Numbers of the pages that look like leaves of a table."""
        for number in range(1, self.count + 1):
            if not self.holds(number):
                continue
            page = self.page(number)
            if page[HEADER_BYTES if number == 1 else 0] == _LEAF:
                yield number

    def cells(self, number: int) -> Iterator[Cell]:
        """The rows on a leaf of a table, as far as they make sense."""
        page = self.page(number)
        start = HEADER_BYTES if number == 1 else 0
        for k in range(int.from_bytes(page[start + 3 : start + 5], "big")):
            pointer = start + 8 + 2 * k
            position = int.from_bytes(page[pointer : pointer + 2], "big")
            if pointer + 2 > len(page) or not start + 8 < position < len(page):
                continue
            try:
                length, after = _varint(page, position)
                rowid, after = _varint(page, after)
            except BrokenRecordError:
                continue
            yield Cell(rowid, number, after, length)

    def table(self, root: int) -> Iterator[Cell]:
        """The rows of a small table by its tree; branches that cannot be read are left out."""
        waiting, seen = [root], set[int]()
        while waiting:
            number = waiting.pop()
            if number in seen:
                continue
            seen.add(number)
            try:
                page = self.page(number)
            except BrokenRecordError:
                continue
            start = HEADER_BYTES if number == 1 else 0
            if page[start] == _LEAF:
                yield from self.cells(number)
            elif page[start] == _INTERIOR:
                waiting += _children(page, start)

    def record(self, cell: Cell) -> bytes:
        """The record of a row, joined from all its pages.

        Raises
        ------
        BrokenRecordError
            A page of it is missing.
        """
        largest = self._usable - 35
        local = cell.length
        if cell.length > largest:
            smallest = (self._usable - 12) * 32 // 255 - 23
            local = smallest + (cell.length - smallest) % (self._usable - 4)
            local = local if local <= largest else smallest
        page = self.page(cell.page)
        end = cell.offset + local
        if cell.length > self.count * self.page_size or end > len(page):
            raise BrokenRecordError("a row that is longer than the file")
        parts, rest = [page[cell.offset : end]], cell.length - local
        following = int.from_bytes(page[end : end + 4], "big")
        while rest > 0:
            page = self.page(following)
            parts.append(page[4 : 4 + min(rest, self._usable - 4)])
            rest -= len(parts[-1])
            following = int.from_bytes(page[:4], "big")
        return b"".join(parts)

    def head(self, cell: Cell) -> bytes:
        """What of a record stands on the page of its row itself."""
        return self.page(cell.page)[cell.offset : cell.offset + cell.length]


def _children(page: bytes, start: int) -> list[int]:
    numbers = [int.from_bytes(page[start + 8 : start + 12], "big")]
    for k in range(int.from_bytes(page[start + 3 : start + 5], "big")):
        pointer = start + 12 + 2 * k
        position = int.from_bytes(page[pointer : pointer + 2], "big")
        numbers.append(int.from_bytes(page[position : position + 4], "big"))
    return numbers[::-1]


def _varint(data: bytes, position: int) -> tuple[int, int]:
    """A number of 1 to 9 bytes, and the position behind it."""
    value = 0
    for k in range(9):
        if position + k >= len(data):
            raise BrokenRecordError("a number that reaches beyond its page")
        byte = data[position + k]
        if k == 8:
            return (value << 8) | byte, position + 9
        value = (value << 7) | (byte & 0x7F)
        if byte < 0x80:
            return value, position + k + 1
    raise BrokenRecordError("a number without an end")


def serial_types(record: bytes) -> tuple[list[int], int]:
    """Types of the columns of a record, and where their values begin."""
    end, position = _varint(record, 0)
    types: list[int] = []
    while position < end and len(types) < _MOST_COLUMNS:
        kind, position = _varint(record, position)
        types.append(kind)
    return types, end


def values(record: bytes, most: int = _MOST_COLUMNS) -> list[Value]:
    """The first values of a record.

    Raises
    ------
    BrokenRecordError
        The bytes are no record.
    """
    types, position = serial_types(record)
    found: list[Value] = []
    for kind in types[:most]:
        size = width(kind)
        data = record[position : position + size]
        if len(data) < size:
            raise BrokenRecordError("a record that ends within a value")
        found.append(_value(kind, data))
        position += size
    return found


def width(kind: int) -> int:
    """Bytes of a value of a serial type."""
    if kind >= _FIRST_BLOB:
        return (kind - _FIRST_BLOB) // 2
    return 8 if kind == _REAL else _INTEGER_BYTES.get(kind, 0)


def _value(kind: int, data: bytes) -> Value:
    if kind in _INTEGER_BYTES:
        return int.from_bytes(data, "big", signed=True)
    if kind in (_ZERO, _ONE):
        return kind - _ZERO
    if kind == _REAL:
        return float(struct.unpack(">d", data)[0])
    if kind >= _FIRST_BLOB:
        return data if kind % 2 == 0 else data.decode(errors="replace")
    return None
