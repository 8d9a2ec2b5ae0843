"""A scan made ready: returns and free rays in the frame of the robot base, undistorted and thinned."""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from glassslam.config import SensorConfig
from glassslam.records import Float32Array, FloatArray, LaserScan
from glassslam.slam.beam_errors import errors_of
from glassslam.slam.range_kernels import beams_to_points, voxel_filter

_FARTHEST_DENSITY = 50.0


def _no_points() -> FloatArray:
    return np.empty((0, 2))


@dataclass(frozen=True, slots=True)
class RangeData:
    """One scan in the frame of the base at the stamp of the scan.

    Attributes
    ----------
    stamp : float
        Time of the first beam, s.
    sensor : ndarray of float64, shape (2,)
        Position of the laser, m.
    returns : ndarray of float64, shape (n, 2)
        Points hit, m.
    free_ends : ndarray of float64, shape (m, 2)
        Ends of the free space of beams without echo, m.
    ghosts : ndarray of float64, shape (g, 2)
        Points hit behind glass, which are neither matched nor entered into submaps, m.
    """

    stamp: float
    sensor: FloatArray
    returns: FloatArray
    free_ends: FloatArray
    ghosts: FloatArray = field(default_factory=_no_points)


def prepare(
    scan: LaserScan,
    base_from_laser: FloatArray,
    twist: FloatArray,
    config: SensorConfig,
    behind_glass: NDArray[np.bool_] | None = None,
) -> RangeData:
    """Sort the beams into returns, silent and invalid ones, and undo the motion of the robot.

    Parameters
    ----------
    scan : LaserScan
        The sweep as recorded.
    base_from_laser : ndarray of float64, shape (3,)
        Pose of the laser in the base frame, m and rad.
    twist : ndarray of float64, shape (3,)
        Velocity of the base in its own frame, m/s and rad/s.
    config : SensorConfig
        Range limits, length of silent rays and errors of the beams.
    behind_glass : ndarray of bool, shape (n,), optional
        Beams whose returns are kept apart as ghosts.
    """
    sensor = np.array(base_from_laser[:2])
    if behind_glass is None:
        return RangeData(scan.stamp, sensor, *_sorted(scan.ranges, scan, base_from_laser, twist, config))
    before = np.where(behind_glass, np.float32(np.nan), scan.ranges)
    behind = np.where(behind_glass, scan.ranges, np.float32(np.nan))
    ghosts, _ = _sorted(behind, scan, base_from_laser, twist, config)
    return RangeData(scan.stamp, sensor, *_sorted(before, scan, base_from_laser, twist, config), ghosts)


def _sorted(
    ranges: Float32Array,
    scan: LaserScan,
    base_from_laser: FloatArray,
    twist: FloatArray,
    config: SensorConfig,
) -> tuple[FloatArray, FloatArray]:
    """Returns and ends of free space."""
    count = len(ranges)
    points, free = np.empty((count, 2)), np.empty((count, 2))
    hits, silent = beams_to_points(
        ranges, scan.angle_min, scan.angle_increment, scan.time_increment, base_from_laser, twist,
        max(scan.range_min, config.min_range), min(scan.range_max, config.max_range), scan.range_max,
        config.missing_data_ray_length, errors_of(config), points, free,
    )  # fmt: skip
    return points[:hits].copy(), free[:silent].copy()


def base_motion(twist: FloatArray, times: FloatArray) -> FloatArray:
    """Where the base is at times after the stamp of a scan, as poses in its frame at the stamp, shape (k, 3).

    Parameters
    ----------
    twist : ndarray of float64, shape (3,)
        Constant velocity of the base in its own frame, m/s and rad/s.
    times : ndarray of float64, shape (k,)
        Seconds after the stamp.
    """
    half = 0.5 * twist[2] * times
    # the chord of the arc travelled is shorter than the arc, and points halfway
    chord = times * np.sinc(half / np.pi)
    cosine, sine = np.cos(half), np.sin(half)
    x = chord * (cosine * twist[0] - sine * twist[1])
    y = chord * (sine * twist[0] + cosine * twist[1])
    return np.stack((x, y, 2.0 * half), axis=1)


def thin(points: FloatArray, edge: float) -> FloatArray:
    """The first point of every voxel of an edge length, m; order kept (as Cartographer's voxel filter)."""
    if edge <= 0 or len(points) == 0:
        return points
    return points[voxel_filter(points, edge)]


def thin_adaptively(points: FloatArray, max_edge: float, min_points: int) -> FloatArray:
    """The coarsest thinning with an edge of at most `max_edge` (m) that leaves `min_points`.

    The edge is found by bisection to a tenth, as in Cartographer's adaptive voxel filter.
    """
    if len(points) <= min_points:
        return points
    result = thin(points, max_edge)
    if len(result) >= min_points:
        return result
    low, high = max_edge / _FARTHEST_DENSITY, max_edge
    result = thin(points, low)
    if len(result) < min_points:
        return points
    while high / low > 1.1:
        middle = math.sqrt(low * high)
        candidate = thin(points, middle)
        if len(candidate) >= min_points:
            low, result = middle, candidate
        else:
            high = middle
    return result
