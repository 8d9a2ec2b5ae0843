"""Pages that a recorder has left beside a database: those not merged into it yet, or those to go back to.

The formats are described in "Database File Format" of the SQLite documentation, sections 3 (rollback journal)
and 4 (write-ahead log). SQLite would merge them into the file of the user; here they are laid over it.
"""

import struct
import tempfile
import weakref
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

import numpy as np

from glassslam.sources.sqlite_kernels import wal_checksum
from glassslam.sources.windows import BrokenRecordError, FileWindow, exactly

UNFINISHED = "a transaction that was never finished"
NO_LOG = "no log of this database"

_WAL_MAGIC = {0x377F0682: "<u4", 0x377F0683: ">u4"}
_WAL_HEADER, _FRAME_HEADER = 32, 24
_JOURNAL_MAGIC = bytes.fromhex("d9d505f920a163d7")
_JOURNAL_HEADER = 28
_ALL_PAGES = 0xFFFFFFFF
LARGEST_IN_MEMORY = 64 << 20

_wal_header = struct.Struct(">8I").unpack
_frame_header = struct.Struct(">6I").unpack
_journal_header = struct.Struct(">8s5I").unpack


class Overlay:
    """Pages that take the place of those of the file.

    Attributes
    ----------
    count : int
        Pages of the database with them.
    path : Path
        Where they were read.
    offset, unused : int
        Where in it begins what is of no use, and its length, bytes.
    reason : str
        What is wrong with that; empty where nothing is.
    """

    def __init__(self, path: Path, page_size: int) -> None:
        self.path = path
        self.count, self.offset, self.unused, self.reason = 0, 0, 0, ""
        self._page_size = page_size
        self._places: dict[int, int] = {}
        self._staged: dict[int, int] = {}
        # Copied: a recorder that still runs writes over its log.
        self._copy: IO[bytes] = tempfile.SpooledTemporaryFile(LARGEST_IN_MEMORY)  # noqa: SIM115
        weakref.finalize(self, self._copy.close)

    def __len__(self) -> int:
        return len(self._places)

    def __contains__(self, number: int) -> bool:
        return number in self._places

    def stage(self, number: int, page: bytes) -> None:
        """Keep a page until its transaction ends."""
        self._staged[number] = self._copy.seek(0, 2)
        self._copy.write(page)

    def commit(self, count: int) -> None:
        """Lay what was staged over what was there; the database then has this many pages."""
        self._places.update(self._staged)
        self._staged.clear()
        self.count = count

    def page(self, number: int) -> bytes:
        """A page that is in here."""
        self._copy.seek(self._places[number])
        return self._copy.read(self._page_size)

    def give_up(self, offset: int, unused: int, reason: str) -> "Overlay":
        """Note that the rest of the log is of no use."""
        self.offset, self.unused, self.reason = offset, unused, reason
        return self


def logs_beside(database: Path) -> tuple[Path, Path]:
    """Where SQLite keeps the write-ahead log and the rollback journal of a database."""
    return database.with_name(f"{database.name}-wal"), database.with_name(f"{database.name}-journal")


def read_overlay(database: Path, page_size: int, pages: int) -> Overlay | None:
    """The pages of the last finished transaction that the file does not hold; None where it holds all.

    Parameters
    ----------
    database : Path
        The file.
    page_size, pages : int
        Length of its pages in bytes, and how many it holds.
    """
    wal, journal = logs_beside(database)
    for path, read in ((wal, _read_wal), (journal, _read_journal)):
        try:
            size = path.stat().st_size
        except OSError:
            continue
        if size:
            with path.open("rb") as file:
                found = read(path, FileWindow(file, size), page_size)
            if path == journal and 0 < found.count < pages:
                found.path = database
                found.give_up(found.count * page_size, (pages - found.count) * page_size, UNFINISHED)
            if len(found) or found.reason:
                found.count = found.count or pages
                return found
    return None


