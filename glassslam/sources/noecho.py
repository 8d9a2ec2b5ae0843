"""The value a lidar writes for a beam without echo, read off the ranges themselves: headers lie."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glassslam.records import Float32Array

# A value counts as repeated from this many beams on.
_MIN_REPEATS = 20
# Real surfaces spread over neighbouring values; the no-echo value outnumbers every other far one this often.
_DOMINANCE = 3.0
# The far side: what is compared with the no-echo value lies above this share of it.
_FAR = 0.5
# Some logs smear the no-echo value by their unit conversion: all within this share below it belong to it,
_BAND = 0.01
# as long as they have this share of the repeats of the main one, which makes up this share of them all.
_BAND_REPEATS = 0.01
_MAIN_SHARE = 0.5
# A few wild ranges beyond the no-echo value do not hide it.
_WILD = 0.02
# A wall faced by a standing robot repeats its range as well, but within this share of the field of view
_PATCH = 0.1
# for at least this share of its beams.
_PATCH_SHARE = 0.9


@dataclass(frozen=True, slots=True)
class NoEcho:
    """How a recording says that a beam had no echo.

    Attributes
    ----------
    value : float or None
        The repeated range, m (may be inf); None when no beam without echo was seen.
    ceiling : float
        Finite ranges from here on are no echoes, m; inf when there is no finite no-echo value.
    """

    value: float | None = None
    ceiling: float = float("inf")


def detect_no_echo(ranges: Iterable[Float32Array]) -> NoEcho:
    """Find the no-echo value in scans taken from all over a recording.

    It is the farthest value that is repeated exactly, far more often than any other far value, and not in
    one direction only.

    Parameters
    ----------
    ranges : iterable of ndarray
        Ranges of some scans, m.

    Returns
    -------
    NoEcho
        The value, and the limit from which on ranges mean no echo.
    """
    scans = [np.asarray(scan, dtype=np.float32) for scan in ranges if len(scan)]
    if not scans:
        return NoEcho()
    sample = _Sample(scans)
    for k in sample.candidates():
        band = sample.band(k) & (sample.counts >= _BAND_REPEATS * sample.counts[k])
        return NoEcho(float(sample.values[k]), float(sample.values[band][0]))
    return NoEcho(value=np.inf) if any(np.isposinf(scan).any() for scan in scans) else NoEcho()


class _Sample:
    """The distinct finite ranges of some scans, how often each occurs, and in which directions."""

    def __init__(self, scans: Sequence[Float32Array]) -> None:
        everything = np.concatenate(scans)
        direction = np.concatenate([np.arange(scan.size) / scan.size for scan in scans])
        usable = np.isfinite(everything) & (everything > 0)
        self._ranges, self._directions = everything[usable], direction[usable]
        self.values, self.counts = np.unique(self._ranges, return_counts=True)

    def candidates(self) -> Iterator[int]:
        """Indices of far values that outnumber every other far one, the farthest first."""
        at_or_beyond = np.append(np.cumsum(self.counts[::-1])[::-1], 0)
        for k in np.flatnonzero(self.counts >= _MIN_REPEATS)[::-1].tolist():
            limit = self.values[k] * (1.0 + _BAND)
            wild = at_or_beyond[np.searchsorted(self.values, limit, side="right")]
            if wild > _WILD * self.counts.max():
                return
            if wild <= _WILD * self.counts[k] and self._dominates(k) and not self._is_patch(k):
                yield k

    def band(self, k: int) -> NDArray[np.bool_]:
        """Which values are so near to one that they may be the same before a conversion of units."""
        return np.asarray(np.abs(self.values - self.values[k]) <= _BAND * self.values[k])

    def _dominates(self, k: int) -> bool:
        band = self.band(k)
        far = (self.values > _FAR * self.values[k]) & (self.values < self.values[k]) & ~band
        rivals = np.flatnonzero(far & (self.counts * _DOMINANCE > self.counts[k]))
        main = self.counts[k] >= _MAIN_SHARE * self.counts[band].sum()
        return bool(main) and all(self._is_patch(rival) for rival in rivals.tolist())

    def _is_patch(self, k: int) -> bool:
        """Whether a value is seen in one direction only."""
        directions = np.sort(self._directions[self._ranges == self.values[k]])
        last = np.searchsorted(directions, directions + _PATCH, side="right")
        densest = int(np.max(last - np.arange(directions.size)))
        return densest >= _PATCH_SHARE * directions.size
