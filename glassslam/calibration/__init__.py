"""Lidars calibrated from recordings: their answer to glass and to matte walls, the errors of their beams."""

from glassslam.calibration.files import FILES, read_calibration, write_calibration
from glassslam.calibration.result import CalibrationResult, RecordingSummary
from glassslam.calibration.roi import Roi
from glassslam.calibration.session import MATERIALS, Session, make_sessions
from glassslam.calibration.tool import calibrate

__all__ = [
    "FILES",
    "MATERIALS",
    "CalibrationResult",
    "RecordingSummary",
    "Roi",
    "Session",
    "calibrate",
    "make_sessions",
    "read_calibration",
    "write_calibration",
]
