"""A ROS2 directory: read by its metadata, or file by file where these are missing, wrong or hostile."""

import re
import shutil
import tempfile
from collections.abc import Callable, Collection, Generator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.interfaces import Connection
from rosbags.rosbag2.metadata import ReaderMetadata
from rosbags.rosbag2.reader import DirectoryReader

from glassslam.errors import RecordingError
from glassslam.records import Damage
from glassslam.sources.formats import Piece, natural_order
from glassslam.sources.mcapstorage import McapStorage
from glassslam.sources.sqlitestorage import SqliteStorage
from glassslam.sources.unpacking import unpack, unpacked_size

FileStorage = McapStorage | SqliteStorage

METADATA = "metadata.yaml"
_ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
_LARGEST_METADATA = 4 << 20
_DEEPEST = 50
_NESTED = re.compile(rb"(?:[-?] +){10}")
# What each byte adds to the depth of nesting.
_STEP = np.zeros(256, dtype=np.int64)
_STEP[list(b"[{")], _STEP[list(b"]}")] = 1, -1


def file_storage(path: Path, format_name: str, *, strict: bool) -> FileStorage:
    """The storage of one file of a ROS2 bag."""
    kind = McapStorage if format_name == "rosbag2-mcap" else SqliteStorage
    return kind(path, strict=strict)


class Directory(DirectoryReader):
    """A directory as its metadata describe it; its files are read like single ones."""

    def __init__(self, path: Path, *, strict: bool) -> None:
        _check_metadata(path / METADATA)
        super().__init__(path)
        self._strict = strict
        self._opened: dict[str, FileStorage] = {}
        self._miscounted: tuple[Damage, ...] = ()
        plugins: Any = {"mcap": self._plugin("rosbag2-mcap"), "sqlite3": self._plugin("rosbag2-sqlite3")}
        self.STORAGE_PLUGINS = plugins

    def open(self) -> None:
        """Open all files; packed ones are unpacked only where there is room for them."""
        packed = [*Path(str(self.path)).glob("*.zstd")]
        if packed:
            _check_room(packed)
        super().open()
        # Metadata may lie: what they tell of times, topics and counts is not asked where the files know.
        told, known = self.metadata, span_of([storage.metadata for storage in self._opened.values()])
        self._miscounted = self._miscount(told.message_count, known.message_count)
        self.metadata = known._replace(compression_mode=told.compression_mode)
        self.connections = [c for storage in self._opened.values() for c in storage.connections]

    @property
    def damage(self) -> tuple[Damage, ...]:
        """What could not be read so far, and of which messages only the metadata know."""
        return tuple(part for file in self._opened.values() for part in file.damage) or self._miscounted

    def _miscount(self, told: object, held: int) -> tuple[Damage, ...]:
        if told == held:
            return ()
        lost = told - held if isinstance(told, int) and held < told < 2**63 else 0
        reason = f"it counts other messages than the {held} of its files"
        return (Damage(str(self.path / METADATA), 0, 0, None, None, lost, reason),)

    @property
    def is_in_doubt(self) -> bool:
        """Whether a file is damaged, or a recorder has left something beside it."""
        files = self._opened.values()
        return any(file.damage or (isinstance(file, SqliteStorage) and file.is_scanned) for file in files)

    def _plugin(self, format_name: str) -> Callable[[Path], FileStorage]:
        def storage_of(path: Path) -> FileStorage:
            known = self._opened.get(path.name)
            if known is None or known.file_path != path:  # packed files are unpacked anew every time
                known = self._opened[path.name] = file_storage(path, format_name, strict=self._strict)
            return known

        return storage_of


