"""Gradient scan matching on the smooth probability grid (Hess et al. 2016, section IV-C)."""

from dataclasses import dataclass

import numpy as np

from glassslam.grid.probability_grid import ProbabilityGrid
from glassslam.matching.kernels import align
from glassslam.records import FloatArray


@dataclass(frozen=True, slots=True)
class MatchResult:
    """Where a scan fits.

    Attributes
    ----------
    pose : ndarray of float64, shape (3,)
        Pose of the scan in the frame of the grid, m and rad.
    residual : float
        Root mean square of 1 - P(occupied) over the points, in [0, 1], priors left out.
    information : ndarray of float64, shape (3, 3)
        J^T J / n of the point residuals at the pose, in 1/m^2, 1/m and 1: how well the walls hold it.
    iterations : int
        Evaluations of the normal equations.
    """

    pose: FloatArray
    residual: float
    information: FloatArray
    iterations: int


def match_scan(
    grid: ProbabilityGrid,
    points: FloatArray,
    prediction: FloatArray,
    *,
    occupied_space_weight: float = 1.0,
    translation_weight: float = 0.0,
    rotation_weight: float = 0.0,
    max_iterations: int = 20,
) -> MatchResult:
    """Pose of least cost near a prediction.

    Minimises w_occ^2 / n * sum_k (1 - M_smooth(T h_k))^2 + w_t^2 |t - t_0|^2 + w_r^2 (theta - theta_0)^2
    (METHODS.md, section 0); residuals and derivatives are modelled in CasADi (`matching/model.py`).

    Parameters
    ----------
    grid : ProbabilityGrid
        The map to match against.
    points : ndarray of float64, shape (n, 2)
        Returns in the frame of the scan, m.
    prediction : ndarray of float64, shape (3,)
        Pose of the scan in the frame of the grid, m and rad.
    occupied_space_weight, translation_weight, rotation_weight : float
        Weights of the residuals; 1, 1/m and 1/rad.
    max_iterations : int
        Most evaluations of the normal equations.

    Examples
    --------
    >>> import numpy as np
    >>> wall = np.stack((np.full(200, 2.0), np.linspace(-2, 2, 200)), axis=1)
    >>> corner = np.concatenate((wall, np.stack((np.linspace(-2, 2, 200), np.full(200, 2.0)), axis=1)))
    >>> grid = ProbabilityGrid(0.05)
    >>> for _ in range(20):
    ...     grid.insert(np.zeros(2), corner, np.empty((0, 2)))
    >>> result = match_scan(grid, corner, np.array([0.05, -0.04, 0.02]))
    >>> bool(np.abs(result.pose).max() < 0.01)
    True
    """
    pose, information = np.empty(3), np.empty((3, 3))
    count = max(len(points), 1)
    weight = occupied_space_weight**2 / count
    prior = np.array([translation_weight**2, translation_weight**2, rotation_weight**2])
    start = np.asarray(prediction, dtype=np.float64)
    cost, iterations = align(
        grid.cells, grid.table, grid.origin, 1.0 / grid.resolution, points, start, prior, weight,
        max_iterations, pose, information,
    )  # fmt: skip
    spent = cost - float(prior @ (pose - start) ** 2)
    residual = float(np.sqrt(max(spent, 0.0))) / occupied_space_weight
    return MatchResult(pose, residual, information / occupied_space_weight**2, iterations)
