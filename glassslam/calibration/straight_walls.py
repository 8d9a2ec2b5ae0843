"""Straight walls in single scans, whatever the pose of the robot."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from glassslam.records import FloatArray, LaserScan

_WINDOW = 8
_WALLS_PER_SCAN = 4
_LEAST_RETURNS = 15
_LEAST_LENGTH = 0.8
_LEAST_SPAN = 0.35
# wide enough for the bend that is looked for, and growing with range as that bend does
_TOLERANCE = 0.03
_TOLERANCE_PER_RANGE = 0.01
_LEAST_CHANGE = 0.02

_Beams: TypeAlias = tuple[FloatArray, FloatArray]
"""Angles and ranges."""


@dataclass(frozen=True, slots=True)
class WallPoints:
    """Beams that end on straight walls, wall after wall.

    Attributes
    ----------
    angles, ranges : ndarray of float64, shape (n,)
        As announced by the scan, rad and m.
    starts : ndarray of int64, shape (w,)
        First entry of every wall.
    """

    angles: FloatArray
    ranges: FloatArray
    starts: NDArray[np.int64]

    @property
    def walls(self) -> int:
        """Number of walls; the same wall in two scans counts twice."""
        return len(self.starts)

    def sums(self, values: FloatArray) -> FloatArray:
        """Sum over the beams of every wall, shape (w, ...)."""
        return np.add.reduceat(values, self.starts, axis=0)

    def spread(self, values: FloatArray) -> FloatArray:
        """Value of its wall for every beam, shape (n, ...)."""
        return np.repeat(values, np.diff(np.append(self.starts, len(self.angles))), axis=0)


def wall_points(scans: Iterable[LaserScan], max_range: float, max_scans: int) -> WallPoints:
    """Find the straight walls in scans that differ from one another.

    Parameters
    ----------
    scans : iterable of LaserScan
        Scans of one lidar.
    max_range : float
        Returns beyond are left out, m.
    max_scans : int
        Scans looked at, spread evenly over those that differ.
    """
    chosen = _spread(_different(scans, max_range), max_scans)
    found = [wall for angles, ranges in chosen for wall in _walls(angles, ranges)]
    if not found:
        return WallPoints(np.empty(0), np.empty(0), np.empty(0, dtype=np.int64))
    lengths = [len(angles) for angles, _ in found]
    starts = np.concatenate(([0], np.cumsum(lengths)[:-1])).astype(np.int64)
    return WallPoints(
        np.concatenate([angles for angles, _ in found]), np.concatenate([r for _, r in found]), starts
    )


def _spread(scans: Iterable[_Beams], most: int) -> list[_Beams]:
    """At most so many scans, evenly spread; never more than twice as many are held."""
    kept: list[_Beams] = []
    stride = 1
    for count, scan in enumerate(scans):
        if count % stride == 0:
            kept.append(scan)
        if len(kept) > 2 * most:
            kept, stride = kept[::2], 2 * stride
    return kept[:: max(1, -(-len(kept) // most))]


def _different(scans: Iterable[LaserScan], max_range: float) -> Iterator[_Beams]:
    """Angles and ranges of scans that were not taken where the one before was, NaN for unusable beams."""
    last: FloatArray | None = None
    for scan in scans:
        ranges = scan.ranges.astype(np.float64)
        usable = (ranges > scan.range_min) & (ranges < min(scan.range_max, max_range))
        ranges[~usable] = np.nan
        if last is not None and len(last) == len(ranges):
            change = np.abs(ranges - last)
            change = change[np.isfinite(change)]
            if len(change) and np.median(change) < _LEAST_CHANGE:
                continue
        last = ranges
        yield scan.angle_min + scan.angle_increment * np.arange(len(ranges), dtype=np.float64), ranges


def _walls(angles: FloatArray, ranges: FloatArray) -> Iterator[_Beams]:
    """Angles and ranges of the beams on each wall of one scan, the wall with most returns first."""
    usable = np.isfinite(ranges)
    angles, ranges = angles[usable], ranges[usable]
    points = np.stack((ranges * np.cos(angles), ranges * np.sin(angles)), axis=1)
    tolerance = _TOLERANCE + _TOLERANCE_PER_RANGE * ranges
    for _ in range(_WALLS_PER_SCAN):
        on_wall = _largest(points, tolerance)
        if on_wall.sum() < _LEAST_RETURNS:
            return
        if _is_long(points[on_wall], angles[on_wall]):
            yield angles[on_wall], ranges[on_wall]
        points, tolerance = points[~on_wall], tolerance[~on_wall]
        angles, ranges = angles[~on_wall], ranges[~on_wall]


def _largest(points: FloatArray, tolerance: FloatArray) -> NDArray[np.bool_]:
    """Returns on the line that most of them are near to, of all lines through neighbouring returns."""
    if len(points) < _LEAST_RETURNS:
        return np.zeros(len(points), dtype=np.bool_)
    windows = np.lib.stride_tricks.sliding_window_view(points, _WINDOW, axis=0)[:: _WINDOW // 4]
    normals, offsets = _line_fit(windows)
    near = np.abs(normals @ points.T - offsets[:, None]) < tolerance
    best: NDArray[np.bool_] = near[np.argmax(near.sum(axis=1))]
    if not best.any():
        return best
    for _ in range(3):
        normal, offset = _line_fit(points[best].T[None])
        closer = np.abs(points @ normal[0] - offset[0]) < tolerance
        if closer.sum() < _LEAST_RETURNS:
            break
        best = closer
    return best


def _line_fit(groups: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Normals, shape (g, 2), and offsets, shape (g,), of lines through groups of points, shape (g, 2, k)."""
    centres = groups.mean(axis=2)
    x, y = np.moveaxis(groups - centres[:, :, None], 1, 0)
    heading = 0.5 * np.arctan2(2.0 * (x * y).sum(axis=1), (x * x - y * y).sum(axis=1))
    normals = np.stack((-np.sin(heading), np.cos(heading)), axis=1)
    return normals, (normals * centres).sum(axis=1)


def _is_long(points: FloatArray, angles: FloatArray) -> bool:
    """Whether a wall is long enough, and seen over a wide enough angle, to tell that it bends."""
    length = float(np.hypot(*np.ptp(points, axis=0)))
    steps = np.unwrap(np.sort(np.mod(angles, 2.0 * np.pi)))
    gap = max(float(np.diff(steps).max()), 2.0 * np.pi - float(np.ptp(steps)))
    return length > _LEAST_LENGTH and 2.0 * np.pi - gap > _LEAST_SPAN
