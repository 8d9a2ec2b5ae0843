"""How a volume is made: sensors, voxels and fusion in one."""

import math
from dataclasses import dataclass, field

import numpy as np

from glassslam.config import SensorConfig, VolumeConfig
from glassslam.errors import GridError
from glassslam.volume.odds import Clamp
from glassslam.volume.pooling import Pool, check_pool
from glassslam.volume.sensors import LIDAR, ULTRASONIC, InverseModel

USUAL_HEIGHT = 0.2
"""Height of a lidar of which nobody says how high it is, m above the base."""


@dataclass(frozen=True, slots=True)
class VolumeOptions:
    """How a volume is made.

    Attributes
    ----------
    resolution : float
        Edge of a voxel, m.
    clamp : Clamp
        Bounds of the voxels.
    lidar, ultrasonic : InverseModel
        What the measurements of each say.
    lidar_height : float
        Height of the plane of the lidar above the base, m.
    slop : float
        Largest difference of the stamps of a pair, s.
    pool : {"bayes", "iop", "lop", "liop"}
        How the two measurements of a pair are joined.
    weights : tuple of float
        Trust in lidar and ultrasonic sensor, for `lop` and `liop`.
    ranges : SensorConfig
        Which ranges of the lidar are believed, and how far silent beams clear.
    separate : bool
        Whether each sensor is mapped alone as well.

    Raises
    ------
    GridError
        A value makes no sense.
    """

    resolution: float = 0.05
    clamp: Clamp = field(default_factory=Clamp)
    lidar: InverseModel = LIDAR
    ultrasonic: InverseModel = ULTRASONIC
    lidar_height: float = USUAL_HEIGHT
    slop: float = 0.05
    pool: Pool = "bayes"
    weights: tuple[float, float] = (1.0, 1.0)
    ranges: SensorConfig = field(default_factory=SensorConfig)
    separate: bool = True

    def __post_init__(self) -> None:
        check_pool(self.pool, self.weights)
        if not (np.isfinite(self.slop) and self.slop >= 0.0):
            raise GridError(f"messages cannot differ by {self.slop} s", "the slop must be a time from 0 s")
        if not np.isfinite(self.lidar_height):
            raise GridError(f"a lidar cannot be {self.lidar_height} m high")


def volume_options(
    config: VolumeConfig, ranges: SensorConfig | None = None, laser_height: float | None = None
) -> VolumeOptions:
    """What the configuration says of a volume in which the sensors are joined.

    Parameters
    ----------
    config : VolumeConfig
        Voxels, sensors and fusion.
    ranges : SensorConfig, optional
        Which ranges of the lidar are believed.
    laser_height : float, optional
        Height of the lidar above the base as the recording tells it, m; the configuration goes before it.
    """
    known = USUAL_HEIGHT if laser_height is None else laser_height
    return VolumeOptions(
        resolution=config.resolution,
        clamp=Clamp(config.min_probability, config.max_probability, config.occupied_threshold),
        lidar=InverseModel(config.lidar_free, config.lidar_occupied, config.lidar_max_range),
        ultrasonic=InverseModel(
            config.ultrasonic_free,
            config.ultrasonic_occupied,
            config.ultrasonic_max_range,
            math.radians(config.ultrasonic_half_angle_deg),
        ),
        lidar_height=known if config.lidar_height is None else config.lidar_height,
        slop=config.max_pairing_time,
        pool=config.pool,
        weights=(config.lidar_weight, config.ultrasonic_weight),
        ranges=ranges or SensorConfig(),
        separate=False,
    )
