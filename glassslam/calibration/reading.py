"""The scans of a recording that a calibration looks at."""

import math
from dataclasses import dataclass, replace

import numpy as np

from detectors.beams import FULL_TURN, closes
from detectors.detection import IntArray
from detectors.informative import Verdict, is_intensity_informative
from detectors.places import places
from glassslam.calibration.session import Session
from glassslam.errors import CalibrationError, NoScansError
from glassslam.outputs.calibration_file import recording_day
from glassslam.records import Float32Array, FloatArray, LaserScan, RecordingInfo
from glassslam.slam.scan_check import defect, mended
from glassslam.sources import SourceOptions, open_recording

MOST_SCANS = 150
# a step between beams that varies by more than this share is no property of the sensor
SAME_STEP = 0.02


@dataclass(frozen=True, slots=True, eq=False)
class Reading:
    """Scans of a recording, spread evenly over it.

    Attributes
    ----------
    session : Session
        The recording and what is known of it.
    info : RecordingInfo
        As the source tells it.
    scans : tuple of LaserScan
        At most 2 * 150 scans with intensities; any scans where none has.
    numbers : ndarray of int64, shape (n,)
        Which of the usable scans of the recording they are.
    verdict : Verdict
        Whether their intensities are of use.
    """

    session: Session
    info: RecordingInfo
    scans: tuple[LaserScan, ...]
    numbers: IntArray
    verdict: Verdict

    @property
    def steps(self) -> tuple[float, float]:
        """Least and greatest step between beams, rad."""
        steps = [abs(scan.angle_increment) for scan in self.scans]
        return min(steps), max(steps)

    @property
    def has_levels(self) -> bool:
        """Whether surfaces differ in intensity; those of a saturated lidar do at their dark end."""
        return self.verdict.informative or self.verdict.kind == "saturated"

    @property
    def no_echo(self) -> float | None:
        """Range written for beams without echo, m; None where it is not known or infinite."""
        value = self.info.no_echo
        return value if value is not None and math.isfinite(value) else None


def read(session: Session, options: SourceOptions | None = None) -> Reading:
    """Read the scans of a session.

    Raises
    ------
    RecordingError
        The recording cannot be read, is damaged or has no scans.
    """
    source = open_recording(session.recording, replace(options or SourceOptions(), strict=True))
    kept: list[tuple[int, LaserScan]] = []
    count, stride = 0, 1
    for record in source.records():
        if not isinstance(record, LaserScan) or defect(record):
            continue
        if count % stride == 0:
            kept.append((count, mended(record)))
        count += 1
        # the length of a recording is not always known beforehand
        if len(kept) >= 2 * MOST_SCANS:
            kept, stride = kept[::2], 2 * stride
    if not kept:
        raise NoScansError(f"no usable laser scan in {session.name}")
    scans = [(number, scan) for number, scan in kept if len(scan.intensities) == len(scan.ranges)]
    verdict = is_intensity_informative(
        (scan.ranges, scan.intensities) for scan in spread([scan for _, scan in scans], 50)
    )
    scans = scans or kept
    return Reading(
        session,
        source.info,
        tuple(scan for _, scan in scans),
        np.array([number for number, _ in scans], dtype=np.int64),
        verdict,
    )


def check_informative(readings: list[Reading]) -> None:
    """Make sure that the intensities of recordings can be used.

    Raises
    ------
    CalibrationError
        Those of a recording tell nothing, and why.
    """
    for reading in readings:
        if not reading.has_levels:
            raise CalibrationError(
                f"{reading.session.name}: {reading.verdict.reason}",
                "a lidar is calibrated for glass by its intensities; without, --geometry can be calibrated",
            )


def spread(scans: list[LaserScan], most: int) -> list[LaserScan]:
    """At most so many scans, from all over the recording."""
    return scans[:: max(1, math.ceil(len(scans) / most))]


def bearings(scan: LaserScan) -> FloatArray:
    """Angle of every beam, rad."""
    return scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges), dtype=np.float64)


def places_of(reading: Reading) -> IntArray:
    """Number of the place at which each scan of a recording was taken, from 0 on."""
    layouts = ((scan.angle_min, scan.angle_increment) for scan in reading.scans)
    return places((scan.ranges for scan in reading.scans), layouts)


def opened(scan: LaserScan, bearing: float) -> LaserScan:
    """A scan of a full turn that begins behind a bearing (rad), so that no surface there is cut in two."""
    size = len(scan.ranges)
    if not closes(size, scan.angle_increment):
        return scan
    step = scan.angle_increment
    # beams that are missing between the last and the first keep their place
    missing = max(0, round(FULL_TURN / abs(step)) - size)
    seam = round((bearing - math.copysign(math.pi, step) - scan.angle_min) / step)
    return replace(
        scan,
        ranges=_turned(scan.ranges, missing, seam),
        intensities=_turned(scan.intensities, missing, seam),
        angle_min=scan.angle_min + seam * step,
    )


def _turned(values: Float32Array, missing: int, seam: int) -> Float32Array:
    whole = np.concatenate((values, np.full(missing, np.nan, dtype=np.float32)))
    return np.roll(whole, -seam)


def day_of(readings: list[Reading]) -> str:
    """Day (UTC) on which the earliest of some recordings was made, ISO 8601; empty where it is not known."""
    return recording_day(min(scan.stamp for reading in readings for scan in reading.scans))


def check_alike(readings: list[Reading]) -> None:
    """Make sure that recordings can be of one lidar.

    Raises
    ------
    CalibrationError
        Their steps between beams differ.
    """
    first = readings[0]
    for other in readings[1:]:
        low = max(first.steps[0], other.steps[0])
        high = min(first.steps[1], other.steps[1])
        if low > high * (1.0 + SAME_STEP):
            mine, others = (math.degrees(reading.steps[0]) for reading in (first, other))
            raise CalibrationError(
                f"{first.session.name} and {other.session.name} are of different lidars: "
                f"steps of {mine:.4g} and {others:.4g} deg",
                "calibrate each lidar by itself",
            )