@dataclass(slots=True)
class _Frames:
    """The frames of a write-ahead log one after the other, as long as their checksums fit."""

    window: FileWindow
    page_size: int
    order: str
    salt: tuple[int, int]
    sums: tuple[int, int]
    end: int = field(default=_WAL_HEADER)

    def __iter__(self) -> Iterator[tuple[int, int, bytes]]:
        """Number of the page, size of the database where a transaction ends with it, else 0, and the page."""
        while self.end + _FRAME_HEADER + self.page_size <= self.window.size:
            head = self.window.read(self.end, _FRAME_HEADER)
            page = self.window.read(self.end + _FRAME_HEADER, self.page_size)
            number, count, *rest = _frame_header(head)
            if tuple(rest[:2]) != self.salt:
                return
            words = np.frombuffer(head[:8] + page, dtype=self.order).astype(np.uint32)
            sums = wal_checksum(words, *self.sums)
            if tuple(rest[2:]) != tuple(map(int, sums)) or number == 0:
                return
            self.sums = sums
            self.end += _FRAME_HEADER + self.page_size
            yield number, count, page


def _read_wal(path: Path, window: FileWindow, page_size: int) -> Overlay:
    overlay = Overlay(path, page_size)
    try:
        header = exactly(window, 0, _WAL_HEADER)
    except BrokenRecordError:
        return overlay.give_up(0, window.size, NO_LOG)
    magic, _, size, _, *salt_and_sums = _wal_header(header)
    order = _WAL_MAGIC.get(magic, "")
    if not order or size != page_size:
        return overlay.give_up(0, window.size, NO_LOG)
    words = np.frombuffer(header[:24], dtype=order).astype(np.uint32)
    sums = wal_checksum(words, 0, 0)
    if tuple(salt_and_sums[2:]) != tuple(map(int, sums)):
        return overlay.give_up(0, window.size, NO_LOG)
    salt = salt_and_sums[0], salt_and_sums[1]
    frames = _Frames(window, page_size, order, salt, sums)
    committed = _WAL_HEADER
    for number, count, page in frames:
        overlay.stage(number, page)
        if count:
            overlay.commit(count)
            committed = frames.end
    unused = _written_after(window, committed, salt, page_size)
    return overlay.give_up(committed, unused, UNFINISHED) if unused else overlay


def _written_after(window: FileWindow, position: int, salt: tuple[int, int], page_size: int) -> int:
    """Bytes of frames behind the last finished transaction; those of earlier rounds do not count."""
    end = position
    while end + _FRAME_HEADER <= window.size:
        _, _, *rest = _frame_header(window.read(end, _FRAME_HEADER))
        if tuple(rest[:2]) != salt:
            break
        end = min(end + _FRAME_HEADER + page_size, window.size)
    return end - position


def _read_journal(path: Path, window: FileWindow, page_size: int) -> Overlay:
    """The pages as they were before the transaction that the recorder was about to write."""
    overlay, position, known = Overlay(path, page_size), 0, set[int]()
    while position + _JOURNAL_HEADER <= window.size:
        magic, records, nonce, count, sector, size = _journal_header(window.read(position, _JOURNAL_HEADER))
        if magic != _JOURNAL_MAGIC or (position == 0 and size != page_size):
            break  # a journal that was done with is overwritten with zeros
        count = overlay.count or count
        position += max(sector, _JOURNAL_HEADER)
        if records == _ALL_PAGES:
            records = (window.size - position) // (page_size + 8)
        for _ in range(records):
            record = window.read(position, page_size + 8)
            if len(record) < page_size + 8 or not _is_sound(record, nonce, page_size):
                break
            number = int.from_bytes(record[:4], "big")
            if number not in known and number <= count:
                known.add(number)
                overlay.stage(number, record[4:-4])
            position += page_size + 8
        overlay.commit(count)
        position = -(-position // max(sector, 1)) * max(sector, 1)
    return overlay


def _is_sound(record: bytes, nonce: int, page_size: int) -> bool:
    """Whether the checksum of a page fits: every 200th byte counted from its end."""
    page = record[4:-4]
    total = nonce + sum(page[k] for k in range(page_size - 200, 0, -200))
    return total & 0xFFFFFFFF == int.from_bytes(record[-4:], "big")
