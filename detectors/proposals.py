"""Thresholds proposed from scans with known panes and scans without, with the rates to expect."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from detectors.calibrated_peak import calibrated_peak
from detectors.calibration import Calibration, PaneModel
from detectors.detection import Detection, FloatArray
from detectors.intensity_peak import intensity_peak
from detectors.panes import PaneProfile
from detectors.rates import Rate, wilson

# the mirror peak, and the stretch of the lobe that is fitted, rad
CORE = math.radians(1.5)
LOBE = (math.radians(2.0), math.radians(30.0))
SHOULDER = (math.radians(6.0), math.radians(25.0))
ON_PANE = 0.15
THRESH_FACTORS = (0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
GRAD_FACTORS = (0.05, 0.1, 0.2, 0.4)
WIDTHS_DEG = (1.25, 2.5, 5.0)
FAINT_LIMITS = (0.2, 0.6)
DEFAULT_FAINT = 0.45


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
    detection and false alarms. The normalised ones follow from the lobes of the panes. The rates are counted on
    the same scans, so they are optimistic where these are few: the intervals say how far they may be off.

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
        faint=_faint_level(profiles),
        weakest_decay=round(float(np.clip(0.4 * model.decay, 1.0, 4.0)), 2),
    )
    peaks = np.array([pane.intensities[_core(pane)].max() for pane in profiles])
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


def faces(pane: PaneProfile) -> bool:
    """Whether the pane answers at normal incidence."""
    return bool(_core(pane).any())


def _core(pane: PaneProfile) -> Any:
    return pane.answered & (np.abs(pane.angles) < CORE)


def fit_pane_lobe(pane: PaneProfile) -> tuple[float, float] | None:
    """Fit level = haze * exp(-decay * |angle|) to the answers of one pane.

    Parameters
    ----------
    pane : PaneProfile
        Any number of beams.

    Returns
    -------
    tuple of float or None
        Haze and decay (1/rad); None where fewer than 6 beams answer beside the mirror peak.
    """
    away = np.abs(pane.angles)
    used = pane.answered & (away > LOBE[0]) & (away < LOBE[1]) & (pane.levels > 0.0)
    if np.count_nonzero(used) < 6:
        return None
    x, y = away[used], np.log(pane.levels[used])
    trust = np.ones_like(y)
    slope = intercept = 0.0
    for _ in range(20):
        slope, intercept = np.polyfit(x, y, 1, w=np.sqrt(trust))
        trust = 1.0 / (1.0 + ((y - slope * x - intercept) / 0.25) ** 2)
    return math.exp(intercept), -float(slope)


def pane_model(profiles: Sequence[PaneProfile], lobes: FloatArray) -> PaneModel:
    """Median lobe and mirror peak of some panes; what no pane shows keeps its default."""
    peak = float(np.median([pane.levels[_core(pane)].max() for pane in profiles]))
    if not len(lobes):
        return PaneModel(peak=round(peak, 2))
    haze, decay = np.median(lobes, axis=0)
    return PaneModel(round(float(haze), 3), round(float(decay), 2), round(peak, 2))


def _faint_level(profiles: Sequence[PaneProfile]) -> float:
    """Half way, on the scale of logarithms, between the shoulders of panes and a matte wall."""
    shoulders = [
        pane.levels[pane.answered & (np.abs(pane.angles) > SHOULDER[0]) & (np.abs(pane.angles) < SHOULDER[1])]
        for pane in profiles
    ]
    levels = np.concatenate(shoulders)
    if levels.size == 0:
        return DEFAULT_FAINT
    middle = math.sqrt(max(float(np.percentile(levels, 75)), 1e-3))
    return round(float(np.clip(middle, *FAINT_LIMITS)), 3)


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
        ) -> Any:
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
