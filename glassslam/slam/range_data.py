"""A scan made ready: returns and free rays in the frame of the robot base, undistorted and thinned."""

import math
from dataclasses import dataclass

import numpy as np

from glassslam.config import SensorConfig
from glassslam.records import FloatArray, LaserScan
from glassslam.slam.range_kernels import beams_to_points, voxel_filter

_FARTHEST_DENSITY = 50.0


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
    """

    stamp: float
    sensor: FloatArray
    returns: FloatArray
    free_ends: FloatArray


def prepare(
    scan: LaserScan,
    base_from_laser: FloatArray,
    twist: FloatArray,
    config: SensorConfig,
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
        Range limits and length of silent rays.
    """
    count = len(scan.ranges)
    points, free = np.empty((count, 2)), np.empty((count, 2))
    hits, silent = beams_to_points(
        scan.ranges, scan.angle_min, scan.angle_increment, scan.time_increment, base_from_laser, twist,
        max(scan.range_min, config.min_range), min(scan.range_max, config.max_range), scan.range_max,
        config.missing_data_ray_length, points, free,
    )  # fmt: skip
    return RangeData(scan.stamp, np.array(base_from_laser[:2]), points[:hits].copy(), free[:silent].copy())


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
