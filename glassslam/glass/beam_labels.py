"""What the glass detector said about the beams of a run, kept as runs of neighbouring beams.

A pane answers over many beams side by side, and what lies behind it likewise. So the labels of a scan are
a few runs of equal ones; a recording of hours stays small.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from detectors.labels import GHOST, GLASS
from glassslam.records import FloatArray


@dataclass(frozen=True, slots=True)
class GlassBeams:
    """Beams labelled as glass or ghosts; every other beam of the scans looked at is neither.

    Attributes
    ----------
    stamps : ndarray of float64, shape (s,)
        Of all scans that the detector has looked at, s, in the order of the recording.
    scan : ndarray of int64, shape (m,)
        Index into `stamps` of every run of labelled beams, never falling.
    beam, count : ndarray of int32, shape (m,)
        First beam of the run, and how many beams it has.
    label : ndarray of uint8, shape (m,)
        GLASS or GHOST of `detectors.labels`.
    """

    stamps: FloatArray
    scan: NDArray[np.int64]
    beam: NDArray[np.int32]
    count: NDArray[np.int32]
    label: NDArray[np.uint8]

    def __len__(self) -> int:
        """Number of labelled beams."""
        return int(self.count.sum())

    def of_label(self, label: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Every single beam of a label: its scan (k,) as an index into `stamps`, and its number (k,)."""
        chosen = self.label == label
        count = self.count[chosen].astype(np.int64)
        before = np.cumsum(count) - count
        inside = np.arange(count.sum()) - np.repeat(before, count)
        return np.repeat(self.scan[chosen], count), np.repeat(self.beam[chosen], count) + inside


class BeamLabelLog:
    """Gathers the labels of a run, scan by scan.

    Examples
    --------
    >>> import numpy as np
    >>> log = BeamLabelLog()
    >>> log.add(12.5, np.array([1, 2, 2, 1, 3], dtype=np.uint8))
    >>> beams = log.beams()
    >>> beams.beam.tolist(), beams.count.tolist(), beams.label.tolist()
    ([1, 4], [2, 1], [2, 3])
    """

    def __init__(self) -> None:
        self._stamps: list[float] = []
        self._runs: list[NDArray[np.int32]] = []

    def add(self, stamp: float, labels: NDArray[np.uint8]) -> None:
        """Take in the labels (n,) of the next scan, as in `detectors.labels`."""
        self._stamps.append(stamp)
        self._runs.append(_runs(labels))

    def beams(self) -> GlassBeams:
        """Everything taken in so far."""
        table = np.concatenate([np.empty((0, 3), np.int32), *self._runs])
        scan = np.repeat(np.arange(len(self._runs), dtype=np.int64), [len(runs) for runs in self._runs])
        beam, count, label = np.ascontiguousarray(table.T)
        return GlassBeams(np.array(self._stamps), scan, beam, count, label.astype(np.uint8))

    @classmethod
    def of(cls, stamps: FloatArray, labels: NDArray[np.uint8]) -> Self:
        """The log of labels (s, n) of scans with stamps (s,), s."""
        log = cls()
        for stamp, row in zip(stamps, labels, strict=True):
            log.add(float(stamp), row)
        return log


def _runs(labels: NDArray[np.uint8]) -> NDArray[np.int32]:
    """Runs of equal labels of interest: rows of first beam, count, label."""
    kept = np.zeros(len(labels) + 2, dtype=np.int16)
    kept[1:-1] = np.where((labels == GLASS) | (labels == GHOST), labels, 0)
    edges = np.flatnonzero(kept[1:] != kept[:-1])
    label = kept[edges[:-1] + 1]
    rows = np.stack((edges[:-1], np.diff(edges), label), axis=1).astype(np.int32)
    return rows[label > 0]
