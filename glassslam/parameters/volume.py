"""Parameters of 3D maps."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from glassslam.parameters.base import (
    FreeProbability,
    Height,
    NonNegative,
    OccupiedProbability,
    Positive,
    Probability,
    Section,
)


class VolumeConfig(Section):
    """3D maps from the lidar and the points of 3D ultrasonic sensors."""

    resolution: Annotated[float, Field(ge=0.005, le=1.0, allow_inf_nan=False)] = 0.05
    """Edge of a voxel, at most 1 m."""
    lidar_height: Height | None = None
    """Height of the plane of the lidar above the base, m; without one that of the recording, or else 0.2."""
    band_low: Height = 0.1
    """Lowest height that goes into the 2D map and the pictures, m above the base."""
    band_high: Height = 1.8
    """Highest of them, m above the base."""
    projection: Literal["max", "pool"] = "max"
    """What becomes of a column of voxels: its most occupied one decides, or all that are known."""
    pool: Literal["bayes", "iop", "lop", "liop"] = "bayes"
    """How the measurements of the two sensors at one time are joined."""
    lidar_weight: NonNegative = 1.0
    """Weight of the lidar in `lop` and `liop`."""
    ultrasonic_weight: NonNegative = 1.0
    """Weight of the ultrasonic sensor in `lop` and `liop`."""
    max_pairing_time: NonNegative = 0.05
    """Largest difference of the stamps of two measurements at one time, s."""
    lidar_free: FreeProbability = 0.4
    """P(occupied) of a voxel before the return of a beam."""
    lidar_occupied: OccupiedProbability = 0.7
    """P(occupied) of the voxel of that return."""
    lidar_max_range: Positive = 20.0
    """The lidar says nothing farther away, m."""
    ultrasonic_free: FreeProbability = 0.4
    """P(occupied) of a voxel before an echo."""
    ultrasonic_occupied: OccupiedProbability = 0.7
    """P(occupied) of the voxel of that echo."""
    ultrasonic_max_range: Positive = 4.0
    """The ultrasonic sensor says nothing farther away, m."""
    ultrasonic_half_angle_deg: Annotated[float, Field(gt=0, le=180)] = 90.0
    """Echoes farther from the axis of the sensor are not believed, deg."""
    min_probability: Annotated[float, Field(gt=0, lt=0.5)] = 0.1192
    """Least P(occupied) of a voxel."""
    max_probability: Annotated[float, Field(gt=0.5, lt=1)] = 0.971
    """Largest P(occupied) of a voxel."""
    occupied_threshold: Probability = 0.5
    """P(occupied) from which a voxel counts as occupied; below it is free."""

    @model_validator(mode="after")
    def _orders(self) -> Self:
        """Refuse bounds in the wrong order, and weights that are all zero."""
        if not self.band_low < self.band_high:
            low, high = self.band_low, self.band_high
            raise ValueError(f"no height lies between band_low {low:g} and band_high {high:g} m")
        if not self.min_probability < self.occupied_threshold < self.max_probability:
            raise ValueError("occupied_threshold does not lie between min_probability and max_probability")
        if self.lidar_weight == self.ultrasonic_weight == 0.0:
            raise ValueError("lidar_weight and ultrasonic_weight are both 0")
        return self
