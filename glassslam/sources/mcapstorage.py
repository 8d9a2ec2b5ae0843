"""An mcap file read by its index, or past its damage by what a scan has found."""

import heapq
from collections.abc import Collection, Generator, Iterator
from operator import itemgetter
from pathlib import Path
from typing import TypeAlias

from rosbags.interfaces import Connection
from rosbags.rosbag2.metadata import ReaderMetadata
from rosbags.rosbag2.storage_mcap import McapReader

from glassslam.errors import RecordingError
from glassslam.records import Damage
from glassslam.sources.failures import DAMAGED_HINT, REPAIR_TOOLS, reading
from glassslam.sources.mcapindex import McapIndex, Stretch, messages_in
from glassslam.sources.mcaprecords import CHUNK, MESSAGE_HEAD_BYTES, chunk_head, read_record
from glassslam.sources.windows import FileWindow

# Record time, position of the stretch, channel, message; the first of each stretch holds no message.
_Entry: TypeAlias = tuple[int, int, int, bytes | None]

_BY_TIME_AND_PLACE = itemgetter(0, 1)


class McapStorage(McapReader):
    """Storage of one mcap file.

    Messages come in the order of their record times; chunks are unpacked one by one when they are due.
    A chunk that cannot be read costs its own messages and no others, unless `strict`.
    """

    def __init__(self, path: Path, *, strict: bool = False) -> None:
        super().__init__(path)
        self.file_path, self._strict = path, strict
        self._stretches: list[Stretch] = []
        self._scanned: McapIndex | None = None
        self._noted: dict[int, Damage] = {}

    @property
    def damage(self) -> tuple[Damage, ...]:
        """What could not be read so far."""
        found = self._scanned.damage if self._scanned is not None else ()
        return (*found, *(self._noted[key] for key in sorted(self._noted)))

    def open(self) -> None:
        """Read the index, or the whole file where there is none that can be trusted."""
        if self._scanned is not None:
            self._open_scanned(self._scanned)
            return
        try:
            with reading(self.file_path, "rosbag2-mcap"):
                super().open()
                self._stretches = self._read_stretches()
        except RecordingError as error:
            if self.bio is not None:
                self.close()
            self._scanned = self._scan(error)
            self._open_scanned(self._scanned)

    def meta_scan(self) -> None:
        """Refuse to read the file without an index: it would be unpacked without bounds."""
        raise RecordingError("the index is missing")

    def messages(
        self, connections: Collection[Connection], start: int | None = None, stop: int | None = None
    ) -> Generator[tuple[Connection, int, bytes], None, None]:
        """Connection, record time in ns and serialised message, from `start` up to before `stop`."""
        wanted = {connection.id: connection for connection in connections}
        low = -1 if start is None else start
        high = 1 << 64 if stop is None else stop
        entries = [
            self._entries(stretch, wanted, low, high)
            for stretch in self._stretches
            if low <= stretch.end and stretch.start < high and any(map(stretch.counts.get, wanted))
        ]
        for time, _, channel, raw in heapq.merge(*entries, key=_BY_TIME_AND_PLACE):
            if raw is not None:
                yield wanted[channel], time, raw

    def _entries(
        self, stretch: Stretch, wanted: dict[int, Connection], low: int, high: int
    ) -> Iterator[_Entry]:
        # Opens the stretch when its time has come, and not before.
        yield stretch.start, 0, 0, None
        assert self.bio is not None  # noqa: S101  (messages are read between open and close)
        content = stretch.content(FileWindow(self.bio, stretch.data + stretch.size))
        channels = {connection.id for connection in self.connections}
        found, broken = messages_in(content.data, channels)
        if content.problem or broken:
            self._note(stretch, content.problem or broken, len(found))
        found.sort(key=itemgetter(0))
        for time, channel, record in found:
            if channel in wanted and low <= time < high:
                raw = content.data[record.content + MESSAGE_HEAD_BYTES : record.end]
                yield time, stretch.position, channel, raw

    def _note(self, stretch: Stretch, reason: str, found: int) -> None:
        """Remember a chunk that could not be read to its end."""
        if self._strict:
            hint = DAMAGED_HINT.format(tool=REPAIR_TOOLS["rosbag2-mcap"])
            raise RecordingError(f"cannot read {self.file_path}: {reason}", hint)
        if self._scanned is None:
            self._noted[stretch.position] = Damage(
                file=str(self.file_path),
                offset=stretch.position,
                bytes=stretch.data + stretch.size - stretch.position,
                first_stamp=stretch.start / 1e9,
                last_stamp=stretch.end / 1e9,
                messages_lost=max(0, sum(stretch.counts.values()) - found),
                reason=reason,
            )

    def _read_stretches(self) -> list[Stretch]:
        """The chunks of the index, each compared with what stands at its place."""
        if self.bio is None or (not self.chunks and self.metadata.message_count):
            raise RecordingError("the index names no chunk")
        window = FileWindow(self.bio, self.file_path.stat().st_size)
        stretches = []
        for chunk in self.chunks:
            record = read_record(window, chunk.chunk_start_offset)
            if record.op != CHUNK or record.end > window.size:
                raise RecordingError("the index names a chunk that is not there")
            head = chunk_head(window, record)
            times = chunk.message_start_time, chunk.message_end_time
            stretches.append(Stretch(record.start, head.data, head.size, *times, head, chunk.channel_count))
        return stretches

    def _scan(self, error: RecordingError) -> McapIndex:
        """What a scan finds; the error stands where it finds nothing, or damage that is not accepted."""
        from glassslam.sources.mcapscan import scan_mcap  # noqa: PLC0415  (for unindexed files only)

        with reading(self.file_path, "rosbag2-mcap"):
            index = scan_mcap(self.file_path)
        if index.damage and (self._strict or not any(stretch.counts for stretch in index.stretches)):
            raise error
        return index

    def _open_scanned(self, index: McapIndex) -> None:
        self.bio = self.file_path.open("rb")
        # Closing empties these lists: the scan keeps its own.
        self.connections = list(index.connections)
        self._stretches = index.stretches
        count = sum(connection.msgcount for connection in index.connections)
        first, last = (index.start, index.end + 1) if count else (2**63 - 1, 0)
        self.metadata = ReaderMetadata(max(0, last - first), first, last, count, None, None, None, None)
