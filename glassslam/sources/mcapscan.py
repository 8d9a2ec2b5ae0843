"""An mcap file without a usable index, read record by record up to and past its damage."""

from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any, BinaryIO

from rosbags.interfaces import Connection, ConnectionExtRosbag2, MessageDefinition, MessageDefinitionFormat

from glassslam.errors import RecordingError
from glassslam.sources.gaps import Gap, damages
from glassslam.sources.mcapindex import McapIndex, Stretch, messages_in
from glassslam.sources.mcaprecords import (
    CHANNEL,
    CHUNK,
    DATA_END,
    FOOTER,
    HEADER,
    MAGIC,
    MESSAGE,
    MESSAGE_INDEX,
    SCHEMA,
    Record,
    chunk_head,
    content_of,
    index_count,
    message_head,
    next_chunk,
    next_message,
    numbers16,
    read_record,
    strings,
)
from glassslam.sources.windows import BrokenRecordError, FileWindow, Window

CUT_OFF = "the file is cut off here"
_ENCODINGS = {
    "ros2msg": MessageDefinitionFormat.MSG,
    "ros2idl": MessageDefinitionFormat.IDL,
    "omgidl": MessageDefinitionFormat.IDL,
}
# Messages outside of chunks are read in stretches of this size.
_STRETCH_BYTES = 1 << 20


def scan_mcap(path: Path) -> McapIndex:
    """Find every readable message of an mcap file, as far as the file reaches at this moment.

    Raises
    ------
    RecordingError
        The file is not of ROS2.
    """
    with path.open("rb") as file:
        return _Scanner(path, file).run()


