"""A ROS1 bag without a usable index, read record by record up to and past its damage."""

from collections import defaultdict
from pathlib import Path
from typing import BinaryIO

from rosbags.interfaces import Connection, ConnectionExtRosbag1, MessageDefinition, MessageDefinitionFormat
from rosbags.rosbag1.reader import normalize
from rosbags.typesys.msg import normalize_msgtype

from glassslam.sources.gaps import Gap, damages
from glassslam.sources.rosbag1index import BagIndex, Chunk, Row
from glassslam.sources.rosbag1records import (
    BAG_HEADER,
    CHUNK,
    CONNECTION,
    INDEX,
    MAGIC_BYTES,
    MESSAGE,
    Record,
    next_record,
    read_fields,
    read_record,
)
from glassslam.sources.unpacking import unpack
from glassslam.sources.windows import BrokenRecordError, BytesWindow, FileWindow, Window, exactly

CUT_OFF = "the file is cut off here"
UNINDEXED = "the index is missing or broken"
_STORED = "none"


def scan_bag(path: Path) -> BagIndex:
    """Find every readable message of a bag, as far as the file reaches at this moment.

    Parameters
    ----------
    path : Path
        A file that begins like a ROS1 bag of version 2.0.

    Returns
    -------
    BagIndex
        As an index would tell it, and the damage. Definitions of messages may be missing: messages of
        connections that are not described anywhere are counted as lost.
    """
    with path.open("rb") as file:
        return _Scanner(path, file).run()


