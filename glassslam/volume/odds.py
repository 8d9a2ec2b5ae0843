"""How certain a voxel can become, and from where on it counts as occupied."""

import math
from dataclasses import dataclass

import numpy as np

from glassslam.errors import GridError
from glassslam.records import Float32Array, FloatArray


def log_odds(probability: float) -> float:
    """Natural logarithm of p / (1 - p)."""
    return math.log(probability / (1.0 - probability))


def probabilities(values: Float32Array | FloatArray) -> Float32Array:
    """P(occupied) of log odds of any shape; NaN stays NaN."""
    return np.asarray(1.0 / (1.0 + np.exp(-np.asarray(values, dtype=np.float64))), dtype=np.float32)


@dataclass(frozen=True, slots=True)
class Clamp:
    """Bounds of a voxel's log odds (equation 22 of the lidar and 3D ultrasonic fusion), from probabilities.

    A voxel at a bound is stable: eight equal stable ones are merged. The defaults are those of OctoMap
    (Hornung et al. 2013).

    Attributes
    ----------
    lower, upper : float
        Least and largest P(occupied) of a voxel.
    threshold : float
        P(occupied) from which a voxel counts as occupied; below it counts as free.

    Raises
    ------
    GridError
        The bounds are not on both sides of 0.5, or the threshold is not between them.
    """

    lower: float = 0.1192
    upper: float = 0.971
    threshold: float = 0.5

    def __post_init__(self) -> None:
        if not 0.0 < self.lower < 0.5 < self.upper < 1.0:
            raise GridError(
                f"a voxel cannot be clamped to {self.lower:g} .. {self.upper:g}",
                "the bounds must lie on both sides of 0.5, between 0 and 1",
            )
        if not self.lower < self.threshold < self.upper:
            raise GridError(
                f"a threshold of {self.threshold:g} is never crossed",
                f"it must lie between {self.lower:g} and {self.upper:g}",
            )

    @property
    def low(self) -> float:
        """Least log odds, to the precision of a voxel."""
        return float(np.float32(log_odds(self.lower)))

    @property
    def high(self) -> float:
        """Largest log odds, to the precision of a voxel."""
        return float(np.float32(log_odds(self.upper)))

    @property
    def occupied(self) -> float:
        """Log odds from which a voxel counts as occupied."""
        return float(np.float32(log_odds(self.threshold)))
