"""Lidars by their figures; `sources` says which were measured, read from documents, or assumed."""

import math
from dataclasses import dataclass
from typing import Final, Literal

from glassslam.errors import UsageError

_DEG: Final = math.pi / 180.0
_WALL: Final = 0.85
"""Reflectance taken for the walls in recordings."""


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
    glint_gain : float
        How bright panes appear to this lidar, relative to white paper, against a UTM-30LX.
    weakest_glint : float
        Smallest signal of a pane that gives an echo, relative to white paper at 1 m.
    glint_noise : float
        Standard deviation added to the range of a pane, m.
    glint_wander : float
        How far the places where a pane answers scatter around normal incidence, rad.
    aperture : float
        Width of the lens that catches the mirrored bundle, m.
    divergence : float
        Half angle by which the beam opens, rad.
    echo : "first" or "strongest"
        Which echo is reported when a pane and something behind it both answer.
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
    glint_gain: float
    weakest_glint: float
    glint_noise: float
    glint_wander: float
    aperture: float
    divergence: float
    echo: Literal["first", "strongest"]
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
    noise_floor=0.004,
    noise_slope=0.0005,
    resolution=0.001,
    weakest_echo=_WALL / 18.0**2,
    intensity_at_1m=1380.0,
    intensity_falloff=0.34,
    intensity_noise=0.03,
    intensity_max=65535.0,
    glint_gain=1.0,
    weakest_glint=0.02,
    glint_noise=0.01,
    glint_wander=0.0,
    aperture=0.005,
    divergence=0.0021,
    echo="first",
    transfer_delay=0.002,
    sources=(
        "geometry, period, limits, delay, steps of 1 mm: headers and stamps of two recorded UST-10LX",
        "noise: the same scanner standing still, 4.4 mm at 1 m, 4.0 mm at 4 m, 6.7 mm at 10 m",
        "weakest echo: farthest walls in the recordings, 18 m (the maker promises 10 m)",
        "intensity: medians over a recording, 1170 at 1 m, 477 at 13 m, 3 % spread, taken for walls of 85 %",
        "panes: as the UTM-30LX, on the diffuse level of this one; the first echo wins as there",
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
    noise_slope=0.0005,
    resolution=0.001,
    weakest_echo=_WALL / 30.0**2,
    intensity_at_1m=5400.0,
    intensity_falloff=0.59,
    intensity_noise=0.03,
    intensity_max=65535.0,
    glint_gain=1.0,
    weakest_glint=0.0185,
    glint_noise=0.012,
    glint_wander=0.0,
    aperture=0.005,
    divergence=0.0021,
    echo="first",
    transfer_delay=0.002,
    sources=(
        "geometry, period: manual of the SCIP 2.0 protocol, steps 0 to 1080 of 1440; recorded headers, 25 ms",
        "noise: assumed a third of the stated accuracy of 30 mm to 10 m and 50 mm to 30 m",
        "weakest echo: farthest returns in a recording of a scanner of this class, 28 m",
        "intensity: level of diffuse walls in that recording, 4600 at 1 m, its medians fall to 790 at 14 m",
        "panes: a recorded corridor at 1 to 2 m; weakest value there 100 of 5400; spike 0.5 deg",
        "first echo: up to 30 deg every beam of that corridor ends on the pane, whatever stands behind it",
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
    noise_floor=0.004,
    noise_slope=0.0002,
    resolution=0.01,
    weakest_echo=_WALL / 48.0**2,
    intensity_at_1m=0.0,
    intensity_falloff=2.0,
    intensity_noise=0.0,
    intensity_max=0.0,
    glint_gain=1.0,
    weakest_glint=0.05,
    glint_noise=0.01,
    glint_wander=0.0,
    aperture=0.03,
    divergence=0.0044,
    echo="first",
    transfer_delay=0.05,
    sources=(
        "geometry, steps of 10 mm, no echo beyond 81 m: recorded CARMEN logs of SICK LMS",
        "period, time between beams: assumed 75 turns a second, of which a serial line carries every eighth",
        "noise: such a scanner standing still, 4 to 5 mm from 2 to 8 m, steps included",
        "weakest echo: farthest returns in the logs, 48 m",
        "panes: assumed as the UTM-30LX with a larger lens and a beam of 0.5 deg; first echo assumed",
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
    range_max=5.0,
    noise_floor=0.0005,
    noise_slope=0.001,
    resolution=0.00025,
    weakest_echo=_WALL / 12.0**2,
    intensity_at_1m=124.0,
    intensity_falloff=0.78,
    intensity_noise=0.12,
    intensity_max=255.0,
    glint_gain=0.18,
    weakest_glint=0.34,
    glint_noise=0.038,
    glint_wander=2.3 * _DEG,
    aperture=0.01,
    divergence=0.5 * _DEG,
    echo="strongest",
    transfer_delay=0.005,
    sources=(
        "geometry, weakest echo: data sheet of the RPLIDAR A1M8, 0.15 to 12 m on white, 360 beams",
        "range limit: a recorded scanner of this class reports nothing beyond 5 m",
        "period: 5.8 turns a second in a recorded scanner of this class (data sheet: 5.5, at most 10)",
        "noise, steps of 0.25 mm: that scanner standing still, 0.6 mm at 1 m, 3.3 mm at 2 m, 1.6 mm at 4 m",
        "intensity: medians of that recording, 105 at 1 m, 34 at 4.3 m; spread assumed",
        "panes: a recorded hallway, 0.4 to 1.4 m, 15 % of scans show 1-3 beams within 6 deg, 3.8 cm spread",
        "strongest echo: a triangulating lidar looks for the brightest spot on its detector",
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
