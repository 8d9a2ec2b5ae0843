"""Lidars by their figures, each with the place it was taken from."""

import math
from dataclasses import dataclass
from typing import Final

from glassslam.errors import UsageError

_DEG: Final = math.pi / 180.0


@dataclass(frozen=True, slots=True)
class LidarModel:
    """Everything the simulation knows of a planar lidar.

    Attributes
    ----------
    name : str
        Name on the command line.
    beams : int
        Beams per scan.
    angle_min, angle_increment : float
        Direction of the first beam and step between beams in the laser frame, rad.
    scan_period : float
        Time between the first beams of two published scans, s.
    time_increment : float
        Time between two beams of a scan, s.
    range_min, range_max : float
        Limits written in every scan, m.
    noise_floor, noise_slope : float
        Standard deviation of a range r is sqrt(noise_floor^2 + (noise_slope r)^2), m.
    resolution : float
        Step of the ranges, m.
    weakest_echo : float
        Smallest reflectance * cos(incidence) / r^2 that still gives an echo, 1/m^2.
    intensity_at_1m : float
        Intensity of a white surface at 1 m, square on; 0: the lidar reports none.
    intensity_falloff : float
        Exponent p of the fall r^-p of the reported intensity.
    intensity_noise : float
        Relative standard deviation of an intensity.
    intensity_max : float
        Largest value the lidar can report.
    transfer_delay : float
        Time from the last beam to the recorded message, s.
    sources : tuple of str
        Where each group of figures comes from.
    """

    name: str
    beams: int
    angle_min: float
    angle_increment: float
    scan_period: float
    time_increment: float
    range_min: float
    range_max: float
    noise_floor: float
    noise_slope: float
    resolution: float
    weakest_echo: float
    intensity_at_1m: float
    intensity_falloff: float
    intensity_noise: float
    intensity_max: float
    transfer_delay: float
    sources: tuple[str, ...]

    @property
    def sweep(self) -> float:
        """Time from the first to the last beam of a scan, s."""
        return (self.beams - 1) * self.time_increment


_UST10LX = LidarModel(
    name="ust10lx",
    beams=1081,
    angle_min=-135 * _DEG,
    angle_increment=0.25 * _DEG,
    scan_period=0.025,
    time_increment=0.025 / 1440,
    range_min=0.02,
    range_max=30.0,
    noise_floor=0.010,
    noise_slope=0.001,
    resolution=0.001,
    weakest_echo=0.1 / 4.0**2,
    intensity_at_1m=1380.0,
    intensity_falloff=0.34,
    intensity_noise=0.03,
    intensity_max=65535.0,
    transfer_delay=0.002,
    sources=(
        "geometry, period, limits, delay: headers and stamps of a recorded UST-10LX",
        "noise: data sheet, repeated accuracy below 30 mm at 3 sigma",
        "weakest echo: data sheet, 4 m on a target of 10 % reflectance",
        "intensity: medians of a recorded UST-10LX, 1170 at 1 m on a wall of 85 %, 477 at 13 m",
    ),
)

_UTM30LX = LidarModel(
    name="utm30lx",
    beams=1081,
    angle_min=-135 * _DEG,
    angle_increment=0.25 * _DEG,
    scan_period=0.025,
    time_increment=0.025 / 1440,
    range_min=0.1,
    range_max=60.0,
    noise_floor=0.009,
    noise_slope=0.0008,
    resolution=0.001,
    weakest_echo=0.9 / 30.0**2,
    intensity_at_1m=5400.0,
    intensity_falloff=0.59,
    intensity_noise=0.03,
    intensity_max=65535.0,
    transfer_delay=0.002,
    sources=(
        "geometry, period: data sheet, steps 0 to 1080 of 1440 in 25 ms",
        "noise: data sheet, repeated accuracy 10 mm to 10 m and 30 mm to 30 m",
        "weakest echo: data sheet, 30 m on white paper of 90 %",
        "intensity: medians of a recorded scanner of this class, 3930 at 1 m, 790 at 14 m",
    ),
)

_LMS200 = LidarModel(
    name="lms200",
    beams=181,
    angle_min=-90 * _DEG,
    angle_increment=1.0 * _DEG,
    scan_period=8 / 75,
    time_increment=1 / 75 / 360,
    range_min=0.05,
    range_max=81.0,
    noise_floor=0.005,
    noise_slope=0.0003,
    resolution=0.01,
    weakest_echo=0.1 / 10.0**2,
    intensity_at_1m=0.0,
    intensity_falloff=2.0,
    intensity_noise=0.0,
    intensity_max=0.0,
    transfer_delay=0.05,
    sources=(
        "geometry: data sheet, 180 deg by 1 deg, 75 turns a second",
        "period: a serial line of 38,400 baud carries every eighth turn",
        "noise, resolution: data sheet, 5 mm at 1 sigma to 8 m, 10 mm steps in the 80 m range",
        "weakest echo: data sheet, 10 m on a target of 10 % reflectance",
    ),
)

_RPLIDAR = LidarModel(
    name="rplidar",
    beams=360,
    angle_min=-180 * _DEG,
    angle_increment=1.0 * _DEG,
    scan_period=1 / 5.8,
    time_increment=1 / 5.8 / 360,
    range_min=0.15,
    range_max=12.0,
    noise_floor=0.003,
    noise_slope=0.005,
    resolution=0.00025,
    weakest_echo=0.85 / 12.0**2,
    intensity_at_1m=124.0,
    intensity_falloff=0.78,
    intensity_noise=0.12,
    intensity_max=255.0,
    transfer_delay=0.005,
    sources=(
        "geometry, limits: data sheet of the RPLIDAR A1M8, 0.15 to 12 m on white, 360 samples a turn",
        "period: 5.8 turns a second in a recorded scanner of this class (data sheet: 5.5, at most 10)",
        "noise: data sheet, below 0.5 mm near and 1 % of the range far; resolution: quarter millimetres",
        "intensity: medians of a recorded scanner of this class, 105 at 1 m, 34 at 4.3 m",
    ),
)

LIDARS: Final = {model.name: model for model in (_UST10LX, _UTM30LX, _LMS200, _RPLIDAR)}
"""The lidars that can be simulated, by name."""


def lidar(name: str) -> LidarModel:
    """The lidar of that name.

    Raises
    ------
    UsageError
        There is none.
    """
    if name not in LIDARS:
        raise UsageError(f"no lidar {name!r}", f"known: {', '.join(LIDARS)}")
    return LIDARS[name]
