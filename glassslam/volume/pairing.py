"""Measurements of two sensors brought together by approximate time; who has no partner comes alone."""

from collections import deque
from collections.abc import Iterator
from typing import Generic, TypeVar

_A = TypeVar("_A")
_B = TypeVar("_B")
_PATIENCE = 1.0


class ApproximateTime(Generic[_A, _B]):
    """Pairs two streams of stamped things (section 2.7 and figure 10 of the lidar and 3D ultrasonic fusion).

    Two things are a pair when their stamps differ by at most `slop` and neither has a nearer neighbour in
    the other stream that is still free. Everything comes out exactly once, each stream in its own order;
    None stands for a missing partner, whose evidence is padded with zeros.

    Parameters
    ----------
    slop : float
        Largest difference of the stamps of a pair, s.
    """

    def __init__(self, slop: float = 0.05) -> None:
        self._slop = slop
        self._first: deque[tuple[float, _A]] = deque()
        self._second: deque[tuple[float, _B]] = deque()
        self._latest = -float("inf")

    def add_first(self, stamp: float, thing: _A) -> Iterator[tuple[_A | None, _B | None]]:
        """Take the next of the first stream and give out what is decided now."""
        self._first.append((stamp, thing))
        return self._decided(stamp)

    def add_second(self, stamp: float, thing: _B) -> Iterator[tuple[_A | None, _B | None]]:
        """Take the next of the second stream and give out what is decided now."""
        self._second.append((stamp, thing))
        return self._decided(stamp)

    def finish(self) -> Iterator[tuple[_A | None, _B | None]]:
        """Give out all that waits."""
        while self._first or self._second:
            yield self._next()

    def _decided(self, stamp: float) -> Iterator[tuple[_A | None, _B | None]]:
        self._latest = max(self._latest, stamp)
        while self._ready():
            yield self._next()

    def _ready(self) -> bool:
        """Whether a later arrival can no longer change who comes next."""
        if not (self._first and self._second):
            waiting = self._first or self._second
            return bool(waiting) and self._latest - waiting[0][0] > self._slop + _PATIENCE
        (a, _), (b, _) = self._first[0], self._second[0]
        if abs(a - b) > self._slop:
            return True
        rivals = len(self._first if a <= b else self._second)
        # A rival of the earlier head would have to come before its mirror image beyond the later one.
        return rivals > 1 or self._latest - max(a, b) > abs(a - b) + _PATIENCE

    def _next(self) -> tuple[_A | None, _B | None]:
        if not self._second:
            return self._first.popleft()[1], None
        if not self._first:
            return None, self._second.popleft()[1]
        a, b = self._first[0][0], self._second[0][0]
        if a <= b and (b - a > self._slop or _nearer(self._first, b)):
            return self._first.popleft()[1], None
        if b < a and (a - b > self._slop or _nearer(self._second, a)):
            return None, self._second.popleft()[1]
        return self._first.popleft()[1], self._second.popleft()[1]


def _nearer(stream: "deque[tuple[float, _A]]", stamp: float) -> bool:
    """Whether the second in line is nearer to a stamp than the first."""
    return len(stream) > 1 and abs(stream[1][0] - stamp) < abs(stream[0][0] - stamp)