class Files:
    """Files that follow each other, whatever their metadata say; see `Storage`."""

    def __init__(self, paths: Sequence[Path], format_name: str, damage: Collection[Damage]) -> None:
        self._storages = [file_storage(path, format_name, strict=False) for path in paths]
        self._damage = tuple(damage)
        self.connections: list[Connection] = []
        self.metadata = ReaderMetadata(0, 2**63 - 1, 0, 0, None, None, None, None)
        self._lost: list[Damage] = []

    @property
    def damage(self) -> tuple[Damage, ...]:
        """What could not be read so far."""
        return (*self._damage, *self._lost, *(d for storage in self._storages for d in storage.damage))

    def open(self) -> None:
        """Open all files that can be read; the error of the first stands where there is none."""
        errors: list[RecordingError] = []
        for storage in list(self._storages):
            try:
                storage.open()
            except RecordingError as error:
                errors.append(error)
                self._storages.remove(storage)
                self._lost.append(_unreadable(storage, error))
        if not self._storages:
            raise errors[0] if errors else RecordingError("no file of the bag can be read")
        self.metadata = span_of([storage.metadata for storage in self._storages])
        self.connections = [connection for storage in self._storages for connection in storage.connections]

    def close(self) -> None:
        """Close all files."""
        for storage in self._storages:
            storage.close()

    def messages(
        self, connections: Collection[Connection], start: int | None = None, stop: int | None = None
    ) -> Generator[tuple[Connection, int, bytes], None, None]:
        """Connection, record time in ns and serialised message, file by file."""
        wanted = {(connection.topic, connection.msgtype) for connection in connections}
        for storage in self._storages:
            own = [c for c in storage.connections if (c.topic, c.msgtype) in wanted]
            if own:
                for connection, time, raw in storage.messages(own, start, stop):
                    yield connection, time, plain_message(raw)


def span_of(files: Sequence[ReaderMetadata]) -> ReaderMetadata:
    """Times and number of the messages of several files."""
    filled = [file for file in files if file.message_count]
    start = min((file.start_time for file in filled), default=2**63 - 1)
    end = max((file.end_time for file in filled), default=0)
    count = sum(file.message_count for file in filled)
    return ReaderMetadata(max(0, end - start), start, end, count, None, None, None, None)


def plain_message(raw: bytes) -> bytes:
    """A message, unpacked where it was recorded packed; within bounds, and empty where that fails."""
    if not raw.startswith(_ZSTD_MAGIC):
        return raw
    content = unpack(raw, "zstd", exact=False)
    return b"" if content.problem else content.data


def directory_files(piece: Piece) -> list[Path]:
    """The files of a directory, in their natural order."""
    suffix = ".mcap" if piece.format == "rosbag2-mcap" else ".db3"
    return sorted((path for path in piece.path.iterdir() if path.suffix == suffix), key=natural_order)


def metadata_damage(piece: Piece, error: RecordingError) -> Damage:
    """That the metadata of a directory are of no use."""
    path = piece.path / METADATA
    reason = error.message.removeprefix(f"cannot read {piece.path}: ")
    return Damage(str(path), 0, path.stat().st_size, None, None, 0, reason)


def _unreadable(storage: FileStorage, error: RecordingError) -> Damage:
    path = storage.file_path
    return Damage(str(path), 0, path.stat().st_size, None, None, 0, error.message)


def _check_metadata(path: Path) -> None:
    """Refuse what no recorder writes: reading it may take memory and time without bounds."""
    size = path.stat().st_size
    if size > _LARGEST_METADATA:
        raise RecordingError(f"cannot read {path}: {size / 1e6:.0f} MB are too much for metadata")
    content = path.read_bytes()
    if b"<<" in content:
        raise RecordingError(f"cannot read {path}: it merges entries, which no recorder does")
    depth = np.cumsum(_STEP[np.frombuffer(content, dtype=np.uint8)])
    # Counted from the lowest so far: closing brackets ahead of it all do not hide any.
    rise = depth - np.minimum.accumulate(depth)
    if _NESTED.search(content) or rise.max(initial=0) > _DEEPEST:
        raise RecordingError(f"cannot read {path}: it is nested deeper than metadata are")


def _check_room(files: Sequence[Path]) -> None:
    room = shutil.disk_usage(tempfile.gettempdir()).free
    needed = sum(unpacked_size(file, room) for file in files)
    if needed > room:
        raise RecordingError(
            f"cannot unpack {files[0].parent}: it needs {needed / 1e9:.1f} GB, there are {room / 1e9:.1f} GB",
            "free some space, or set TMPDIR to a larger disk",
        )
