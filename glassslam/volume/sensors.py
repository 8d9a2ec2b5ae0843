"""What one measurement says of the voxels on its way: inverse sensor models."""

import math
from dataclasses import dataclass

import numpy as np

from glassslam.errors import GridError
from glassslam.volume.odds import log_odds


@dataclass(frozen=True, slots=True)
class InverseModel:
    """P(occupied) given one measurement, along its beam (section 2.7 of the lidar and 3D ultrasonic fusion).

    Beyond the measurement nothing is said: 0.5.

    Attributes
    ----------
    free : float
        Of the voxels from the sensor to the measurement.
    occupied : float
        Of the voxel of the measurement.
    max_range : float
        A beam says nothing farther away, m; an echo from there is read as free space up to there.
    half_angle : float
        Echoes farther from the axis of the sensor than this angle are not believed, rad.

    Raises
    ------
    GridError
        A probability on the wrong side of 0.5, or a range or angle that is not positive.
    """

    free: float = 0.4
    occupied: float = 0.7
    max_range: float = 20.0
    half_angle: float = math.pi

    def __post_init__(self) -> None:
        if not 0.0 < self.free <= 0.5 <= self.occupied < 1.0:
            raise GridError(
                f"a sensor cannot say {self.free:g} for free and {self.occupied:g} for occupied",
                "free must be above 0 and at most 0.5, occupied at least 0.5 and below 1",
            )
        if not (0.0 < self.max_range < math.inf and 0.0 < self.half_angle <= math.pi):
            raise GridError(
                f"a sensor cannot see {self.max_range:g} m within {self.half_angle:g} rad",
                "the range must be positive and finite, the half angle above 0 and at most pi",
            )

    @property
    def free_log_odds(self) -> np.float32:
        """Change of a voxel the beam went through."""
        return np.float32(log_odds(self.free))

    @property
    def occupied_log_odds(self) -> np.float32:
        """Change of a voxel an echo came from."""
        return np.float32(log_odds(self.occupied))


LIDAR = InverseModel()
"""The SICK LMS100 of the paper: 20 m."""
ULTRASONIC = InverseModel(max_range=4.0, half_angle=math.pi / 2)
"""The Toposens TS Alpha of the paper: 4 m, 90 deg to each side, the figures of the lidar otherwise."""
