"""A ROS2 sqlite3 file read by its database, or past its damage by what a scan has found."""

from collections import Counter
from collections.abc import Collection, Generator
from pathlib import Path
from urllib.parse import quote

from rosbags.interfaces import Connection
from rosbags.rosbag2.metadata import ReaderMetadata
from rosbags.rosbag2.storage_sqlite3 import Sqlite3Reader

from glassslam.errors import RecordingError, UnreachableRecordingError
from glassslam.records import Damage
from glassslam.sources.failures import DAMAGED_HINT, REPAIR_TOOLS, reading
from glassslam.sources.sqlitelogs import Overlay, logs_beside
from glassslam.sources.sqlitepages import PageFile, announced_size, change_counter, overlay_of
from glassslam.sources.sqlitescan import SqliteIndex, message_of, scan_sqlite
from glassslam.sources.windows import BrokenRecordError

_FORMAT = "rosbag2-sqlite3"

Message = tuple[Connection, int, bytes]


class _ChangedError(RecordingError):
    """The file is not what it was at opening."""


class SqliteStorage(Sqlite3Reader):
    """Storage of one sqlite3 file.

    Messages come in the order of their record times, up to the last one there is at the first opening. What
    a recorder has left beside the file is read with it, and never merged into it. What is readable of a
    damaged database is read, unless `strict`, even where the damage shows only on the way.

    Attributes
    ----------
    is_scanned : bool
        Whether the rows were found without the database.
    """

    def __init__(self, path: Path, *, strict: bool = False) -> None:
        # The path becomes part of a URI, in which '?', '#' and '%' have a meaning.
        super().__init__(Path(quote(str(path))))
        self.file_path, self._strict = path, strict
        self._scanned: SqliteIndex | None = None
        self._overlay: Overlay | None = None
        self._last_row: int | None = None
        self._state = b""
        self._moved: list[Damage] = []

    @property
    def is_scanned(self) -> bool:
        """Whether the rows were found without the database."""
        return self._scanned is not None

    @property
    def damage(self) -> tuple[Damage, ...]:
        """What could not be read so far."""
        return () if self._scanned is None else (*self._scanned.damage, *self._moved)

    def open(self) -> None:
        """Open the database, or look for its rows where it cannot be trusted."""
        if self._scanned is None:
            try:
                with reading(self.file_path, _FORMAT):
                    self._overlay = overlay_of(self.file_path)
                    if self._overlay is None:
                        self._check_size()
                        super().open()
                        self._note_state()
                    else:
                        self._scanned = self._read_under(self._overlay)
            except RecordingError as error:
                self._scan(error)
        if self._scanned is not None:
            self._use(self._scanned)

    def close(self) -> None:
        """Close the database, where it is open."""
        if self.dbconn is not None:
            super().close()

    def messages(
        self, connections: Collection[Connection], start: int | None = None, stop: int | None = None
    ) -> Generator[Message, None, None]:
        """Connection, record time in ns and serialised message, from `start` up to before `stop`."""
        if self._scanned is not None:
            yield from self._scanned_messages(connections, start, stop)
            return
        latest: int | None = start
        given: Counter[tuple[int, bytes]] = Counter()
        try:
            with reading(self.file_path, _FORMAT):
                for connection, time, raw in self._stored_messages(connections, start, stop):
                    self._check_unchanged()
                    if time != latest:
                        latest = time
                        given.clear()
                    given[connection.id, raw] += 1
                    yield connection, time, raw
                self._check_unchanged()
        except _ChangedError:
            self._scanned = self._read_under(overlay_of(self.file_path, even_empty=True))
        except RecordingError as error:
            self._scan(error)
        else:
            return
        for connection, time, raw in self._scanned_messages(connections, latest, stop):
            if time == latest and given[connection.id, raw] > 0:
                given[connection.id, raw] -= 1
            else:
                yield connection, time, raw

    def _stored_messages(
        self, connections: Collection[Connection], start: int | None, stop: int | None
    ) -> Generator[Message, None, None]:
        """What the database gives; rows added since the first opening do not count."""
        assert self.dbconn is not None  # noqa: S101  (messages are read between open and close)
        wanted = {connection.id: connection for connection in connections}
        limits = (
            self._last_row,
            *wanted,
            -(2**63) if start is None else start,
            2**63 - 1 if stop is None else stop - 1,
        )
        marks = ",".join("?" * len(wanted))
        query = (
            "SELECT topic_id, timestamp, data FROM messages WHERE rowid <= ?"  # noqa: S608  (marks are marks)
            f" AND topic_id IN ({marks}) AND timestamp BETWEEN ? AND ? ORDER BY timestamp"
        )
        for topic, time, raw in self.dbconn.execute(query, limits):
            yield wanted[topic], time, raw

    def _check_unchanged(self) -> None:
        """SQLite is told that nobody writes: where somebody does, it may leave out rows without a word."""
        busy = any(log.exists() and log.stat().st_size for log in logs_beside(self.file_path))
        if busy or change_counter(self.file_path) != self._state:
            raise _ChangedError(f"cannot read {self.file_path}: another program is writing to it")

    def _note_state(self) -> None:
        if self._last_row is None and self.dbconn is not None:
            self._state = change_counter(self.file_path)
            found = self.dbconn.execute("SELECT max(rowid) FROM messages").fetchone()
            self._last_row = (found and found[0]) or 0

    def _read_under(self, overlay: Overlay | None) -> SqliteIndex:
        """The rows of a database with what stands beside it."""
        self._overlay = overlay
        index = self._known(scan_sqlite(self.file_path, overlay))
        if not len(index.rows) and not index.connections:
            raise RecordingError(f"cannot read {self.file_path}: database missing tables")
        if index.damage and self._strict:
            hint = DAMAGED_HINT.format(tool=REPAIR_TOOLS[_FORMAT])
            raise RecordingError(f"cannot read {self.file_path}: {index.damage[0].reason}", hint)
        return index

    def _check_size(self) -> None:
        """SQLite reads a file that is cut off as long as it does not touch the missing pages."""
        missing = announced_size(self.file_path) - self.file_path.stat().st_size
        if missing > 0:
            raise RecordingError(
                f"cannot read {self.file_path}: the last {missing} bytes are missing",
                DAMAGED_HINT.format(tool=REPAIR_TOOLS[_FORMAT]),
            )

    def _scan(self, error: RecordingError) -> None:
        """Look for rows; the error stands where there are none, or damage is not accepted."""
        if self._strict or isinstance(error.__cause__, OSError):
            raise error
        try:
            with reading(self.file_path, _FORMAT):
                index = self._known(scan_sqlite(self.file_path, self._overlay))
        except UnreachableRecordingError:  # the database tells a failing disk and damage with the same words
            raise
        except RecordingError:
            raise error from None
        if not len(index.rows):
            raise error
        self._scanned = index

    def _note_moved(self, stamp: float, reason: str) -> None:
        reason = f"while another program was writing: {reason}"
        if self._strict:
            raise RecordingError(f"cannot read {self.file_path}: {reason}")
        self._moved.append(Damage(str(self.file_path), 0, 0, stamp, stamp, 1, reason))

    def _known(self, index: SqliteIndex) -> SqliteIndex:
        """Without rows added since the first opening."""
        if self._last_row is not None:
            index.rows = index.rows[index.rows[:, 1] <= self._last_row]
        return index

    def _use(self, index: SqliteIndex) -> None:
        self.connections = list(index.connections)
        times = index.rows[:, 0]
        first, end = (int(times[0]), int(times[-1]) + 1) if len(times) else (2**63 - 1, 0)
        length = max(0, end - first)
        self.metadata = ReaderMetadata(length, first, end, len(times), None, None, None, None)

    def _scanned_messages(
        self, connections: Collection[Connection], start: int | None, stop: int | None
    ) -> Generator[Message, None, None]:
        wanted = {connection.id: connection for connection in connections}
        if self._scanned is None:
            return
        with self.file_path.open("rb") as file:
            pages = PageFile(self.file_path, file, self._overlay)
            for row in self._scanned.rows:
                time, topic = int(row[0]), int(row[2])
                inside = (start is None or time >= start) and (stop is None or time < stop)
                if inside and topic in wanted:
                    try:
                        raw = message_of(pages, row)
                    except BrokenRecordError as error:  # it was whole when it was found: the file changes
                        self._note_moved(time / 1e9, str(error))
                        continue
                    yield wanted[topic], time, raw
