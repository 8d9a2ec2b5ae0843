"""Lines of text logs, packed or not: as far as they can be read, up to their size at opening."""

import zlib
from collections.abc import Generator, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glassslam.errors import RecordingError
from glassslam.records import Damage, Float32Array
from glassslam.sources.failures import DAMAGED_HINT, REPAIR_TOOLS, describe, reading
from glassslam.sources.formats import GZIP_MAGIC, Piece
from glassslam.sources.gaps import Gap, shortened
from glassslam.sources.windows import FileWindow

CUT_OFF = "the file is cut off here, and nothing tells how much is missing"
CHECKSUM = "the checksum of the log does not fit"
NO_GZIP = "what follows the log is not packed with gzip"
TOO_LONG = "a line that is too long"

# A scan of a million beams would fit.
LONGEST_LINE = 16 << 20
_BLOCK_BYTES = 1 << 16
# Behind the last whole step before the damage, bytes are fetched in steps of this size.
_SMALL_STEP = 16


class TextLog:
    """A text log, which may be read several times.

    Parameters
    ----------
    piece : Piece
        The file; what is appended to it later is not read.
    strict : bool
        Refuse a damaged log.

    Attributes
    ----------
    piece : Piece
        The file.
    gaps : list of Gap
        What the latest reading could not read.
    """

    def __init__(self, piece: Piece, *, strict: bool = False) -> None:
        self.piece = piece
        self.gaps: list[Gap] = []
        self._size = piece.path.stat().st_size if piece.size is None else piece.size
        self._strict = strict
        self._position = 0

    @property
    def readable(self) -> int:
        """Bytes of the file outside of the gaps, and at least one."""
        return max(1, self._size - sum(gap.bytes for gap in self.gaps))

    def lines(self) -> Iterator[bytes]:
        """The lines without their ends; one that damage cuts off is left out.

        Raises
        ------
        RecordingError
            The file cannot be opened, or is damaged and `strict` was said.
        """
        self.gaps.clear()
        self._position = 0
        with reading(self.piece.path, self.piece.format), self.piece.path.open("rb") as file:
            window = FileWindow(file, self._size)
            packed = window.read(0, 2) == GZIP_MAGIC
            yield from self._split(self._unpacked(window) if packed else self._plain(window))

    def _split(self, blocks: Iterator[bytes]) -> Iterator[bytes]:
        rest, skipped, start = b"", 0, 0
        for block in blocks:
            *whole, tail = block.split(b"\n")
            if whole and skipped:
                self._gap(Gap(start, self._position - start, TOO_LONG, expected=1))
                skipped, whole[0] = 0, b""
            if whole:
                whole[0] = rest + whole[0]
                yield from whole
                rest, start = tail, self._position
            elif not skipped:
                rest += tail
            if len(rest) > LONGEST_LINE:
                rest, skipped = b"", 1
        if skipped:
            self._gap(Gap(start, self._position - start, TOO_LONG, expected=1))
        ended_early = any(gap.offset + gap.bytes >= self._size and gap.expected is None for gap in self.gaps)
        if rest and not ended_early:
            yield rest

    def _plain(self, window: FileWindow) -> Iterator[bytes]:
        while block := window.read(self._position, _BLOCK_BYTES):
            self._position += len(block)
            yield block

    def _unpacked(self, window: FileWindow) -> Iterator[bytes]:
        """What gzip has packed, member by member."""
        while self._position < window.size:
            head = window.read(self._position, 2)
            if head != GZIP_MAGIC:
                # Tapes and some disks fill up with zeros.
                if any(map(any, _blocks(window, self._position))):
                    self._gap(Gap(self._position, window.size - self._position, NO_GZIP, expected=0))
                return
            whole = yield from self._member(window)
            if not whole:
                return

    def _member(self, window: FileWindow) -> Generator[bytes, None, bool]:
        """One member; returns whether it was whole."""
        inflate = zlib.decompressobj(wbits=31)
        while not inflate.eof:
            fed = inflate.unconsumed_tail
            if not fed:
                fed = window.read(self._position, _BLOCK_BYTES)
                self._position += len(fed)
            if not fed:
                yield inflate.flush()
                self._gap(Gap(window.size, 0, CUT_OFF))
                return False
            before = inflate.copy()
            try:
                part = inflate.decompress(fed, _BLOCK_BYTES)
            except zlib.error as error:
                rest = yield from _as_far_as_it_goes(before, fed)
                self._broken(window, self._position - rest, error)
                return False
            yield part
        self._position -= len(inflate.unused_data)
        return True

    def _broken(self, window: FileWindow, position: int, error: zlib.error) -> None:
        if "incorrect data check" in str(error) or "incorrect length check" in str(error):
            # Everything was read, and somewhere in it is at least one fault.
            self._gap(Gap(position, window.size - position, CHECKSUM, expected=1))
        else:
            self._gap(Gap(position, window.size - position, describe(error)))

    def _gap(self, gap: Gap) -> None:
        if self._strict:
            hint = DAMAGED_HINT.format(tool=REPAIR_TOOLS["carmen"])
            raise RecordingError(f"cannot read {self.piece.path}: {gap.reason}", hint)
        self.gaps.append(gap)


def _blocks(window: FileWindow, position: int) -> Iterator[bytes]:
    while block := window.read(position, _BLOCK_BYTES):
        position += len(block)
        yield block


def _as_far_as_it_goes(inflate: Any, fed: bytes) -> Generator[bytes, None, int]:
    """What comes before the damage: a decompressor that fails returns nothing of that step.

    Returns how many bytes it has not used.
    """
    try:
        while part := inflate.decompress(fed, _SMALL_STEP):
            fed = inflate.unconsumed_tail
            yield part
    except zlib.error:
        return len(fed)
    return len(fed)


def text_damage(logs: Sequence[TextLog], lines: int, begin: float, end: float) -> tuple[Damage, ...]:
    """Damage of logs that follow each other, its cost told from what the rest of them holds.

    Parameters
    ----------
    logs : sequence of TextLog
        Logs that were read to their ends.
    lines : int
        Lines of use in all of them.
    begin, end : float
        Times of the first and the last of these, s.
    """
    readable = sum(log.readable for log in logs)
    span = end - begin if np.isfinite(end - begin) else 0.0
    parts = []
    for log in logs:
        for gap in log.gaps:
            # The line that is cut off is lost in any case.
            lost = gap.expected if gap.expected is not None else max(1, round(gap.bytes * lines / readable))
            is_end = log is logs[-1] and gap.expected is None and np.isfinite(end)
            first = end if is_end else None
            last = end + lost * span / max(lines, 1) if is_end else None
            path = str(log.piece.path)
            parts.append(Damage(path, gap.offset, gap.bytes, first, last, lost, gap.reason))
    return shortened(parts)


def single(values: NDArray[np.float64]) -> Float32Array:
    """Values of a text in single precision; what does not fit becomes infinite, as no sensor means it."""
    with np.errstate(over="ignore"):
        return values.astype(np.float32)
