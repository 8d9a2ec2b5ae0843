"""What a user should know of a calibration, one line each."""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from detectors.calibration import Calibration
from detectors.pane_lobe import SHOULDER, core, faces
from detectors.panes import PaneProfile
from glassslam.calibration.geometry import geometry_advice
from glassslam.calibration.reading import Reading
from glassslam.calibration.result import RecordingSummary

# a detection rate is called uncertain while it may be lower than this
SURE = 0.8
# shoulders as bright as this are those of a matte surface, in units of the diffuse level
MATTE = 0.75
# the mirror peak of a pane is brighter than a matte wall by more than this
LEAST_PEAK = 1.3
RARELY = 0.5
# matte walls spread by a few percent about the curve of their lidar
UNEVEN = 0.1


def advice(
    calibration: Calibration,
    readings: Sequence[Reading],
    summaries: Sequence[RecordingSummary],
    panes: Sequence[PaneProfile],
) -> tuple[str, ...]:
    """Warnings about a calibration: intensities, recordings, panes, sureness of the rates, beams.

    Parameters
    ----------
    calibration : Calibration
        Complete.
    readings : sequence of Reading
        The recordings.
    summaries : sequence of RecordingSummary
        What was seen in them.
    panes : sequence of PaneProfile
        All views of panes.
    """
    return (
        *_about_intensities(calibration, readings, panes),
        *_about_recordings(summaries),
        *_about_panes(panes),
        *_about_rates(calibration, any(summary.at_normal for summary in summaries)),
        *geometry_advice(calibration.beam_errors),
    )


def _about_intensities(
    calibration: Calibration, readings: Sequence[Reading], panes: Sequence[PaneProfile]
) -> Iterator[str]:
    for reading in readings:
        if not reading.verdict.informative:
            yield f"{reading.session.name}: {reading.verdict.reason}; glass cannot be told by them"
    if math.isfinite(calibration.saturation):
        peaks = [float(pane.intensities[core(pane)].max()) for pane in panes if faces(pane)]
        cut = sum(peak >= calibration.saturation for peak in peaks)
        told = f": {cut} of {len(peaks)} mirror peaks are cut off there" if peaks else ""
        yield f"intensities saturate at {calibration.saturation:g}{told}"
    if calibration.diffuse.spread > UNEVEN:
        yield (
            f"flat surfaces spread by {calibration.diffuse.spread:.0%} about the diffuse curve: "
            "add recordings of a matte wall (--material matte) or of plain rooms"
        )
    if calibration.detector == "narrow_return":
        yield "beams are too far apart for the lobe of a pane: narrow returns are looked for instead"
    if not calibration.beams or not calibration.angle_increment:
        yield "beams vary from scan to scan: map cannot check that a recording is of this sensor"


def _about_recordings(summaries: Sequence[RecordingSummary]) -> Iterator[str]:
    for summary in summaries:
        if summary.distance is not None and summary.with_surface < RARELY * summary.scans:
            share = f"{summary.with_surface} of {summary.scans} scans"
            yield f"{summary.recording}: the surface at {summary.distance:g} m is seen in {share} only"
    unseen = [
        summary.recording
        for summary in summaries
        if summary.at_normal == 0 and summary.material in ("glass", "acrylic", "polycarbonate")
    ]
    for name in unseen:
        yield f"{name}: no pane answers at normal incidence; the robot must face it squarely once"


def _about_panes(panes: Sequence[PaneProfile]) -> Iterator[str]:
    shoulders = [
        pane.levels[pane.answered & (np.abs(pane.angles) > SHOULDER[0]) & (np.abs(pane.angles) < SHOULDER[1])]
        for pane in panes
        if faces(pane)
    ]
    levels = np.concatenate([np.empty(0), *shoulders])
    if levels.size and float(np.median(levels)) > MATTE:
        yield (
            f"what was stated as panes is {np.median(levels):.2f} times as bright as a matte wall beside its "
            "normal: is it glass?"
        )
    peaks = [float(pane.levels[core(pane)].max()) for pane in panes if faces(pane)]
    if peaks and float(np.median(peaks)) < LEAST_PEAK:
        yield (
            f"what was stated as panes has no mirror peak ({np.median(peaks):.2f} times a matte wall): "
            "is it glass, and is it faced squarely?"
        )


def _about_rates(calibration: Calibration, proven: bool) -> Iterator[str]:
    if not proven:
        yield "no pane was seen: the thresholds are those of other sensors, unproven on this one"
    rates = calibration.evidence.get(calibration.detector)
    if rates is None:
        if calibration.detector != "off":
            yield "no place is known to be without glass: add a recording with --material no-glass"
        return
    detection, alarm = rates["detection"], rates["false_alarm"]
    if detection["trials"] and detection["low"] < SURE:
        views = detection["independent"]
        yield (
            f"panes were tried from {views} place{'s' * (views != 1)}: of all panes seen squarely as few as "
            f"{detection['low']:.0%} may be found"
        )
    if not alarm["trials"]:
        yield "false alarms are not predicted: add a recording with --material no-glass"
    elif alarm["high"] > 1.0 - SURE:
        places = alarm["independent"]
        yield (
            f"false alarms were counted at {places} place{'s' * (places != 1)}: in as many as "
            f"{alarm['high']:.0%} of scans there may be one; add recordings with --material no-glass"
        )
