"""A ROS2 sqlite3 bag whose database is damaged: its rows, found page by page."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Connection, ConnectionExtRosbag2, MessageDefinition, MessageDefinitionFormat

from glassslam.records import Damage
from glassslam.sources.sqlitelogs import NO_LOG, Overlay
from glassslam.sources.sqlitepages import Cell, PageFile, announced_size, serial_types, values
from glassslam.sources.windows import BrokenRecordError

_ENCODINGS = {"ros2msg": MessageDefinitionFormat.MSG, "ros2idl": MessageDefinitionFormat.IDL}
_INTEGERS = frozenset({1, 2, 3, 4, 5, 6, 8, 9})


@dataclass(slots=True)
class SqliteIndex:
    """What was found.

    Attributes
    ----------
    connections : list of Connection
        Topics, types and definitions, with the number of messages.
    rows : ndarray of int64, shape (n, 6)
        Record time (ns), row number, topic, page, offset in the page and length of every message, in the
        order of the times.
    damage : list of Damage
        What could not be read.
    """

    connections: list[Connection]
    rows: NDArray[np.int64]
    damage: list[Damage] = field(default_factory=list)


def scan_sqlite(path: Path, overlay: Overlay | None = None) -> SqliteIndex:
    """Find every message of a database, as far as the file reaches at this moment.

    Parameters
    ----------
    path : Path
        The file.
    overlay : Overlay, optional
        What a recorder has left beside it.

    Raises
    ------
    BrokenRecordError
        Nothing can be told of it.
    """
    with path.open("rb") as file:
        pages = PageFile(path, file, overlay)
        tables = dict(_tables(pages))
        definitions = dict(_definitions(pages, tables.get("message_definitions", 0)))
        connections = list(_connections(pages, tables.get("topics", 0), definitions))
        rows = _messages(pages, {connection.id for connection in connections})
    counted = [c._replace(msgcount=int((rows[:, 2] == c.id).sum())) for c in connections]
    if overlay is None:
        return SqliteIndex(counted, rows, _damage(path, pages.page_size, rows))
    return SqliteIndex(counted, rows, _damage_below(path, pages, overlay, rows))


def message_of(pages: PageFile, row: NDArray[np.int64]) -> bytes:
    """The serialised message of a row."""
    time, rowid, topic, page, offset, length = row.tolist()
    columns = values(pages.record(Cell(rowid, page, offset, length)))
    # Where a recorder still writes, something else may stand in that place by now.
    if len(columns) != 4 or columns[1:3] != [topic, time] or not isinstance(columns[3], bytes):
        raise BrokenRecordError("a message that is none")
    return columns[3]


def _tables(pages: PageFile) -> Iterator[tuple[str, int]]:
    """Names and first pages of the tables."""
    for _, row in _rows(pages, 1):
        if len(row) == 5 and row[0] == "table" and isinstance(row[3], int):
            yield str(row[1]), row[3]


def _definitions(pages: PageFile, root: int) -> Iterator[tuple[str, MessageDefinition]]:
    for _, row in _rows(pages, root):
        if len(row) >= 4:
            kind = _ENCODINGS.get(str(row[2]), MessageDefinitionFormat.NONE)
            yield str(row[1]), MessageDefinition(kind, str(row[3]))


def _connections(
    pages: PageFile, root: int, definitions: dict[str, MessageDefinition]
) -> Iterator[Connection]:
    nothing = MessageDefinition(MessageDefinitionFormat.NONE, "")
    owner: Any = None  # a connection names a reader, of which nothing here makes use
    for key, row in _rows(pages, root):
        if len(row) >= 4:
            name, msgtype, encoding = (str(value) for value in row[1:4])
            ext = ConnectionExtRosbag2(encoding, [])
            yield Connection(key, name, msgtype, definitions.get(msgtype, nothing), "", 0, ext, owner)


def _rows(pages: PageFile, root: int) -> Iterator[tuple[int, list[Any]]]:
    """Numbers and values of the rows of a small table, as far as they can be read."""
    for cell in pages.table(root):
        try:
            yield cell.rowid, values(pages.record(cell))
        except BrokenRecordError:
            continue


def _messages(pages: PageFile, topics: set[int]) -> NDArray[np.int64]:
    found: dict[int, tuple[int, ...]] = {}
    for number in pages.leaves():
        for cell in pages.cells(number):
            message = _message(pages, cell)
            if message is not None and message[1] in topics:
                time, topic = message
                found.setdefault(cell.rowid, (time, cell.rowid, topic, cell.page, cell.offset, cell.length))
    rows = np.array(list(found.values()), dtype=np.int64).reshape(-1, 6)
    return rows[np.lexsort((rows[:, 1], rows[:, 0]))]


def _message(pages: PageFile, cell: Cell) -> tuple[int, int] | None:
    """Time and topic of a row that is a whole message: number, topic, time and a blob."""
    try:
        kinds, _ = serial_types(pages.head(cell))
        if len(kinds) != 4 or not set(kinds[1:3]) <= _INTEGERS or kinds[3] < 12 or kinds[3] % 2:
            return None
        _, topic, time, _ = values(pages.record(cell))
    except BrokenRecordError:
        return None
    return (time, topic) if isinstance(topic, int) and isinstance(time, int) else None


def _damage(path: Path, page_size: int, rows: NDArray[np.int64]) -> list[Damage]:
    """What the row numbers leave out, and what the header announces and the file does not hold."""
    size = path.stat().st_size
    missing = max(0, announced_size(path) - size)
    found = [*_left_out(path, page_size, rows)]
    if missing:
        times = rows[:, 0] / 1e9
        last = float(times[-1]) if len(times) else None
        seconds = (float(np.ptp(times)) if len(times) else 0.0) * missing / max(size, 1)
        lost = round(missing * len(rows) / max(size, 1))
        reason = f"the file is cut off here, {missing} bytes are missing"
        found.append(Damage(str(path), size, 0, last, None if last is None else last + seconds, lost, reason))
    return found or [Damage(str(path), 0, 0, None, None, 0, "the database is malformed")]


def _damage_below(path: Path, pages: PageFile, overlay: Overlay, rows: NDArray[np.int64]) -> list[Damage]:
    """Pages that neither the file nor its log holds, rows that are left out, and what of the log is lost."""
    found = [*_left_out(path, pages.page_size, rows)]
    per_byte = len(rows) / max(1, pages.count * pages.page_size)
    last = float(rows[-1, 0]) / 1e9 if len(rows) else None
    missing = sum(not pages.holds(number) for number in range(1, pages.count + 1)) * pages.page_size
    if missing:
        reason = f"{missing} bytes of the database are missing"
        lost = round(missing * per_byte)
        found.append(Damage(str(path), path.stat().st_size, 0, None, None, lost, reason))
    if overlay.reason:
        lost = 0 if overlay.reason == NO_LOG else round(overlay.unused * per_byte)
        place = overlay.offset, overlay.unused, last, last
        found.append(Damage(str(overlay.path), *place, lost, overlay.reason))
    return found


def _left_out(path: Path, page_size: int, rows: NDArray[np.int64]) -> Iterator[Damage]:
    """Gaps between the numbers of the rows, which a recorder gives out without any."""
    ordered = rows[np.argsort(rows[:, 1])]
    steps = np.diff(ordered[:, 1], prepend=0) - 1
    for k in np.flatnonzero(steps > 0).tolist():
        before, after = ordered[max(k - 1, 0)], ordered[k]
        offset = int(before[3] - 1) * page_size + int(before[4])
        first, last = sorted((float(before[0]) / 1e9, float(after[0]) / 1e9))
        yield Damage(str(path), offset, 0, first, last, int(steps[k]), "rows of the database are missing")
