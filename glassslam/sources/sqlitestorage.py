"""A ROS2 sqlite3 file read by its database, or past its damage by what a scan has found."""

from collections import Counter
from collections.abc import Collection, Generator
from pathlib import Path
from urllib.parse import quote

from rosbags.interfaces import Connection
from rosbags.rosbag2.metadata import ReaderMetadata
from rosbags.rosbag2.storage_sqlite3 import Sqlite3Reader

from glassslam.errors import RecordingError
from glassslam.records import Damage
from glassslam.sources.failures import DAMAGED_HINT, REPAIR_TOOLS, reading
from glassslam.sources.sqlitepages import PageFile, announced_size
from glassslam.sources.sqlitescan import SqliteIndex, message_of, scan_sqlite
from glassslam.sources.windows import BrokenRecordError

_FORMAT = "rosbag2-sqlite3"

Message = tuple[Connection, int, bytes]


class SqliteStorage(Sqlite3Reader):
    """Storage of one sqlite3 file.

    Messages come in the order of their record times. What is readable of a damaged database is read, unless
    `strict`, even where the damage shows only on the way.
    """

    def __init__(self, path: Path, *, strict: bool = False) -> None:
        # The path becomes part of a URI, in which '?', '#' and '%' have a meaning.
        super().__init__(Path(quote(str(path))))
        self.file_path, self._strict = path, strict
        self._scanned: SqliteIndex | None = None

    @property
    def damage(self) -> tuple[Damage, ...]:
        """What could not be read so far."""
        found = () if self._scanned is None else tuple(self._scanned.damage)
        return (*found, *self._unmerged())

    def open(self) -> None:
        """Open the database, or look for its rows where it cannot be trusted."""
        if self._scanned is None:
            try:
                with reading(self.file_path, _FORMAT):
                    self._check_size()
                    super().open()
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
                for connection, time, raw in super().messages(connections, start, stop):
                    if time != latest:
                        latest = time
                        given.clear()
                    given[connection.id, raw] += 1
                    yield connection, time, raw
        except RecordingError as error:
            self._scan(error)
        else:
            return
        for connection, time, raw in self._scanned_messages(connections, latest, stop):
            if time == latest and given[connection.id, raw] > 0:
                given[connection.id, raw] -= 1
            else:
                yield connection, time, raw

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
        if self._strict:
            raise error
        try:
            with reading(self.file_path, _FORMAT):
                index = scan_sqlite(self.file_path)
        except RecordingError:
            raise error from None
        if not len(index.rows):
            raise error
        self._scanned = index

    def _use(self, index: SqliteIndex) -> None:
        self.connections = list(index.connections)
        times = index.rows[:, 0]
        first, last = int(times[0]), int(times[-1])
        self.metadata = ReaderMetadata(last + 1 - first, first, last + 1, len(times), None, None, None, None)

    def _scanned_messages(
        self, connections: Collection[Connection], start: int | None, stop: int | None
    ) -> Generator[Message, None, None]:
        wanted = {connection.id: connection for connection in connections}
        if self._scanned is None:
            return
        with self.file_path.open("rb") as file:
            pages = PageFile(self.file_path, file)
            for row in self._scanned.rows:
                time, topic = int(row[0]), int(row[2])
                inside = (start is None or time >= start) and (stop is None or time < stop)
                if inside and topic in wanted:
                    try:
                        raw = message_of(pages, row)
                    except BrokenRecordError:  # it was whole when it was found: the file changes
                        continue
                    yield wanted[topic], time, raw

    def _unmerged(self) -> list[Damage]:
        """What a recorder that was killed has left beside the database."""
        log = self.file_path.with_name(self.file_path.name + "-wal")
        try:
            size = log.stat().st_size
        except OSError:
            return []
        reason = "not merged into the database: open it once with 'sqlite3 FILE .tables'"
        return [Damage(str(log), 0, size, None, None, 0, reason)] if size else []
