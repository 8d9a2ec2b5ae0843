"""What was seen in the recordings of a calibration, counted."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from detectors.expectation import CalibrationScan
from detectors.pane_lobe import faces
from detectors.panes import PaneProfile
from glassslam.calibration.reading import Reading
from glassslam.calibration.result import RecordingSummary
from glassslam.calibration.session import Session
from glassslam.calibration.views import View


def summarised(reading: Reading, views: list[View], scans: list[CalibrationScan]) -> RecordingSummary:
    """Count what was seen in one recording.

    Parameters
    ----------
    reading : Reading
        The recording.
    views : list of View
        Its scans and the known surfaces in them.
    scans : list of CalibrationScan
        The same as the proposal of thresholds takes them; may be empty where no pane is known.
    """
    session = reading.session
    distances = [plane.distance for view in views for plane in view.planes]
    if session.has_pane:
        distances = [pane.distance for scan in scans for pane in scan.panes if pane.answered.any()]
    return RecordingSummary(
        session.name,
        session.material,
        session.distance,
        len(views),
        _with_surface(session, views, scans),
        sum(faces(pane) for scan in scans for pane in scan.panes),
        len({view.place for view in views}),
        round(float(np.median(distances)), 3) if distances else None,
    )


def _with_surface(session: Session, views: list[View], scans: list[CalibrationScan]) -> int:
    if session.has_pane:
        return sum(any(pane.answered.any() for pane in scan.panes) for scan in scans)
    return sum(bool(view.planes) for view in views)


def answering_panes(scans: list[list[CalibrationScan]]) -> tuple[PaneProfile, ...]:
    """Every view of a pane that answers somewhere, over all recordings."""
    every = (pane for own in scans for scan in own for pane in scan.panes)
    return tuple(pane for pane in every if pane.answered.any())


def evidence_of(
    summaries: Sequence[RecordingSummary], readings: list[Reading], surface_beams: int
) -> dict[str, Any]:
    """What a calibration rests on, as plain values.

    Parameters
    ----------
    summaries : sequence of RecordingSummary
        Of all recordings.
    readings : list of Reading
        The recordings.
    surface_beams : int
        Returns behind the diffuse curve.
    """
    return {
        "recordings": [summary.recording for summary in summaries],
        "sessions": [summary.to_dict() for summary in summaries],
        "scans": sum(len(reading.scans) for reading in readings),
        "surface_beams": surface_beams,
    }
