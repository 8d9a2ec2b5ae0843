"""Where the messages of a ROS1 bag are: read from its index."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO, TypeAlias

from rosbags.interfaces import Connection
from rosbags.rosbag1 import Reader

from glassslam.errors import RecordingError
from glassslam.records import Damage
from glassslam.sources.rosbag1records import CHUNK, read_record
from glassslam.sources.windows import FileWindow

# Record time in ns, position of the chunk in the file, offset of the message in the content of the chunk.
Row: TypeAlias = tuple[int, int, int]

# The header of a bag is padded to 4096 bytes; a file much longer than that holds chunks.
_HEADER_BYTES = 8192


@dataclass(frozen=True, slots=True)
class Chunk:
    """Where the data of a chunk is, how it is compressed, and how many bytes it claims to hold."""

    data: int
    size: int
    compression: str
    claimed: int


@dataclass(slots=True)
class BagIndex:
    """Everything known of a bag before its messages are read.

    Attributes
    ----------
    connections : list of Connection
        Topics, types and definitions, with the number of messages.
    chunks : dict
        Position in the file -> `Chunk`.
    rows : dict
        Identity of a connection -> its messages.
    start, end : int
        Record times of the first and the last message, ns.
    damage : list of Damage
        What could not be read.
    """

    connections: list[Connection]
    chunks: dict[int, Chunk]
    rows: dict[int, list[Row]]
    start: int
    end: int
    damage: list[Damage] = field(default_factory=list)


def read_index(path: Path) -> BagIndex:
    """Read the index of a bag; whatever is wrong with it raises some exception."""
    size = path.stat().st_size
    with Reader(path) as reader, path.open("rb") as file:
        if not reader.chunks and size > _HEADER_BYTES:
            raise RecordingError(f"cannot read {path}: the index names no chunk")
        return BagIndex(
            connections=list(reader.connections),
            chunks={position: _chunk(file, size, position) for position in reader.chunks},
            rows={
                key: [(row.time, row.chunk_pos, row.offset) for row in rows]
                for key, rows in reader.indexes.items()
            },
            start=reader.start_time,
            end=reader.end_time - 1,
        )


def _chunk(file: BinaryIO, size: int, position: int) -> Chunk:
    record = read_record(FileWindow(file, size), position)
    if record.op != CHUNK or record.end > size:
        raise RecordingError("the index names a chunk that is not there")
    compression = record.fields[b"compression"].decode()
    return Chunk(record.data, record.end - record.data, compression, record.number(b"size"))
