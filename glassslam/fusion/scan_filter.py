"""Laser readings replaced by sonar before any SLAM: GlassDetect and CornerAdjust (Zhang et al., approach A).

What the paper leaves open is settled so. The check of a sector is the mean over its beams of the difference
laser - sonar, weighted by the parabola of algorithm 1; that parabola is 0.3 at the edges and 1 in the middle
of the 57 beams that the paper's laser has in a sector, so the beam index is scaled to 57 for other lasers.
A beam without echo counts as the range limit of the laser. A slope is the change of range with the angle.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from glassslam.config import ScanFilterConfig
from glassslam.errors import GridError
from glassslam.geometry import between, wrap_angle
from glassslam.records import FloatArray, LaserScan, SonarRing

_BEAMS_OF_PAPER = 57
_PARALLEL = 0.05
_SAME_WAY = 1e-6


@dataclass(frozen=True, slots=True)
class FilteredScan:
    """A laser scan after the two filters.

    Attributes
    ----------
    scan : LaserScan
        The scan with the readings of glass sectors replaced.
    glass : ndarray of bool, shape (n,)
        Sonars whose sector was drawn as glass.
    corner : ndarray of bool, shape (n,)
        Sonars whose sector was taken for glass first and then for a corner; its readings were put back.
    check : ndarray of float64, shape (n,)
        Weighted mean difference of each sector, m; 0 where too few beams are longer than the sonar.
    steep_slopes : ndarray of int64, shape (n,)
        Steps between consecutive beams of each sector that are steeper than `corner_slope`.
    """

    scan: LaserScan
    glass: NDArray[np.bool_]
    corner: NDArray[np.bool_]
    check: FloatArray
    steep_slopes: NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class _View:
    """Scan and sweep in the frame of the laser."""

    angles: FloatArray
    ranges: FloatArray
    axes: FloatArray
    ends: FloatArray
    distances: FloatArray
    sectors: list[NDArray[np.int64]]


def filter_scan(
    scan: LaserScan,
    base_from_laser: FloatArray,
    ring: SonarRing,
    sonar_ranges: FloatArray,
    config: ScanFilterConfig,
) -> FilteredScan:
    """Draw glass that the sonars hear into a laser scan.

    Parameters
    ----------
    scan : LaserScan
        The scan.
    base_from_laser : ndarray of float64, shape (3,)
        Pose of the laser in the base frame, m and rad.
    ring : SonarRing
        Where the sonars sit in the base frame.
    sonar_ranges : ndarray of float, shape (n,)
        The sweep nearest in time, m; readings that are not finite or beyond `max_range` are not used.
    config : ScanFilterConfig
        Thresholds.

    Raises
    ------
    GridError
        A sweep with another number of ranges than the ring has sonars.
    """
    if np.shape(sonar_ranges) != (len(ring.poses),):
        raise GridError(
            f"sweep of shape {np.shape(sonar_ranges)} for {len(ring.poses)} sonars",
            "give one range per sonar",
        )
    view = _view(scan, base_from_laser, ring, np.asarray(sonar_ranges, dtype=np.float64), config)
    check = np.array([_check(view, k, config) for k in range(len(ring.poses))])
    suspected = (check > 0) & (check >= config.min_difference)
    slopes = np.array([_steep_slopes(view, k, config.corner_slope) for k in range(len(ring.poses))])
    corner = suspected & ((slopes == 1) | (slopes == 2))
    ranges = np.array(scan.ranges, dtype=np.float32)
    for k in np.flatnonzero(suspected & ~corner):
        sector = view.sectors[k]
        drawn = _ranges_to_glass(view, int(k), suspected)
        ranges[sector] = np.where(np.isfinite(drawn), drawn, ranges[sector])
    return FilteredScan(replace(scan, ranges=ranges), suspected & ~corner, corner, check, slopes)


def _view(
    scan: LaserScan,
    base_from_laser: FloatArray,
    ring: SonarRing,
    sonar_ranges: FloatArray,
    config: ScanFilterConfig,
) -> _View:
    angles = scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges), dtype=np.float64)
    sonars = between(np.asarray(base_from_laser, dtype=np.float64)[None], np.asarray(ring.poses, np.float64))
    heard = np.isfinite(sonar_ranges) & (sonar_ranges >= ring.range_min) & (sonar_ranges <= config.max_range)
    reach = np.where(heard, sonar_ranges, np.nan)[:, None]
    ends = sonars[:, :2] + reach * np.column_stack((np.cos(sonars[:, 2]), np.sin(sonars[:, 2])))
    ranges = np.asarray(scan.ranges, dtype=np.float64)
    usable = (ranges >= scan.range_min) & (ranges > 0)
    ranges = np.where(usable, np.minimum(ranges, scan.range_max), np.nan)
    return _View(
        angles, ranges, sonars[:, 2], ends, np.hypot(ends[:, 0], ends[:, 1]),
        sectors(sonars[:, 2], angles, np.radians(config.max_sector_deg)),
    )  # fmt: skip


def sectors(axes: FloatArray, angles: FloatArray, max_width: float) -> list[NDArray[np.int64]]:
    """Beams that belong to each sonar: those nearest to its axis, at most half of `max_width` (rad) away.

    They are numbered from right to left as seen by the sonar, wherever the scan begins. Of sonars with
    the same axis the first owns the beams.

    Parameters
    ----------
    axes : ndarray of float64, shape (n,)
        Directions of the sonars in the frame of the laser, rad.
    angles : ndarray of float64, shape (b,)
        Directions of the beams, rad.
    max_width : float
        Largest width of a sector, rad.
    """
    turn = wrap_angle(angles[None, :] - axes[:, None])
    away = np.abs(turn)
    owner = away.argmin(axis=0)
    near = away.min(axis=0) <= 0.5 * max_width + 1e-9
    own = [np.flatnonzero(near & (owner == k)) for k in range(len(axes))]
    return [beams[np.argsort(turn[k, beams], kind="stable")] for k, beams in enumerate(own)]


def _check(view: _View, sonar: int, config: ScanFilterConfig) -> float:
    """Weighted mean difference of a sector (algorithm 1); 0 when too few beams are longer."""
    sector = view.sectors[sonar]
    if len(sector) == 0 or not np.isfinite(view.distances[sonar]):
        return 0.0
    difference = view.ranges[sector] - view.distances[sonar]
    longer = difference >= config.glass_offset
    if longer.mean() < config.min_share:
        return 0.0
    i = (np.arange(len(sector)) + 0.5) * _BEAMS_OF_PAPER / len(sector)
    weight = -0.0008618 * i**2 + 0.0491 * i + 0.3
    return float(np.nan_to_num(difference * weight).mean())


def _steep_slopes(view: _View, sonar: int, limit: float) -> int:
    """How many steps between consecutive beams of a sector are steeper than the limit, m/rad."""
    sector = view.sectors[sonar]
    turns = np.diff(wrap_angle(view.angles[sector] - view.axes[sonar]))
    # not divided by the turn: the first and the last beam of a full circle may look the same way
    steep = np.abs(np.diff(view.ranges[sector])) > limit * turns
    return int((steep & (turns > _SAME_WAY)).sum())


def _ranges_to_glass(view: _View, sonar: int, suspected: NDArray[np.bool_]) -> FloatArray:
    """Ranges of the beams of a sector to the glass drawn there (algorithm 2); NaN where they miss it.

    Towards a neighbour that hears glass too the glass runs through both end points; alone it stands across
    the axis. The line to the only such neighbour goes on over the rest of the sector.
    """
    sector = view.sectors[sonar]
    before, after = _neighbour(view, sonar, suspected, -1), _neighbour(view, sonar, suspected, 1)
    end = view.ends[sonar]
    offset = wrap_angle(view.angles[sector] - np.arctan2(end[1], end[0]))
    lines = [end - view.ends[k] if k >= 0 else None for k in (before, after)]
    axis = view.axes[sonar]
    across = np.array([-np.sin(axis), np.cos(axis)])
    towards = [
        next((line for line in (lines[side], lines[1 - side]) if line is not None), across) for side in (0, 1)
    ]
    return np.where(
        offset < 0,
        _intersections(end, towards[0], view.angles[sector]),
        _intersections(end, towards[1], view.angles[sector]),
    )


def _neighbour(view: _View, sonar: int, suspected: NDArray[np.bool_], side: int) -> int:
    """The nearest sonar to one side when it hears glass and its sector adjoins; otherwise -1."""
    turn = side * wrap_angle(view.axes - view.axes[sonar])
    turn = np.where(turn > 1e-6, turn, np.inf)
    nearest = int(turn.argmin())
    return nearest if np.isfinite(turn[nearest]) and suspected[nearest] and turn[nearest] < 1.0 else -1


def _intersections(point: FloatArray, direction: FloatArray, angles: FloatArray) -> FloatArray:
    """Distances from the laser to a line along beams; NaN for those that run along it or away from it."""
    nx, ny = -direction[1], direction[0]
    length = float(np.hypot(nx, ny))
    if length < 1e-6:
        return np.full(len(angles), np.nan)
    facing = (nx * np.cos(angles) + ny * np.sin(angles)) / length
    reach = (nx * point[0] + ny * point[1]) / length
    distance = np.divide(reach, facing, out=np.full(len(angles), np.nan), where=np.abs(facing) > _PARALLEL)
    return np.where(distance > 0, distance, np.nan)
