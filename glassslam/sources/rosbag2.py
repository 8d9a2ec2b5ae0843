"""ROS2 bags: sqlite3 and mcap, a lone file or a directory with metadata."""

from collections.abc import Collection, Generator, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Protocol
from urllib.parse import quote

from rosbags.interfaces import Connection
from rosbags.rosbag2 import Reader
from rosbags.rosbag2.metadata import ReaderMetadata
from rosbags.rosbag2.storage_mcap import McapReader
from rosbags.rosbag2.storage_sqlite3 import Sqlite3Reader

from glassslam.errors import RecordingError
from glassslam.sources.bag import Decoder, Raw, Topic, merge_topics, typestore_for
from glassslam.sources.failures import DAMAGED_HINT, REPAIR_TOOLS, reading
from glassslam.sources.formats import Piece

_SQLITE_HEADER = 100


class _Storage(Protocol):
    """What the storage classes of rosbags have in common."""

    connections: list[Connection]
    metadata: ReaderMetadata

    def open(self) -> None: ...

    def close(self) -> None: ...

    def messages(
        self, connections: Collection[Connection], start: int | None = None, stop: int | None = None
    ) -> Generator[tuple[Connection, int, bytes], None, None]: ...


class Ros2Bag:
    """A ROS2 bag; see `Bag`. Messages come in the order of their record times."""

    def __init__(self, piece: Piece) -> None:
        self.piece = piece
        self._storage = _storage(piece)
        self._depth = 0
        with self.session():
            foreign = {c.msgtype for c in self._storage.connections if not _is_cdr(c)}
            self.topics = merge_topics(
                [Topic(c.topic, c.msgtype, c.msgcount) for c in self._storage.connections if _is_cdr(c)]
            )
            if foreign and not self.topics:
                raise RecordingError(f"{piece.path}: no message is serialised as CDR")
            metadata = self._storage.metadata
            self.start, self.end = metadata.start_time, metadata.end_time - 1
            self._store = typestore_for(self._storage.connections, piece.format)

    @contextmanager
    def session(self) -> Iterator[None]:
        """Keep the storage open between several readings; sessions may be nested."""
        with reading(self.piece.path, self.piece.format):
            if self._depth == 0:
                self._storage.open()
            self._depth += 1
            try:
                yield
            finally:
                self._depth -= 1
                if self._depth == 0:
                    self._storage.close()

    def decoder(self, msgtype: str) -> Decoder:
        """The function that turns a serialised message of this type into an object."""
        return partial(self._store.deserialize_cdr, typename=msgtype)

    def messages(
        self, topics: Collection[Topic], start: int | None = None, stop: int | None = None
    ) -> Generator[Raw, None, None]:
        """Topic, record time in ns and serialised message, from `start` up to before `stop`."""
        wanted = {(topic.name, topic.msgtype): topic for topic in topics}
        with self.session():
            connections = [c for c in self._storage.connections if (c.topic, c.msgtype) in wanted]
            if not connections:
                return
            for connection, time, raw in self._storage.messages(connections, start, stop):
                yield wanted[connection.topic, connection.msgtype], time, raw


def _storage(piece: Piece) -> _Storage:
    with reading(piece.path, piece.format):
        if piece.path.is_dir():
            for file in piece.path.glob("*.db3"):
                _check_size(file)
            return Reader(piece.path).storage
        if piece.format == "rosbag2-mcap":
            return McapReader(piece.path)
        _check_size(piece.path)
        # The path becomes part of a URI, in which '?', '#' and '%' have a meaning.
        return Sqlite3Reader(Path(quote(str(piece.path))))


def _check_size(path: Path) -> None:
    """SQLite reads a file that is cut off as long as it does not touch the missing pages."""
    with path.open("rb") as file:
        header = file.read(_SQLITE_HEADER)
    page_size, pages = int.from_bytes(header[16:18], "big"), int.from_bytes(header[28:32], "big")
    # The largest page size does not fit into its two bytes and is written as 1.
    missing = pages * (page_size if page_size > 1 else 65536) - path.stat().st_size
    if missing > 0:
        raise RecordingError(
            f"cannot read {path}: the last {missing} bytes are missing",
            DAMAGED_HINT.format(tool=REPAIR_TOOLS["rosbag2-sqlite3"]),
        )


def _is_cdr(connection: Connection) -> bool:
    return getattr(connection.ext, "serialization_format", "cdr") == "cdr"
