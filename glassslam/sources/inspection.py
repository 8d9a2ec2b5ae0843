"""A recording looked over: everything a user wants to know before mapping it."""

from collections.abc import Sequence
from pathlib import Path

from glassslam.errors import NoScansError, UsageError
from glassslam.sources.formats import Piece, resolve
from glassslam.sources.recording import open_recording
from glassslam.sources.report import Plan, RecordingReport


def inspect_recording(paths: str | Path | Sequence[str | Path]) -> RecordingReport:
    """Read a recording from end to end and report on it.

    Parameters
    ----------
    paths : path or sequence of paths
        As for `open_recording`.

    Returns
    -------
    RecordingReport
        Topics, times, geometry, ranges, intensities, frames, and what a map would be made from.

    Raises
    ------
    RecordingError
        A file is missing, empty, foreign, truncated or damaged.
    """
    pieces = resolve([paths] if isinstance(paths, str | Path) else list(paths))
    plan, warnings = _plan(pieces)
    if pieces[0].format == "carmen":
        from glassslam.sources.carmeninspection import inspect_carmen  # noqa: PLC0415  (loads kernels)

        return inspect_carmen(pieces, plan, warnings)
    from glassslam.sources.baginspection import BagInspection  # noqa: PLC0415  (loads rosbags)

    return BagInspection(pieces).run(plan, warnings)


def _plan(pieces: Sequence[Piece]) -> tuple[Plan, tuple[str, ...]]:
    """What mapping with default options would use, and the warnings it would give."""
    try:
        recording = open_recording([piece.path for piece in pieces])
    except (UsageError, NoScansError) as error:
        return Plan(problem=error.message, hint=error.hint), ()
    info = recording.info
    plan = Plan(info.scan_topic, info.odom_topic, info.imu_topic, info.base_from_laser)
    return plan, tuple(recording.warnings)
