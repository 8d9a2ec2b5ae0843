"""The gradient match that makes the result of a search exact."""

from glassslam.config import Solver
from glassslam.grid.probability_grid import ProbabilityGrid
from glassslam.matching.gradient import MatchResult, match_scan
from glassslam.records import FloatArray

# Odometry has no say in what a search has found: this only holds what no wall determines.
_WEAK_WEIGHT = 0.03


def refined(
    grid: ProbabilityGrid,
    points: FloatArray,
    start: FloatArray,
    *,
    occupied_space_weight: float = 1.0,
    max_iterations: int = 30,
    solver: Solver = "lm",
) -> MatchResult:
    """Gradient match from the result of a search, or from a guess near enough to need none.

    Parameters
    ----------
    grid : ProbabilityGrid
        The map to match against.
    points : ndarray of float64, shape (n, 2)
        What is looked for, in its own frame, m.
    start : ndarray of float64, shape (3,)
        Where it was found, in the frame of the grid, m and rad.
    occupied_space_weight, max_iterations, solver
        As of `match_scan`.

    Raises
    ------
    GridError
        As by `match_scan`.
    """
    return match_scan(
        grid,
        points,
        start,
        occupied_space_weight=occupied_space_weight,
        translation_weight=_WEAK_WEIGHT,
        rotation_weight=_WEAK_WEIGHT,
        max_iterations=max_iterations,
        solver=solver,
    )