class _Scanner:
    """The state of one pass over the file."""

    def __init__(self, path: Path, file: BinaryIO) -> None:
        self._path = path
        self._file = FileWindow(file, path.stat().st_size)
        self._schemas: dict[int, tuple[str, MessageDefinition]] = {}
        self._channels: dict[int, Connection] = {}
        self._stretches: list[Stretch] = []
        self._counts: Counter[int] = Counter()
        self._times: list[int] = []
        self._gaps: list[Gap] = []
        self._open: list[Gap] = []
        self._damaged_chunk: Gap | None = None
        self._indexed: Gap | None = None
        self._ended = False
        self._packed = False

    def run(self) -> McapIndex:
        position, size = len(MAGIC), self._file.size
        closed = self._file.read(size - len(MAGIC), len(MAGIC)) == MAGIC
        if closed:
            size -= len(MAGIC)
        while position < size and not (self._ended and closed):
            try:
                position = self._take(read_record(self._file, position))
            except BrokenRecordError as error:
                position = self._skip(position, str(error))
        if self._ended and not closed:
            self._gap(Gap(size, 0, "the index is cut off", expected=0))
        elif not self._ended and (not self._gaps or self._gaps[-1].offset + self._gaps[-1].bytes < size):
            self._gap(Gap(size, 0, CUT_OFF))
        return self._finished()

    def _skip(self, position: int, reason: str) -> int:
        """Go on behind the damage at a position."""
        if self._ended:  # what follows the data is an index of it
            return self._file.size
        chunk = next_chunk(self._file, position + 1)
        end = self._file.size if chunk is None else chunk.start
        # In packed chunks stands what looks like messages and is none.
        known = set() if self._packed else set(self._channels)
        message = next_message(self._file, position + 1, end, known)
        if message is not None:
            end = message.start
        last = chunk is None and message is None
        self._gap(Gap(position, end - position, CUT_OFF if last else reason))
        return end

    def _take(self, record: Record) -> int:
        """Use a record; the position at which the next one begins."""
        if record.op == CHUNK:
            return self._take_chunk(record)
        if record.end > self._file.size:
            raise BrokenRecordError("a record reaches beyond the end of the file")
        if record.op == HEADER:
            self._check_profile(record)
        elif record.op == MESSAGE:
            self._take_message(record)
        elif record.op in (DATA_END, FOOTER):
            self._ended = True
        elif record.op == MESSAGE_INDEX and self._damaged_chunk is not None:
            # What the index says counts, not what was guessed before.
            if self._indexed is not self._damaged_chunk:
                self._indexed, self._damaged_chunk.expected = self._damaged_chunk, 0
            count = index_count(content_of(self._file, record))
            self._damaged_chunk.expected = (self._damaged_chunk.expected or 0) + count
        else:
            self._describe(self._file, record)
        return record.end

    def _check_profile(self, record: Record) -> None:
        (profile,) = strings(content_of(self._file, record), 0, 1)
        if profile != "ros2":
            raise RecordingError(f"cannot read {self._path}: Profile is not ros2")

    def _take_message(self, record: Record) -> None:
        channel, time = message_head(self._file, record)
        last = self._stretches[-1] if self._stretches else None
        adjacent = last is not None and last.head is None and last.data + last.size == record.start
        if last is None or not adjacent or last.size > _STRETCH_BYTES:
            last = Stretch(record.start, record.start, 0, time, time)
            self._stretches.append(last)
        last.size = record.end - last.data
        last.add(channel, time)
        self._count(channel, time)

    def _take_chunk(self, record: Record) -> int:
        cut = record.end > self._file.size
        head = chunk_head(self._file, record)
        self._packed = self._packed or bool(head.compression)
        following = next_chunk(self._file, head.data) if cut else None
        end = record.end if not cut else self._file.size if following is None else following.start
        size = end - head.data
        stretch = Stretch(
            record.start, head.data, size, head.start_time, head.end_time, replace(head, size=size)
        )
        content = stretch.content(self._file)
        found, broken = messages_in(content.data, set(self._channels), self._describe)
        for time, channel, _ in found:
            stretch.add(channel, time)
            self._count(channel, time)
        if found:
            self._stretches.append(stretch)
        self._damaged_chunk = None
        if cut or content.problem or broken:
            reason = CUT_OFF if cut else content.problem or broken
            # Of a chunk that is not packed, what was read is not lost.
            read = found[-1][2].end if found and cut and not head.compression else 0
            start = head.data + read if read else record.start
            gap = Gap(start, end - start, reason, found=len(found))
            if found and content.data:
                gap.expected = round(len(found) * head.claimed / len(content.data))
            self._gap(gap)
            gap.after = head.end_time if gap.before is not None and head.end_time > gap.before else None
            self._damaged_chunk = gap
        return end

    def _describe(self, window: Window, record: Record) -> None:
        """Take a schema or a channel; other records tell nothing of messages."""
        if record.op == SCHEMA:
            content = content_of(window, record)
            (key,) = numbers16(content, 1)
            name, encoding, text = strings(content, 2, 3)
            kind = _ENCODINGS.get(encoding, MessageDefinitionFormat.NONE)
            self._schemas.setdefault(key, (name, MessageDefinition(kind, text)))
        elif record.op == CHANNEL:
            content = content_of(window, record)
            key, schema = numbers16(content, 2)
            topic, encoding = strings(content, 4, 2)
            nothing = ("__schemaless__", MessageDefinition(MessageDefinitionFormat.NONE, ""))
            msgtype, definition = self._schemas.get(schema, nothing)
            ext = ConnectionExtRosbag2(encoding, [])
            self._channels.setdefault(key, Connection(key, topic, msgtype, definition, "", 0, ext, _nobody()))

    def _count(self, channel: int, time: int) -> None:
        self._counts[channel] += 1
        self._times.append(time)
        for gap in self._open:
            gap.after = gap.after or time
        self._open.clear()

    def _gap(self, gap: Gap) -> None:
        gap.before = self._times[-1] if self._times else None
        self._gaps.append(gap)
        self._open.append(gap)

    def _finished(self) -> McapIndex:
        unknown = [key for key in self._counts if key not in self._channels]
        for key in unknown:
            lost = self._counts.pop(key)
            gap = Gap(len(MAGIC), 0, "messages whose topic is not told", expected=lost)
            self._gaps.append(gap)
        connections = [c._replace(msgcount=self._counts[key]) for key, c in self._channels.items()]
        lost_bytes = sum(gap.bytes for gap in self._gaps)
        return McapIndex(
            connections=connections,
            stretches=self._stretches,
            start=min(self._times, default=0),
            end=max(self._times, default=-1),
            damage=damages(str(self._path), self._gaps, self._times, self._file.size - lost_bytes),
        )


def _nobody() -> Any:
    """Connections name a reader, of which nothing here makes use."""
    return None
