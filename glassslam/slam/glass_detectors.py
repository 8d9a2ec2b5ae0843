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
        `calibrated_peak` without a shipped calibration of that name; by the detector, a first scan that
        does not fit the calibration of the configuration.
    """
    if config.detector == "off":
        return None
    find = _finder(config)
    if config.calibration is None:
        return find
    return _Checked(Calibration.from_dict(config.calibration), find)


def _finder(config: GlassConfig) -> Detector:
    if config.detector == "narrow_return":
        return _narrow
    if config.detector == "calibrated_peak":
        return calibrated(_calibration(config))
    return partial(_peak, config)


class _Checked:
    """A detector that makes sure that the first scan is of the sensor that was calibrated."""

    def __init__(self, calibration: Calibration, find: Detector) -> None:
        self._calibration, self._find = calibration, find
        self._is_checked = False

    def __call__(self, scan: LaserScan) -> Detection | None:
        if not self._is_checked:
            if reason := self._calibration.mismatch(len(scan.ranges), scan.angle_increment):
                raise ConfigError(
                    f"glass.calibration: {reason}", "calibrate this sensor, or map without the calibration"
                )
            self._is_checked = True
        return self._find(scan)


def calibrated(calibration: Calibration) -> Detector:
    """`calibrated_peak` with a calibration, as a function of a scan."""
    return partial(_calibrated, calibration)


def _calibration(config: GlassConfig) -> Calibration:
    if config.calibration is not None:
        return Calibration.from_dict(config.calibration)
    if config.sensor not in PROFILES:
        raise ConfigError(
            f"glass.sensor: no calibration named {config.sensor!r} is shipped",
            f"known are {', '.join(PROFILES)}",
        )
    return load_profile(config.sensor)


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
