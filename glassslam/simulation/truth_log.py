"""What every beam truly met, gathered while a simulation is recorded."""

from pathlib import Path

import numpy as np

from detectors.labels import GLASS, NAMES
from glassslam.records import FloatArray
from glassslam.simulation.echo import Observation

_STEP = 0.05


class TruthLog:
    """Labels of all beams, and how much of every pane has answered.

    Parameters
    ----------
    segments : ndarray of float64, shape (n, 4)
        All surfaces of the plan, end points in m.
    """

    def __init__(self, segments: FloatArray) -> None:
        self._labels: list[bytes] = []
        self._mirrored: list[bytes] = []
        self._beams = 0
        self._lengths = np.hypot(*(segments[:, 2:] - segments[:, :2]).T)
        bins = np.maximum(1, np.ceil(self._lengths / _STEP)).astype(np.int64)
        self._first = np.concatenate(([0], np.cumsum(bins)))
        self._answered = np.zeros(int(self._first[-1]), dtype=np.bool_)

    def add(self, seen: Observation) -> None:
        """Take in the truth of the next scan."""
        self._beams = seen.labels.size
        self._labels.append(seen.labels.tobytes())
        self._mirrored.append(np.packbits(seen.mirrored).tobytes())
        glass = seen.labels == GLASS
        segment, along = seen.segment[glass], seen.along[glass]
        bins = np.clip((along / _STEP).astype(np.int64), 0, np.diff(self._first)[segment] - 1)
        self._answered[self._first[segment] + bins] = True

    def answered(self) -> FloatArray:
        """Length of each surface from which at least one echo came, m, in steps of 5 cm."""
        counts = np.add.reduceat(self._answered, self._first[:-1], dtype=np.int64)
        return np.minimum(counts * _STEP, self._lengths)

    def save(self, path: Path, stamps: FloatArray) -> None:
        """Write labels and mirrored (scans, beams), the stamps of the scans and the names of the labels."""
        scans = len(self._labels)
        labels = np.frombuffer(b"".join(self._labels), dtype=np.uint8).reshape(scans, self._beams)
        packed = np.frombuffer(b"".join(self._mirrored), dtype=np.uint8).reshape(scans, -1)
        mirrored = np.unpackbits(packed, axis=1, count=self._beams)
        with path.open("wb") as file:
            np.savez_compressed(file, labels=labels, mirrored=mirrored, stamps=stamps, names=np.array(NAMES))
