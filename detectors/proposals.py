"""Thresholds proposed from scans with known panes and scans without, with the rates to expect."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from detectors.calibrated_peak import calibrated_peak
from detectors.calibration import Calibration
from detectors.detection import Detection
from detectors.expectation import CalibrationScan, Expected, expected
from detectors.intensity_peak import intensity_peak
from detectors.narrow_return import narrow_return
from detectors.pane_kernels import HAZE_REACH
from detectors.pane_lobe import core, faces, faint_level, fit_pane_lobe, pane_model

THRESH_FACTORS = (0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
GRAD_FACTORS = (0.05, 0.1, 0.2, 0.4)
WIDTHS_DEG = (1.25, 2.5, 5.0)
# normalised thresholds that served other sensors
FAINTS = (0.45, 0.35)
DECAYS = (2.5, 3.5)
# a pane is seen from many places: when so many single views find it, false alarms alone decide
ENOUGH = 0.8
# thresholds are chosen on so many scans from all over the recordings, and counted on all of them
MOST_SCANS = 250


def propose(calibration: Calibration, scans: Sequence[CalibrationScan]) -> Calibration:
    """Complete a calibration that has its diffuse curve with thresholds and the rates to expect.

    The plain thresholds are those of a grid over height, steepness and width with the best difference of
    detection and false alarms. The normalised ones follow from the lobes of the panes, unless those of other
    sensors tell panes better from the rest. The rates are counted
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
    # the haze of a pane sinks with its distance until only the mirror peak is left
    near = [pane for pane in profiles if pane.distance <= HAZE_REACH] or profiles
    lobes = np.array([lobe for pane in near if (lobe := fit_pane_lobe(pane)) is not None])
    model = pane_model(near, lobes)
    sample = scans[:: math.ceil(len(scans) / MOST_SCANS)]
    decay = round(float(np.clip(0.33 * model.decay, 1.0, 4.0)), 2)
    normalised = _normalised_thresholds(replace(calibration, pane=model), sample, faint_level(near), decay)
    peaks = np.array([pane.intensities[core(pane)].max() for pane in near])
    thresh, grad, width = _plain_thresholds(normalised, sample, float(np.median(peaks)))
    complete = replace(normalised, thresh=thresh, grad=grad, width=width)
    evidence = {
        **calibration.evidence,
        "panes": len(profiles),
        "lobes": len(lobes),
        "intensity_peak": expected(scans, partial(_plain, calibration=complete)).to_dict(),
        **normalised_rates(complete, scans),
    }
    return replace(complete, evidence=evidence)


def normalised_rates(calibration: Calibration, scans: Sequence[CalibrationScan]) -> dict[str, dict[str, Any]]:
    """Rates of the detectors that need no thresholds in the unit of the sensor, by name, as plain numbers.

    Parameters
    ----------
    calibration : Calibration
        Complete.
    scans : sequence of CalibrationScan
        With and without known panes.
    """
    rates = {"calibrated_peak": expected(scans, partial(_calibrated, calibration=calibration))}
    if calibration.detector == "narrow_return":
        rates["narrow_return"] = expected(scans, lambda scan: _narrow(scan, calibration))
    return {name: found.to_dict() for name, found in rates.items()}


def _normalised_thresholds(
    calibration: Calibration, scans: Sequence[CalibrationScan], faint: float, decay: float
) -> Calibration:
    """The pair of normalised thresholds that tells panes from the rest best, of some around a proposal.

    The lobes alone say what panes look like, but not what else looks so. On a tie the proposal stays.
    """
    best, most = calibration, -math.inf
    for level, fall in itertools.product((faint, *FAINTS), (decay, *DECAYS)):
        trial = replace(calibration, faint=level, weakest_decay=fall)
        rates = expected(scans, partial(_calibrated, calibration=trial))
        if (score := _gain(rates, ENOUGH)) > most:
            best, most = trial, score
    return best


def _gain(rates: Expected, enough: float = 1.0) -> float:
    """Detection, as far as more is better, less false alarms where there are trials of these."""
    alarms = rates.false_alarm.value if rates.false_alarm.trials else 0.0
    return min(rates.detection.value, enough) - alarms


def _calibrated(scan: CalibrationScan, calibration: Calibration) -> Detection:
    return calibrated_peak(
        scan.ranges,
        scan.intensities,
        scan.angle_min,
        scan.angle_increment,
        calibration=calibration,
        range_min=calibration.range_min,
        no_echo=calibration.silent_from,
    )


def _narrow(scan: CalibrationScan, calibration: Calibration) -> Detection:
    return narrow_return(
        scan.ranges,
        None,
        scan.angle_min,
        scan.angle_increment,
        range_min=calibration.range_min,
        no_echo=calibration.silent_from,
    )


def _plain(scan: CalibrationScan, calibration: Calibration) -> Detection:
    return intensity_peak(
        scan.ranges,
        scan.intensities,
        thresh=calibration.thresh,
        grad=calibration.grad,
        width=calibration.width,
        angle_min=scan.angle_min,
        angle_increment=scan.angle_increment,
        range_min=calibration.range_min,
        no_echo=calibration.silent_from,
    )


def _plain_thresholds(
    calibration: Calibration, scans: Sequence[CalibrationScan], peak: float
) -> tuple[float, float, int]:
    """Height, steepness and width of `intensity_peak` that tell panes from the rest best."""
    step = math.degrees(abs(scans[0].angle_increment))
    widths = sorted({max(2, round(width / step)) for width in WIDTHS_DEG})
    best, most = (0.0, 0.0, 0), (-math.inf, 0.0, 0, 0.0)
    for factor, share, width in itertools.product(THRESH_FACTORS, GRAD_FACTORS, widths):
        thresh, grad = round(factor * peak, 1), round(share * factor * peak, 1)
        trial = replace(calibration, thresh=thresh, grad=grad, width=width)
        rates = expected(scans, partial(_plain, calibration=trial))
        score = (_gain(rates), rates.detection.value, -width, -factor)
        if score > most:
            best, most = (thresh, grad, width), score
    return best
