"""The detector a configuration asks for, as one function of a scan."""

from collections.abc import Callable
from functools import partial
from typing import TypeAlias

from detectors.calibrated_peak import calibrated_peak
from detectors.calibration import Calibration
from detectors.detection import Detection
from detectors.intensity_peak import intensity_peak, wang_wang
from detectors.narrow_return import narrow_return
from glassslam.config import GlassConfig
from glassslam.records import LaserScan

Detector: TypeAlias = Callable[[LaserScan], Detection | None]


def make_detector(config: GlassConfig, calibration: Calibration | None = None) -> Detector | None:
    """Function from a scan to what is found in it; None when glass is not looked for.

    Parameters
    ----------
    config : GlassConfig
        Which detector, and its thresholds.
    calibration : Calibration, optional
        Of the sensor; `calibrated_peak` needs it.
    """
    if config.detector == "off":
        return None
    if config.detector == "narrow_return":
        return _narrow
    if config.detector == "calibrated_peak":
        return None if calibration is None else partial(_calibrated, calibration)
    return partial(_peak, config)


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
