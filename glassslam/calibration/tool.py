"""The calibration: recordings in, a calibration with its evidence out."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from detectors.calibration import Calibration
from detectors.diffuse import DiffuseCurve
from detectors.expectation import CalibrationScan
from detectors.pane_lobe import faces
from detectors.proposals import normalised_rates, propose
from detectors.self_calibration import suggest_detector
from glassslam.api import ProgressCallback
from glassslam.calibration.advice import advice
from glassslam.calibration.counts import answering_panes, evidence_of, summarised
from glassslam.calibration.geometry import find_beam_errors, geometry_advice
from glassslam.calibration.mapped import mapped_views
from glassslam.calibration.reading import SAME_STEP, Reading, check_alike, check_informative, day_of, read
from glassslam.calibration.result import CalibrationResult
from glassslam.calibration.session import Session
from glassslam.calibration.surfaces import final_curve, first_curve, joined
from glassslam.calibration.views import View, faced_views, nearest_surface, plain_views, region, tolerance
from glassslam.errors import CalibrationError, UsageError
from glassslam.outputs.calibration_file import recording_name
from glassslam.sources import SourceOptions

Seen = list[tuple[Reading, list[View]]]

# an 8-bit lidar is saturated where its highest value comes again and again
_SATURATED_SHARE = 1e-3
_SATURATED_BEAMS = 20
# stands where intensities say nothing
_NO_CURVE = DiffuseCurve((1.0,), (1.0,))


def calibrate(
    sessions: Sequence[Session],
    *,
    name: str = "",
    options: SourceOptions | None = None,
    align: bool = False,
    geometry: bool = False,
    progress: ProgressCallback | None = None,
) -> CalibrationResult:
    """Calibrate a lidar for glass.

    The procedure of Weerakoon et al. (Cartographer_glass, section on calibration: the robot faces a pane from
    1 m and 2 m), extended to panes stated in a map, matte walls, and recordings without glass.

    Parameters
    ----------
    sessions : sequence of Session
        Recordings of one lidar and what is known of them.
    name : str
        Of the sensor; that of the first recording when empty.
    options : SourceOptions, optional
        Topics and the part of every recording to use.
    align : bool
        Move maps rigidly to where the glass found in them agrees best with the stated panes.
    geometry : bool
        Whether the errors of the beams are estimated as well. Recordings of which nothing is known then need
        no intensities.
    progress : callable, optional
        Told of the mapping that stated panes need.

    Returns
    -------
    CalibrationResult
        Where no pane is seen at normal incidence, without thresholds of its own.

    Raises
    ------
    RecordingError
        A recording cannot be read.
    CalibrationError
        Intensities tell nothing, recordings are of different lidars, a stated surface is not there, or too
        few walls are seen for the geometry.
    """
    if not sessions:
        raise UsageError("no recording to calibrate with")
    readings = [read(session, options) for session in sessions]
    check_alike(readings)
    silent = not any(reading.has_levels or reading.session.material != "unknown" for reading in readings)
    if not (geometry and silent):
        check_informative(readings)
    errors = find_beam_errors(sessions, options) if geometry else None
    name = name or recording_name(readings[0].session.recording)
    if silent:
        return _geometry_alone(
            _sensor(name, readings, Calibration("", _NO_CURVE, beam_errors=errors)), readings
        )
    curve, samples = first_curve(readings)
    start = _sensor(name, readings, Calibration("", curve, beam_errors=errors))
    seen = [(reading, _views(reading, start, options, align, progress)) for reading in readings]
    curve, samples = final_curve(seen, curve, samples)
    scans = _scans(seen, curve)
    summaries = tuple(
        summarised(reading, views, own) for (reading, views), own in zip(seen, scans, strict=True)
    )
    sensor = replace(
        start,
        diffuse=curve,
        evidence=evidence_of(summaries, readings, int(samples.ranges.size)),
    )
    result, proven = _complete(sensor, [scan for own in scans for scan in own])
    panes = answering_panes(scans)
    return CalibrationResult(
        result, summaries, advice(result, readings, summaries, panes), panes, samples, proven
    )


def _geometry_alone(sensor: Calibration, readings: list[Reading]) -> CalibrationResult:
    """The calibration of a lidar without intensities: its beams, and that glass cannot be looked for."""
    seen = [plain_views(reading) for reading in readings]
    summaries = tuple(summarised(reading, views, []) for reading, views in zip(readings, seen, strict=True))
    warnings = [
        *(f"{one.session.name}: {one.verdict.reason}; glass cannot be told by them" for one in readings),
        *geometry_advice(sensor.beam_errors),
    ]
    made = replace(sensor, evidence=evidence_of(summaries, readings, 0))
    return CalibrationResult(made, summaries, tuple(warnings), (), joined([]), proven=False)


def _sensor(name: str, readings: list[Reading], blank: Calibration) -> Calibration:
    """What the recordings say of the sensor itself."""
    scans = [scan for reading in readings for scan in reading.scans]
    beams = [len(scan.ranges) for scan in scans]
    steps = np.array([abs(scan.angle_increment) for scan in scans])
    echoes = np.concatenate([scan.intensities.astype(np.float64) for scan in scans])
    echoes = echoes[np.isfinite(echoes) & (echoes > 0.0)]
    informative = all(reading.verdict.informative for reading in readings)
    silent = [value for reading in readings if (value := reading.no_echo) is not None]
    step = float(np.median(steps))
    verdict = min((reading.verdict for reading in readings), key=lambda verdict: verdict.informative)
    return replace(
        blank,
        sensor=name,
        beams=max(beams) if max(beams) <= 1.02 * min(beams) else 0,
        angle_increment=step if np.ptp(steps) <= SAME_STEP * step else 0.0,
        range_min=max(float(scan.range_min) for scan in scans),
        range_max=min(float(scan.range_max) for scan in scans),
        no_echo=min(silent, default=None),
        floor=float(echoes.min()) if echoes.size else 0.0,
        saturation=_saturation(echoes),
        informative=informative,
        detector=suggest_detector(verdict, step),
        date=day_of(readings),
    )


def _saturation(echoes: Any) -> float:
    """The highest intensity where it is a limit, infinity where it is just the brightest return."""
    if not echoes.size:
        return math.inf
    highest = float(echoes.max())
    count = int(np.count_nonzero(echoes == highest))
    limited = count >= max(_SATURATED_BEAMS, _SATURATED_SHARE * echoes.size)
    return highest if limited else math.inf


def _views(
    reading: Reading,
    start: Calibration,
    options: SourceOptions | None,
    align: bool,
    progress: ProgressCallback | None,
) -> list[View]:
    if reading.session.panes is not None:
        return mapped_views(reading, start, options=options, align=align, progress=progress)
    if reading.session.distance is None:
        return plain_views(reading)
    views = faced_views(reading, start.diffuse)
    if not any(view.planes for view in views):
        raise CalibrationError(*_not_there(reading))
    return views


def _not_there(reading: Reading) -> tuple[str, str]:
    session, distance = reading.session, float(reading.session.distance or 0.0)
    what = "matte wall" if session.material == "matte" else f"pane of {session.material}"
    nearest = nearest_surface(reading)
    found = (
        "nothing answers there"
        if math.isnan(nearest)
        else f"the nearest return there is {nearest:.2f} m away"
    )
    where = f"at {distance:g} m (within {tolerance(distance):.2f} m) {region(reading)}"
    return (
        f"{session.name}: no {what} {where}; {found}",
        "state the distance from the laser with --distance, and where to look with --roi",
    )


def _scans(seen: Seen, curve: Any) -> list[list[CalibrationScan]]:
    """The scans of every session as the proposal of thresholds takes them."""
    return [
        [
            CalibrationScan(
                view.scan.ranges.astype(np.float64),
                view.scan.intensities.astype(np.float64),
                view.scan.angle_min,
                view.scan.angle_increment,
                tuple(view.profiles(curve)) if reading.session.has_pane else (),
                view.judged,
                (number, view.place),
            )
            for view in views
        ]
        for number, (reading, views) in enumerate(seen)
    ]


def _complete(sensor: Calibration, scans: list[CalibrationScan]) -> tuple[Calibration, bool]:
    """Thresholds where panes are seen at normal incidence, else what false alarms can be counted."""
    if any(faces(pane) for scan in scans for pane in scan.panes):
        return propose(sensor, scans), True
    rates: dict[str, Any] = {}
    if any(scan.is_judged for scan in scans):
        rates = normalised_rates(sensor, scans)
    note = "no pane was seen at normal incidence: faint, weakest_decay and pane are those of another sensor"
    return replace(sensor, evidence={**sensor.evidence, **rates, "notes": [note]}), False