class _Scanner:
    """The state of one pass over the file."""

    def __init__(self, path: Path, file: BinaryIO) -> None:
        self._path = path
        self._file = FileWindow(file, path.stat().st_size)
        self._connections: dict[int, Connection] = {}
        self._chunks: dict[int, Chunk] = {}
        self._rows: dict[int, list[Row]] = defaultdict(list)
        self._gaps: list[Gap] = []
        self._open: list[Gap] = []
        self._latest: int | None = None
        self._damaged_chunk: Gap | None = None
        self._announced_end = 0
        self._begin = MAGIC_BYTES

    def run(self) -> BagIndex:
        position = MAGIC_BYTES
        while position < self._file.size:
            try:
                record = read_record(self._file, position)
                position = self._take(record)
            except BrokenRecordError as error:
                position = self._skip(position, str(error))
        self._judge_end()
        return self._finished()

    def _skip(self, position: int, reason: str) -> int:
        """Go on behind the damage at a position."""
        found = self._next(position + 1)
        end = self._file.size if found is None else found.start
        # Behind the last chunk stands the index, of which nothing is needed here.
        if self._announced_end and position >= self._announced_end:
            return end
        self._gap(Gap(position, end - position, CUT_OFF if found is None else reason))
        return end

    def _next(self, position: int) -> Record | None:
        """Where to go on."""
        if self._announced_end and position >= self._announced_end:
            return next_record(self._file, position, (CONNECTION,))
        # In packed chunks stands what looks like messages and is none.
        plain = {chunk.compression for chunk in self._chunks.values()} == {_STORED}
        found = next_record(self._file, position, (MESSAGE, CHUNK, CONNECTION) if plain else (CHUNK,))
        if found is None and self._announced_end:
            return next_record(self._file, self._announced_end, (CONNECTION,))
        return found

    def _take(self, record: Record) -> int:
        """Use a record; the position at which the next one begins."""
        if record.op == CHUNK:
            return self._take_chunk(record)
        if record.end > self._file.size:
            raise BrokenRecordError("a record reaches beyond the end of the file")
        if record.op == BAG_HEADER:
            self._announced_end = record.number(b"index_pos")
            self._begin = record.end
        elif record.op == CONNECTION:
            self._connect(self._file, record)
        elif record.op == MESSAGE:
            length = record.end - record.start
            self._chunks[record.start] = Chunk(record.start, length, _STORED, length)
            self._row(record, record.start, 0)
        elif record.op == INDEX and self._damaged_chunk is not None:
            self._damaged_chunk.expected = (self._damaged_chunk.expected or 0) + record.number(b"count")
        return record.end

    def _take_chunk(self, record: Record) -> int:
        end, cut = record.end, record.end > self._file.size
        if cut:
            # Either the file ends here or the length is wrong: then another chunk follows.
            following = next_record(self._file, record.data, (CHUNK,))
            end = self._file.size if following is None else following.start
        data = exactly(self._file, record.data, end - record.data)
        compression = record.fields[b"compression"].decode(errors="replace")
        self._chunks[record.start] = Chunk(record.data, len(data), compression, record.number(b"size"))
        content = unpack(data, compression, record.number(b"size"))
        stored = compression == _STORED
        self._damaged_chunk = None
        found, broken = self._scan_chunk(record, content.data, stored=stored)
        if content.problem or (cut and not stored) or (broken and not stored):
            reason = CUT_OFF if end == self._file.size and cut else content.problem or "a damaged chunk"
            self._damaged_chunk = Gap(record.start, end - record.start, reason, found=found)
            self._gap(self._damaged_chunk)
        return end

    def _scan_chunk(self, chunk: Record, content: bytes, *, stored: bool) -> tuple[int, bool]:
        """Number of messages in a chunk, and whether anything in it is broken."""
        window, position, found, broken = BytesWindow(content), 0, 0, False
        while position < window.size:
            try:
                record = read_record(window, position)
                if record.end > window.size:
                    raise BrokenRecordError("a record reaches beyond its chunk")  # noqa: TRY301
            except BrokenRecordError as error:
                broken = True
                following = next_record(window, position + 1, (MESSAGE, CONNECTION))
                end = window.size if following is None else following.start
                if stored:
                    last = following is None and chunk.data + end >= self._file.size
                    self._gap(Gap(chunk.data + position, end - position, CUT_OFF if last else str(error)))
                position = end
                continue
            if record.op == MESSAGE:
                self._row(record, chunk.start, position)
                found += 1
            elif record.op == CONNECTION:
                self._connect(window, record)
            position = record.end
        return found, broken

    def _row(self, message: Record, chunk: int, offset: int) -> None:
        time = message.time
        self._rows[message.number(b"conn")].append((time, chunk, offset))
        self._latest = time if self._latest is None else max(self._latest, time)
        for gap in self._open:
            gap.after = time
        self._open.clear()

    def _gap(self, gap: Gap) -> None:
        gap.before = self._latest if gap.before is None else gap.before
        self._gaps.append(gap)
        self._open.append(gap)

    def _connect(self, window: Window, record: Record) -> None:
        key = record.number(b"conn")
        if key in self._connections:
            return
        fields = read_fields(exactly(window, record.data, record.end - record.data))
        try:
            connection = _connection(key, record.fields[b"topic"], fields)
        except (KeyError, UnicodeDecodeError, IndexError) as error:
            raise BrokenRecordError("a connection that cannot be understood") from error
        self._connections[key] = connection

    def _judge_end(self) -> None:
        """Note that the file ends early, or at least that it has no index."""
        missing = max(0, self._announced_end - self._file.size)
        last = self._gaps[-1] if self._gaps else None
        if last is not None and last.offset + last.bytes >= self._file.size:
            last.missing = missing
        elif missing:
            self._gap(Gap(self._file.size, 0, CUT_OFF, missing=missing))
        elif not self._gaps:
            self._gap(Gap(self._file.size, 0, UNINDEXED, expected=0))

    def _finished(self) -> BagIndex:
        unknown = [key for key in self._rows if key not in self._connections]
        for key in unknown:
            rows = self._rows.pop(key)
            times = [time for time, _, _ in rows]
            reason = "messages whose topic is not told"
            gap = Gap(rows[0][1], 0, reason, min(times), max(times), expected=len(rows))
            self._gaps.append(gap)
        times = [time for rows in self._rows.values() for time, _, _ in rows]
        lost = sum(gap.bytes for gap in self._gaps)
        for key, connection in self._connections.items():
            self._connections[key] = connection._replace(msgcount=len(self._rows.get(key, ())))
        return BagIndex(
            connections=list(self._connections.values()),
            chunks=self._chunks,
            rows=dict(self._rows),
            start=min(times, default=2**63 - 1),
            end=max(times, default=-1),
            damage=damages(str(self._path), self._gaps, times, self._file.size - self._begin - lost),
        )


def _connection(key: int, topic: bytes, fields: dict[bytes, bytes]) -> Connection:
    latching = fields.get(b"latching", b"")
    return Connection(
        id=key,
        topic=normalize(topic.decode()),
        msgtype=normalize_msgtype(fields[b"type"].decode()),
        msgdef=MessageDefinition(MessageDefinitionFormat.MSG, fields[b"message_definition"].decode()),
        digest=fields[b"md5sum"].decode(),
        msgcount=0,
        ext=ConnectionExtRosbag1(
            fields[b"callerid"].decode() if b"callerid" in fields else None,
            int(latching) if latching.isdigit() else None,
        ),
        owner=None,
    )
