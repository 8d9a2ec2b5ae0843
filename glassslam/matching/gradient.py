"""Gradient scan matching on the smooth probability grid (Hess et al. 2016, section IV-C)."""

from dataclasses import dataclass

import numpy as np

from glassslam.config import Solver
from glassslam.errors import GridError
from glassslam.grid.probability_grid import ProbabilityGrid, point_array
from glassslam.matching.kernels import align, normal_equations
from glassslam.matching.problem import MatchProblem
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
    tolerance: float = 1e-3,
    solver: Solver = "lm",
) -> MatchResult:
    """Pose of least cost near a prediction.

    Minimises w_occ^2 / n * sum_k (1 - M_smooth(T h_k))^2 + w_t^2 |t - t_0|^2 + w_r^2 (theta - theta_0)^2
    (Hess et al. 2016, section IV-C); residuals and derivatives are modelled in CasADi (`matching/model.py`).

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
        Most steps tried.
    tolerance : float
        Where to stop: "lm" when a step is shorter (m; a third of it in rad) or saves a smaller share
        of the cost, "casadi" when the gradient is smaller.
    solver : {"lm", "casadi"}
        The project's loop (Levenberg-Marquardt on exact second derivatives), or CasADi's sqpmethod
        on the same kernel.

    Raises
    ------
    GridError
        Points of another shape, or an unknown solver.

    Examples
    --------
    >>> import numpy as np
    >>> wall = np.stack((np.full(200, 2.02), np.linspace(-2, 2, 200)), axis=1)
    >>> corner = np.concatenate((wall, np.stack((np.linspace(-2, 2, 200), np.full(200, 2.02)), axis=1)))
    >>> grid = ProbabilityGrid(0.05)
    >>> for _ in range(20):
    ...     grid.insert(np.zeros(2), corner, np.empty((0, 2)))
    >>> result = match_scan(grid, corner, np.array([0.05, -0.04, 0.02]))
    >>> bool(np.abs(result.pose).max() < 0.02)
    True
    """
    points = point_array(points)
    prior = np.array([translation_weight**2, translation_weight**2, rotation_weight**2])
    start = np.array(prediction, dtype=np.float64)
    weight = occupied_space_weight**2 / max(len(points), 1)
    problem = MatchProblem(grid, points, start, prior, weight)
    pose, information = np.empty(3), np.empty((3, 3))
    if solver == "casadi":
        from glassslam.matching import sqp  # noqa: PLC0415  (0.16 s)

        pose, iterations = sqp.minimise(problem, max_iterations, tolerance)
        arguments = (*problem.arguments[:5], pose, information, np.empty(3))
        spent = weight * normal_equations(*arguments)
        information *= weight
    elif solver == "lm":
        arguments = (*problem.arguments, max_iterations, pose, information, tolerance)
        cost, iterations = align(*arguments)
        spent = cost - float(prior @ (pose - start) ** 2)
    else:
        raise GridError(f"unknown solver {solver!r}", "known are lm and casadi")
    residual = float(np.sqrt(max(spent, 0.0))) / occupied_space_weight
    return MatchResult(pose, residual, information / occupied_space_weight**2, iterations)
