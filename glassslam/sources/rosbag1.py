"""ROS1 bags in the order of the file, chunks decompressed ahead in a thread."""

import struct
from collections import OrderedDict
from collections.abc import Collection, Generator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from itertools import pairwise
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from glassslam.errors import RecordingError
from glassslam.records import Damage
from glassslam.sources.bag import SONAR_TYPES, USED_TYPES, Decoder, Raw, Topic, merge_topics, typestore_for
from glassslam.sources.failures import DAMAGED_HINT, REPAIR_TOOLS, reading
from glassslam.sources.formats import Piece
from glassslam.sources.gaps import shortened
from glassslam.sources.rosbag1index import BagIndex, Chunk, read_index
from glassslam.sources.unpacking import Content, unpack

# One chunk in use, one ahead, and two for topics whose chunks do not run in step.
_CHUNKS_KEPT = 4
_MESSAGE_RECORD = b"op=\x02"
_TIME, _CHUNK, _OFFSET = 0, 1, 2

DAMAGED = DAMAGED_HINT.format(tool=REPAIR_TOOLS["rosbag1"])

_unpack_u32 = struct.Struct("<I").unpack_from


class Ros1Bag:
    """A ROS1 bag; see `Bag`.

    Messages of one topic come in the order in which the file holds them, even where their record times step
    back: a sort by time, as the index invites to, would reshuffle scans that were recorded in right order.
    Topics are merged by record time, so a file written topic after topic is read in step.
    """

    def __init__(self, piece: Piece, *, strict: bool = False) -> None:
        self.piece = piece
        self._strict = strict
        index = _index_of(piece, strict=strict)
        with reading(piece.path, piece.format):
            self.topics = merge_topics([Topic(c.topic, c.msgtype, c.msgcount) for c in index.connections])
            self.start, self.end = index.start, index.end
            self._chunks = index.chunks
            self._store = typestore_for(index.connections, "rosbag1")
            self._index: dict[tuple[str, str], NDArray[np.int64]] = {}
            for topic in self.topics:
                if topic.msgtype in (*USED_TYPES, *SONAR_TYPES):
                    self._index[topic.name, topic.msgtype] = _file_order(index, topic)
        self._found_damaged = index.damage
        self._chunks_damaged: dict[int, Damage] = {}

    @property
    def damage(self) -> tuple[Damage, ...]:
        """What could not be read so far."""
        chunks = (self._chunks_damaged[key] for key in sorted(self._chunks_damaged))
        return shortened([*self._found_damaged, *chunks])

    def decoder(self, msgtype: str) -> Decoder:
        """The function that turns a serialised message of this type into an object."""
        return partial(self._store.deserialize_ros1, typename=msgtype)

    def session(self) -> AbstractContextManager[object]:
        """Nothing to keep open: each reading has its own file."""
        return nullcontext()

    def messages(
        self, topics: Collection[Topic], start: int | None = None, stop: int | None = None
    ) -> Generator[Raw, None, None]:
        """Topic, record time in ns and serialised message, from `start` up to before `stop`."""
        chosen = list(topics)
        plan, owner = self._plan(chosen, start, stop)
        with reading(self.piece.path, "rosbag1"), _ChunkLoader(self.piece, self._chunks) as loader:
            turns = np.flatnonzero(np.diff(plan[:, _CHUNK], prepend=-1, append=-1))
            for first, last in pairwise(turns.tolist()):
                following = int(plan[last, _CHUNK]) if last < len(plan) else None
                position = int(plan[first, _CHUNK])
                chunk = loader.load(position, following)
                if chunk.problem:
                    self._note(position, chunk.problem, len(chunk.data))
                times, offsets = plan[first:last, _TIME].tolist(), plan[first:last, _OFFSET].tolist()
                for time, offset, k in zip(times, offsets, owner[first:last].tolist(), strict=True):
                    try:
                        raw = _message_at(chunk.data, offset)
                    except (RecordingError, struct.error):
                        self._note(position, chunk.problem or "the index and a chunk disagree", offset)
                    else:
                        yield chosen[k], time, raw

    def _note(self, position: int, reason: str, offset: int) -> None:
        """Remember that a chunk cannot be read from an offset in its content on."""
        if self._strict:
            raise RecordingError(f"cannot read {self.piece.path}: {reason}", DAMAGED)
        rows = np.concatenate(list(self._index.values()))
        lost = rows[(rows[:, _CHUNK] == position) & (rows[:, _OFFSET] >= offset)]
        if position in self._chunks_damaged or not len(lost):
            return
        times, chunk = lost[:, _TIME] / 1e9, self._chunks[position]
        self._chunks_damaged[position] = Damage(
            file=str(self.piece.path),
            offset=position,
            bytes=chunk.data + chunk.size - position,
            first_stamp=float(times.min()),
            last_stamp=float(times.max()),
            messages_lost=len(lost),
            reason=reason,
        )

    def _plan(
        self, topics: list[Topic], start: int | None, stop: int | None
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Index rows (time, chunk, offset) in reading order, and the topic of each."""
        indexes = [self._index[topic.name, topic.msgtype] for topic in topics]
        rows = np.concatenate([*indexes, np.empty((0, 3), dtype=np.int64)])
        # Merging streams head by head by time is sorting by the latest time each has reached.
        reached = np.concatenate([*map(_time_reached, indexes), rows[:0, _TIME]])
        owner = np.repeat(np.arange(len(topics)), [len(index) for index in indexes])
        order = np.lexsort((rows[:, _OFFSET], rows[:, _CHUNK], reached))
        times = rows[order, _TIME]
        inside = np.ones(len(order), dtype=bool)
        if start is not None:
            inside &= times >= start
        if stop is not None:
            inside &= times < stop
        order = order[inside]
        return rows[order], owner[order]


class _ChunkLoader:
    """Reads and decompresses chunks in a thread of its own, the next one ahead of its use."""

    def __init__(self, piece: Piece, chunks: dict[int, Chunk]) -> None:
        self._piece = piece
        self._chunks = chunks
        self._kept: OrderedDict[int, Future[Content]] = OrderedDict()
        self._pool = ThreadPoolExecutor(max_workers=1, thread_name_prefix="bag-chunks")
        self._file: BinaryIO = piece.path.open("rb")

    def __enter__(self) -> "_ChunkLoader":
        return self

    def __exit__(self, *_: object) -> None:
        self._pool.shutdown(wait=True, cancel_futures=True)
        self._file.close()

    def load(self, position: int, following: int | None) -> Content:
        """The content of the chunk at a file position; `following` is started in the background."""
        wanted = self._request(position)
        if following is not None:
            self._request(following)
        return wanted.result()

    def _request(self, position: int) -> Future[Content]:
        if position not in self._kept:
            self._kept[position] = self._pool.submit(self._read, self._chunks[position])
        self._kept.move_to_end(position)
        while len(self._kept) > _CHUNKS_KEPT:
            self._kept.popitem(last=False)
        return self._kept[position]

    def _read(self, chunk: Chunk) -> Content:
        self._file.seek(chunk.data)
        data = self._file.read(chunk.size)
        if len(data) != chunk.size:
            raise RecordingError(f"cannot read {self._piece.path}: a chunk is cut off")
        return unpack(data, chunk.compression, chunk.claimed)


def _index_of(piece: Piece, *, strict: bool) -> BagIndex:
    """Where the messages are: by the index, else by reading the whole file once."""
    try:
        with reading(piece.path, piece.format):
            return read_index(piece.path)
    except RecordingError:
        if strict:
            raise
        from glassslam.sources.rosbag1scan import scan_bag  # noqa: PLC0415  (for damaged bags only)

        with reading(piece.path, piece.format):
            index = scan_bag(piece.path)
        if not any(index.rows.values()):
            raise
        return index


def _file_order(index: BagIndex, topic: Topic) -> NDArray[np.int64]:
    """Index rows (record time ns, chunk position, offset) of a topic, as the file holds its messages."""
    rows = np.array(
        [
            entry
            for connection in index.connections
            if (connection.topic, connection.msgtype) == (topic.name, topic.msgtype)
            for entry in index.rows.get(connection.id, ())
        ],
        dtype=np.int64,
    ).reshape(-1, 3)
    return rows[np.lexsort((rows[:, _OFFSET], rows[:, _CHUNK]))]


def _time_reached(index: NDArray[np.int64]) -> NDArray[np.int64]:
    return np.asarray(np.maximum.accumulate(index[:, _TIME]))


def _message_at(chunk: bytes, offset: int) -> bytes:
    """The data of the message record at an offset; connection records before it are passed over."""
    while True:
        (header_size,) = _unpack_u32(chunk, offset)
        header_end = offset + 4 + header_size
        (size,) = _unpack_u32(chunk, header_end)
        end = header_end + 4 + size
        if end > len(chunk):
            raise RecordingError("a message reaches beyond its chunk", "the bag is damaged")
        if _MESSAGE_RECORD in chunk[offset + 4 : header_end]:
            return chunk[header_end + 4 : end]
        offset = end
