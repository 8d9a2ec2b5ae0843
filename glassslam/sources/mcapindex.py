"""Where the messages of an mcap file are, and the messages of one stretch of it."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeAlias
from zlib import crc32

from rosbags.interfaces import Connection

from glassslam.records import Damage
from glassslam.sources.mcaprecords import (
    MESSAGE,
    ChunkHead,
    Record,
    message_head,
    next_message,
    read_record,
)
from glassslam.sources.unpacking import Content, unpack
from glassslam.sources.windows import BrokenRecordError, BytesWindow, Window

CHECKSUM = "the checksum of a chunk does not fit"

# Record time in ns, channel, and the record.
Found: TypeAlias = tuple[int, int, Record]


@dataclass(slots=True)
class Stretch:
    """A chunk, or messages outside of chunks that follow each other.

    Attributes
    ----------
    position : int
        Where it begins in the file.
    data, size : int
        Where its data are, and how many bytes.
    start, end : int
        Record times of the first and the last message, ns.
    head : ChunkHead or None
        How the data are packed; None outside of chunks.
    counts : dict
        Channel -> number of messages.
    """

    position: int
    data: int
    size: int
    start: int
    end: int
    head: ChunkHead | None = None
    counts: dict[int, int] = field(default_factory=dict)

    def add(self, channel: int, time: int) -> None:
        """Count a message."""
        if not self.counts:
            self.start = self.end = time
        self.counts[channel] = self.counts.get(channel, 0) + 1
        self.start, self.end = min(self.start, time), max(self.end, time)

    def content(self, window: Window) -> Content:
        """Its messages unpacked; nothing of a chunk that is whole but has another checksum."""
        data = window.read(self.data, self.size)
        if self.head is None:
            return Content(data)
        content = unpack(data, self.head.compression, self.head.claimed)
        if not content.problem and self.head.crc and crc32(content.data) != self.head.crc:
            return Content(b"", CHECKSUM)
        return content


@dataclass(slots=True)
class McapIndex:
    """Everything known of a file before its messages are read.

    Attributes
    ----------
    connections : list of Connection
        Topics, types and definitions, with the number of messages.
    stretches : list of Stretch
        Where the messages are, in the order of the file.
    start, end : int
        Record times of the first and the last message, ns.
    damage : list of Damage
        What could not be read.
    """

    connections: list[Connection]
    stretches: list[Stretch]
    start: int
    end: int
    damage: list[Damage] = field(default_factory=list)


def messages_in(
    content: bytes, channels: set[int], describe: Callable[[Window, Record], None] | None = None
) -> tuple[list[Found], str]:
    """The messages of an unpacked stretch in its order, and what is broken in it ("": nothing).

    Parameters
    ----------
    content : bytes
        What `Stretch.content` gives.
    channels : set of int
        Channels known so far: behind broken bytes only a message of one of them is believed.
    describe : callable, optional
        Called with every record that is no message.
    """
    window, position, broken = BytesWindow(content), 0, ""
    found: list[Found] = []
    while position < window.size:
        try:
            record = read_record(window, position)
            if record.end > window.size:
                raise BrokenRecordError("a record reaches beyond its chunk")  # noqa: TRY301
            if record.op == MESSAGE:
                channel, time = message_head(window, record)
                found.append((time, channel, record))
            elif describe is not None:
                describe(window, record)
        except BrokenRecordError as error:
            broken = broken or str(error)
            following = next_message(window, position + 1, window.size, channels)
            position = window.size if following is None else following.start
        else:
            position = record.end
    return found, broken
