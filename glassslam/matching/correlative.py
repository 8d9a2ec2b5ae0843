"""Real-time correlative scan matching: an exhaustive search in a small window (Olson 2009)."""

import math

import numpy as np

from glassslam.grid.probability_grid import ProbabilityGrid
from glassslam.matching.exhaustive_kernels import exhaustive_search
from glassslam.records import FloatArray

_FARTHEST = 15.0
_MOST_POINTS = 90
_ANGLE_STEP = 0.015
_COST_WEIGHT = 0.1


def search_around(
    grid: ProbabilityGrid, points: FloatArray, guess: FloatArray, linear_window: float, angular_window: float
) -> FloatArray:
    """Best pose on a raster around a guess, shape (3,), m and rad.

    Scores the mean P(occupied) of the cells hit, discounted with the distance from the guess (both
    cost weights 0.1, as Cartographer). About 90 of the points nearer than 15 m take part: a turn by
    one step of the raster moves the farthest of them by about a cell.

    Parameters
    ----------
    grid : ProbabilityGrid
        The map.
    points : ndarray of float64, shape (n, 2)
        Returns in the frame of the scan, m.
    guess : ndarray of float64, shape (3,)
        Pose of the scan in the frame of the grid, m and rad.
    linear_window, angular_window : float
        Half widths of the window, m and rad.
    """
    near = points[(points**2).sum(axis=1) < _FARTHEST**2]
    if len(near) == 0:
        return np.array(guess)
    chosen = np.ascontiguousarray(near[:: max(1, len(near) // _MOST_POINTS)])
    pose = np.array(guess, dtype=np.float64)
    exhaustive_search(
        grid.cells, grid.table, grid.origin, 1.0 / grid.resolution, chosen, pose.copy(),
        math.ceil(linear_window / grid.resolution), math.ceil(angular_window / _ANGLE_STEP), _ANGLE_STEP,
        _COST_WEIGHT, _COST_WEIGHT, pose,
    )  # fmt: skip
    return pose
