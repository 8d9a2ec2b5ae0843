"""The detector a configuration asks for, as one function of a scan."""

from collections.abc import Callable
from functools import partial
from typing import TypeAlias

from detectors.calibrated_peak import calibrated_peak
from detectors.calibration import Calibration
from detectors.detection import Detection
from detectors.intensity_peak import intensity_peak, wang_wang
from detectors.narrow_return import narrow_return
from detectors.profiles import PROFILES, load_profile
from glassslam.config import GlassConfig
from glassslam.errors import ConfigError
from glassslam.records import LaserScan

Detector: TypeAlias = Callable[[LaserScan], Detection | None]


def make_detector(config: GlassConfig) -> Detector | None:
    """Function from a scan to what is found in it; None when glass is not looked for.

    Raises
    ------
    ConfigError
        `calibrated_peak` without a shipped calibration of that name.
    """
    if config.detector == "off":
        return None
    if config.detector == "narrow_return":
        return _narrow
    if config.detector == "calibrated_peak":
        return partial(_calibrated, _calibration(config.sensor))
    return partial(_peak, config)


def _calibration(sensor: str) -> Calibration:
    if sensor not in PROFILES:
        raise ConfigError(
            f"glass.sensor: no calibration named {sensor!r} is shipped", f"known are {', '.join(PROFILES)}"
        )
    return load_profile(sensor)


def _narrow(scan: LaserScan) -> Detection | None:
    return narrow_return(
        scan.ranges,
        None,
        scan.angle_min,
        scan.angle_increment,
        no_echo=scan.range_max,
        range_min=scan.range_min,
    )


def _calibrated(calibration: Calibration, scan: LaserScan) -> Detection | None:
    if len(scan.intensities) == 0:
        return None
    return calibrated_peak(
        scan.ranges, scan.intensities, scan.angle_min, scan.angle_increment,
        calibration=calibration, no_echo=scan.range_max, range_min=scan.range_min,
    )  # fmt: skip


def _peak(config: GlassConfig, scan: LaserScan) -> Detection | None:
    if len(scan.intensities) == 0:
        return None
    find = wang_wang if config.detector == "wang_wang" else intensity_peak
    return find(
        scan.ranges, scan.intensities, thresh=config.thresh, grad=config.grad, width=config.width,
        angle_min=scan.angle_min, angle_increment=scan.angle_increment,
        range_min=scan.range_min, no_echo=scan.range_max,
    )  # fmt: skip
