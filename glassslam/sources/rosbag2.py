"""ROS2 bags: sqlite3 and mcap, a lone file or a directory with metadata."""

from collections.abc import Collection, Generator, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Protocol

from rosbags.interfaces import Connection
from rosbags.rosbag2.metadata import ReaderMetadata

from glassslam.errors import RecordingError
from glassslam.records import Damage
from glassslam.sources.bag import Decoder, Raw, Topic, merge_topics, typestore_for
from glassslam.sources.failures import DAMAGED_HINT, REPAIR_TOOLS, reading
from glassslam.sources.formats import Piece
from glassslam.sources.gaps import shortened
from glassslam.sources.rosbag2files import (
    Directory,
    Files,
    directory_files,
    file_storage,
    metadata_damage,
)


class Storage(Protocol):
    """What a file and a directory have in common.

    Attributes
    ----------
    connections : list of Connection
        Topics, types and definitions, with the number of messages; empty while closed.
    metadata : ReaderMetadata
        Times and number of all messages.
    """

    connections: list[Connection]
    metadata: ReaderMetadata

    @property
    def damage(self) -> tuple[Damage, ...]:
        """What could not be read so far."""
        ...

    def open(self) -> None:
        """Open the files."""
        ...

    def close(self) -> None:
        """Close the files."""
        ...

    def messages(
        self, connections: Collection[Connection], start: int | None = None, stop: int | None = None
    ) -> Generator[tuple[Connection, int, bytes], None, None]:
        """Connection, record time in ns and serialised message."""
        ...


class Ros2Bag:
    """A ROS2 bag; see `Bag`. Messages come in the order of their record times."""

    def __init__(self, piece: Piece, *, strict: bool = False) -> None:
        self.piece = piece
        self._storage = _storage(piece, strict=strict)
        self._depth = 0
        with self.session():
            foreign = {c.msgtype for c in self._storage.connections if not _is_cdr(c)}
            self.topics = merge_topics(
                [
                    # metadata written by hand may name a topic by what YAML takes for a number
                    Topic(str(c.topic), str(c.msgtype), c.msgcount)
                    for c in self._storage.connections
                    if _is_cdr(c)
                ]
            )
            if foreign and not self.topics:
                raise RecordingError(f"{piece.path}: no message is serialised as CDR")
            metadata = self._storage.metadata
            self.start, self.end = metadata.start_time, metadata.end_time - 1
            self._store = typestore_for(self._storage.connections, piece.format)
        if strict and self.damage:
            raise RecordingError(self.damage[0].text, DAMAGED_HINT.format(tool=REPAIR_TOOLS[piece.format]))

    @property
    def damage(self) -> tuple[Damage, ...]:
        """What could not be read so far."""
        return shortened(self._storage.damage)

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


def _storage(piece: Piece, *, strict: bool) -> Storage:
    if not piece.path.is_dir():
        return file_storage(piece.path, piece.format, strict=strict)
    try:
        with reading(piece.path, piece.format):
            directory = Directory(piece.path, strict=strict)
            directory.open()
            needs_files = directory.is_in_doubt or directory.metadata.compression_mode == "message"
            directory.close()
    except RecordingError as error:
        if strict or not directory_files(piece):
            raise
        return Files(directory_files(piece), piece.format, [metadata_damage(piece, error)])
    # A topic may be in damaged files alone; and packed messages are unpacked within bounds there.
    files = directory_files(piece) if needs_files else []
    return Files(files, piece.format, ()) if files else directory


def _is_cdr(connection: Connection) -> bool:
    return getattr(connection.ext, "serialization_format", "cdr") == "cdr"
