"""The errors of the beams as a part of a calibration: from all recordings of a lidar, or refused."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from detectors.beam_errors import LARGEST, SIGNIFICANT, BeamErrors
from glassslam.calibration.bearing import estimate_beam_errors
from glassslam.calibration.session import Session
from glassslam.errors import CalibrationError
from glassslam.records import LaserScan
from glassslam.slam.scan_check import defect, mended
from glassslam.sources import SourceOptions, open_recording

LEAST_WALLS = 100
"""With fewer walls nothing is estimated; the same wall seen from two places counts twice."""
ENOUGH_WALLS = 300
# lidars without known errors came out with up to this share of their bend taken away
_LEAST_GAIN = 0.05


def find_beam_errors(sessions: Sequence[Session], options: SourceOptions | None = None) -> BeamErrors:
    """Estimate the errors of the beams from every scan of some recordings of one lidar.

    Parameters
    ----------
    sessions : sequence of Session
        Whatever they are of: walls are all that is needed.
    options : SourceOptions, optional
        Topics and the part of every recording to use.

    Raises
    ------
    RecordingError
        A recording cannot be read.
    CalibrationError
        Too few straight walls are seen, or they tell errors that no lidar has.
    """
    errors = estimate_beam_errors(_scans(sessions, options))
    walls = errors.walls if errors else 0
    if errors is None or walls < LEAST_WALLS:
        raise CalibrationError(
            f"the errors of the beams cannot be told: {walls} straight walls seen, {LEAST_WALLS} are needed",
            "record while driving through rooms or a corridor, or leave out --geometry",
        )
    if max(map(abs, errors.settings.values())) > LARGEST:
        raise CalibrationError(
            f"the errors of the beams cannot be told: more than {LARGEST:g} rad or m come out",
            "record straight walls on all sides, or leave out --geometry",
        )
    return _rounded(errors)


def _rounded(errors: BeamErrors) -> BeamErrors:
    """To the micrometre and the microradian: a file of it is read by people."""

    def to(value: float) -> float:
        return round(value, 6)

    cosine, sine, lateral, offset = errors.settings.values()
    deviations = errors.sigma
    return BeamErrors(
        to(cosine), to(sine), to(lateral), to(offset),
        sigma=(to(deviations[0]), to(deviations[1]), to(deviations[2]), to(deviations[3])),
        walls=errors.walls,
        bend_before=to(errors.bend_before),
        bend_after=to(errors.bend_after),
    )  # fmt: skip


def _scans(sessions: Sequence[Session], options: SourceOptions | None) -> Iterator[LaserScan]:
    # Half a recording may hold half a turn: what is damaged calibrates nothing.
    whole = replace(options or SourceOptions(), strict=True)
    for session in sessions:
        for record in open_recording(session.recording, whole).records():
            if isinstance(record, LaserScan) and not defect(record):
                yield mended(record)


def geometry_advice(errors: BeamErrors | None) -> Iterator[str]:
    """Warnings about the errors of the beams: few walls, nothing significant, walls hardly straighter.

    Parameters
    ----------
    errors : BeamErrors or None
        As estimated; None where they were not asked for.
    """
    if errors is None:
        return
    if errors.walls < ENOUGH_WALLS:
        yield f"errors of the beams: {errors.walls} walls only; from {ENOUGH_WALLS} on they are sure"
    if not errors.significant:
        yield (
            f"errors of the beams: none reaches {SIGNIFICANT:g} standard deviations; "
            "calibrate without --geometry"
        )
    gain = 1.0 - errors.bend_after / max(errors.bend_before, 1e-12)
    if errors.significant and gain < _LEAST_GAIN:
        yield (
            f"errors of the beams: they take {max(gain, 0.0):.1%} of the bend away, which door frames and "
            "turning do as well: unless maps bend, calibrate without --geometry"
        )
