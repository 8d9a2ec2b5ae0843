"""What every beam truly met, gathered while a simulation is recorded."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from detectors.labels import GLASS, NAMES
from glassslam.records import Float32Array, FloatArray
from glassslam.simulation.echo import Observation

_STEP = 0.05
_NONE = 255


class TruthLog:
    """Labels of all beams, and how much of every pane has answered.

    Parameters
    ----------
    segments : ndarray of float64, shape (n, 4)
        All surfaces of the plan, end points in m.
    """

    def __init__(self, segments: FloatArray) -> None:
        self._segments = segments
        self._panes: list[tuple[NDArray[np.int32], Float32Array]] = []
        self._ranges: list[bytes] = []
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
        self._ranges.append(_decimetres(seen.ranges).tobytes())
        glass = seen.labels == GLASS
        segment, along = seen.segment[glass], seen.along[glass]
        self._panes.append((segment, along))
        bins = np.clip((along / _STEP).astype(np.int64), 0, np.diff(self._first)[segment] - 1)
        self._answered[self._first[segment] + bins] = True

    def answered(self) -> FloatArray:
        """Length of each surface from which at least one echo came, m, in steps of 5 cm."""
        counts = np.add.reduceat(self._answered, self._first[:-1], dtype=np.int64)
        return np.minimum(counts * _STEP, self._lengths)

    def save(self, path: Path, stamps: FloatArray, lasers: FloatArray) -> None:
        """Write labels, mirrored, ranges and incidences (scans, beams), and the names of the labels.

        Parameters
        ----------
        path : Path
            The npz file.
        stamps : ndarray of float64, shape (scans,)
            Of the scans, s.
        lasers : ndarray of float64, shape (scans, 2) or (scans, 3)
            Where the laser was at these times, in the frame of the segments, m.
        """
        scans = len(self._labels)
        labels = self._table(self._labels)
        packed = np.frombuffer(b"".join(self._mirrored), dtype=np.uint8).reshape(scans, -1)
        mirrored = np.unpackbits(packed, axis=1, count=self._beams)
        with path.open("wb") as file:
            np.savez_compressed(
                file,
                labels=labels,
                mirrored=mirrored,
                range_dm=self._table(self._ranges),
                incidence_deg=self._incidence(labels, lasers),
                stamps=stamps,
                names=np.array(NAMES),
            )

    def _table(self, rows: list[bytes]) -> NDArray[np.uint8]:
        return np.frombuffer(b"".join(rows), dtype=np.uint8).reshape(len(rows), self._beams)

    def _incidence(self, labels: NDArray[np.uint8], lasers: FloatArray) -> NDArray[np.uint8]:
        """Whole degrees between the beams that panes answered and the normals of these; 255 elsewhere."""
        out = np.full(labels.shape, _NONE, dtype=np.uint8)
        direction = (self._segments[:, 2:] - self._segments[:, :2]) / self._lengths[:, None]
        for k, (segment, along) in enumerate(self._panes):
            way = self._segments[segment, :2] + along[:, None] * direction[segment] - lasers[k, :2]
            beside = np.abs((way * direction[segment]).sum(axis=1)) / np.hypot(way[:, 0], way[:, 1])
            degrees = np.rad2deg(np.arcsin(np.minimum(beside, 1.0)))
            out[k, labels[k] == GLASS] = np.rint(degrees).astype(np.uint8)
        return out


def _decimetres(ranges: Float32Array) -> NDArray[np.uint8]:
    """Ranges in steps of 0.1 m; 255 from 25.5 m on and without echo."""
    return np.asarray(np.rint(np.minimum(10.0 * ranges, float(_NONE))), dtype=np.uint8)
