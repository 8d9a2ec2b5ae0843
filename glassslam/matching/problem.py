"""One scan to be matched: what every solver needs."""

from dataclasses import dataclass
from typing import Any

from glassslam.grid.probability_grid import ProbabilityGrid
from glassslam.records import FloatArray


@dataclass(frozen=True, slots=True)
class MatchProblem:
    """Least squares: weight * sum_k (1 - M(T h_k))^2 + sum_a prior[a] * (T_a - prediction_a)^2.

    Attributes
    ----------
    grid : ProbabilityGrid
        The map M.
    points : ndarray of float64, shape (n, 2)
        Returns h in the frame of the scan, m.
    prediction : ndarray of float64, shape (3,)
        Expected pose in the frame of the grid, m and rad; where the search starts.
    prior : ndarray of float64, shape (3,)
        Weights of the squared distance from it, 1/m^2 and 1/rad^2.
    weight : float
        Weight of a squared residual.
    """

    grid: ProbabilityGrid
    points: FloatArray
    prediction: FloatArray
    prior: FloatArray
    weight: float

    @property
    def arguments(self) -> tuple[Any, ...]:
        """What the kernels take first."""
        return (
            self.grid.cells, self.grid.table, self.grid.origin, 1.0 / self.grid.resolution, self.points,
            self.prediction, self.prior, self.weight,
        )  # fmt: skip
