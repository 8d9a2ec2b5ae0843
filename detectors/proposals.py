"""Thresholds proposed from scans with known panes and scans without, with the rates to expect."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from detectors.calibrated_peak import calibrated_peak
from detectors.calibration import Calibration
from detectors.detection import Detection, FloatArray
from detectors.intensity_peak import intensity_peak
from detectors.pane_lobe import CORE, core, faces, faint_level, fit_pane_lobe, pane_model
from detectors.panes import PaneProfile
from detectors.rates import Rate, wilson

ON_PANE = 0.15
THRESH_FACTORS = (0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
GRAD_FACTORS = (0.05, 0.1, 0.2, 0.4)
WIDTHS_DEG = (1.25, 2.5, 5.0)


@dataclass(frozen=True, slots=True, eq=False)
class CalibrationScan:
    """One scan of a calibration recording.

    Attributes
    ----------
    ranges, intensities : ndarray, shape (n,)
        Metres and unit of the sensor.
    angle_min, angle_increment : float
        Angle of the first beam and step between beams, rad.
    panes : tuple of PaneProfile
        The known panes in it; returns elsewhere are known not to be glass.
    """

    ranges: FloatArray
    intensities: FloatArray
    angle_min: float
    angle_increment: float
    panes: tuple[PaneProfile, ...] = ()


@dataclass(frozen=True, slots=True)
class Expected:
    """What a detector does on the calibration recordings.

    Attributes
    ----------
    detection : Rate
        Panes seen at normal incidence that were found.
    false_alarm : Rate
        Scans with at least one observation off the known panes.
    """

    detection: Rate
    false_alarm: Rate

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers."""
        return {"detection": self.detection.to_dict(), "false_alarm": self.false_alarm.to_dict()}


def propose(calibration: Calibration, scans: Sequence[CalibrationScan]) -> Calibration:
    """Complete a calibration that has its diffuse curve with thresholds and the rates to expect.

    The plain thresholds are those of a grid over height, steepness and width with the best difference of
    detection and false alarms. The normalised ones follow from the lobes of the panes. The rates are counted
    on the same scans, so they are optimistic where these are few: the intervals say by how much.

    Parameters
    ----------
    calibration : Calibration
        Its diffuse curve, limits and no-echo value are used.
    scans : sequence of CalibrationScan
        With and without known panes.

    Returns
    -------
    Calibration
        With `thresh`, `grad`, `width`, `faint`, `weakest_decay`, `pane`, and both rates under `evidence`.

    Raises
    ------
    ValueError
        No pane is seen at normal incidence.
    """
    profiles = [pane for scan in scans for pane in scan.panes if faces(pane)]
    if not profiles:
        raise ValueError("no pane is seen at normal incidence in these scans")
    lobes = np.array([lobe for pane in profiles if (lobe := fit_pane_lobe(pane)) is not None])
    model = pane_model(profiles, lobes)
    normalised = replace(
        calibration,
        pane=model,
        faint=faint_level(profiles),
        weakest_decay=round(float(np.clip(0.33 * model.decay, 1.0, 4.0)), 2),
    )
    peaks = np.array([pane.intensities[core(pane)].max() for pane in profiles])
    thresh, grad, width, plain = _plain_thresholds(normalised, scans, float(np.median(peaks)))
    ours = expected(scans, lambda scan: _calibrated(scan, normalised))
    evidence = {
        **calibration.evidence,
        "panes": len(profiles),
        "lobes": len(lobes),
        "intensity_peak": plain.to_dict(),
        "calibrated_peak": ours.to_dict(),
    }
    return replace(normalised, thresh=thresh, grad=grad, width=width, evidence=evidence)


def expected(scans: Sequence[CalibrationScan], detect: Any) -> Expected:
    """Count what a detector finds on scans whose panes are known.

    Parameters
    ----------
    scans : sequence of CalibrationScan
        With and without panes.
    detect : callable
        Scan -> Detection.
    """
    found = facing = alarmed = 0
    for scan in scans:
        detection = detect(scan)
        on = [_lies_on(detection, pane) for pane in scan.panes]
        for pane, hits in zip(scan.panes, on, strict=True):
            if faces(pane):
                facing += 1
                found += bool((hits & _covers_foot(detection, pane)).any())
        alarmed += bool((~np.any(on, axis=0)).any()) if on else len(detection) > 0
    return Expected(wilson(found, facing), wilson(alarmed, len(scans)))


def _lies_on(detection: Detection, pane: PaneProfile) -> Any:
    behind = detection.range * np.cos(detection.bearing - pane.normal) - pane.distance
    return np.abs(behind) < ON_PANE


def _covers_foot(detection: Detection, pane: PaneProfile) -> Any:
    away = np.abs(pane.distance * np.tan(np.clip(detection.bearing - pane.normal, -1.5, 1.5)))
    return away <= detection.extent + pane.distance * math.tan(2.0 * CORE)


def _calibrated(scan: CalibrationScan, calibration: Calibration) -> Detection:
    return calibrated_peak(
        scan.ranges,
        scan.intensities,
        scan.angle_min,
        scan.angle_increment,
        calibration=calibration,
        range_min=calibration.range_min,
        no_echo=_no_echo(calibration),
    )


def _no_echo(calibration: Calibration) -> float:
    return math.inf if calibration.no_echo is None else calibration.no_echo


def _plain_thresholds(
    calibration: Calibration, scans: Sequence[CalibrationScan], peak: float
) -> tuple[float, float, int, Expected]:
    step = math.degrees(abs(scans[0].angle_increment))
    widths = sorted({max(2, round(width / step)) for width in WIDTHS_DEG})
    best: tuple[tuple[float, ...], float, float, int, Expected] | None = None
    for factor, share, width in itertools.product(THRESH_FACTORS, GRAD_FACTORS, widths):
        thresh, grad = round(factor * peak, 1), round(share * factor * peak, 1)

        def detect(
            scan: CalibrationScan, thresh: float = thresh, grad: float = grad, width: int = width
        ) -> Detection:
            return intensity_peak(
                scan.ranges,
                scan.intensities,
                thresh=thresh,
                grad=grad,
                width=width,
                angle_min=scan.angle_min,
                angle_increment=scan.angle_increment,
                range_min=calibration.range_min,
                no_echo=_no_echo(calibration),
            )

        rates = expected(scans, detect)
        score = (rates.detection.value - rates.false_alarm.value, rates.detection.value, -width, -factor)
        if best is None or score > best[0]:
            best = (score, thresh, grad, width, rates)
    if best is None:
        raise ValueError("there is nothing to choose from")
    return best[1:]
