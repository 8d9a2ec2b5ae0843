"""Lines of a CARMEN log become scans and poses."""

import math
from dataclasses import dataclass

import numpy as np

from glassslam.records import Float32Array, FloatArray
from glassslam.sources.carmen_kernels import parse_decimals
from glassslam.sources.messages import BAD_GEOMETRY, BAD_STAMP, NO_BEAMS, UnusableMessageError
from glassslam.sources.textlines import single

FLASER = "FLASER"
ROBOTLASER = "ROBOTLASER1"
ODOM = "ODOM"

UNREADABLE_LINE = "unreadable line"

# FLASER lines do not say what the laser was: it was a SICK LMS, which measures up to 80 m over half a circle.
SICK_RANGE_MAX = 80.0

_POSES = 6
_HEADER = 8
_AFTER_POSES = 5
_EMPTY: Float32Array = np.empty(0, dtype=np.float32)

Pose = tuple[float, float, float]


def flaser_geometry(beams: int) -> tuple[float, float]:
    """(angle_min, angle_increment) of a FLASER line with this many beams over half a circle, rad.

    An odd number (181, 361) has a beam at both ends; an even one (180, 360) leaves out the last.
    """
    return -math.pi / 2, math.pi / (beams - beams % 2)


@dataclass(frozen=True, slots=True)
class LaserLine:
    """A laser line, read.

    Attributes
    ----------
    stamp : float
        Time of the scan, s.
    logged : float
        Time on the clock of the logger, s; NaN where the line has none.
    ranges, intensities : ndarray of float32
        Metres; echo strength or empty.
    angle_min, angle_increment : float
        Angles in the laser frame, rad.
    range_max : float
        Largest range the sensor can measure, m.
    laser_pose, robot_pose : tuple of float
        (x, y, theta) in the odometry frame, m and rad; NaN where unreadable.
    """

    stamp: float
    logged: float
    ranges: Float32Array
    intensities: Float32Array
    angle_min: float
    angle_increment: float
    range_max: float
    laser_pose: Pose
    robot_pose: Pose


class NumberReader:
    """Reads the numbers of lines into a buffer that grows with the longest."""

    def __init__(self) -> None:
        self._buffer: FloatArray = np.empty(1024)

    def read(self, line: bytes, start: int, at_least: int = 0) -> FloatArray:
        """The leading numbers of a line from a position on, as a view that is valid until the next call.

        Parameters
        ----------
        line : bytes
            The text.
        start : int
            Where the first number begins.
        at_least : int
            With fewer plain numbers than these, exotic notations (exponents, nan) are tried as well.
        """
        text = np.frombuffer(line, dtype=np.uint8)
        while (count := parse_decimals(text, start, self._buffer)) == self._buffer.size:
            self._buffer = np.empty(2 * self._buffer.size)
        return self._buffer[:count] if count >= at_least else read_any(line, start)


def read_any(line: bytes, start: int) -> FloatArray:
    """The leading numbers of a line in any notation, slowly."""
    values = []
    for token in line[start:].split():
        try:
            values.append(float(token))
        except ValueError:
            break
    return np.array(values)


def parse_laser(line: bytes, reader: NumberReader) -> LaserLine:
    """A FLASER or ROBOTLASER1 line.

    Raises
    ------
    UnusableMessageError
        The line is cut off, or its geometry or time makes no sense.
    """
    flaser = line.startswith(b"FLASER")
    laser = _parse_flaser(line, reader) if flaser else _parse_robotlaser(line, reader)
    if not math.isfinite(laser.stamp):
        raise UnusableMessageError(BAD_STAMP)
    if not (
        math.isfinite(laser.angle_min) and math.isfinite(laser.angle_increment) and laser.angle_increment
    ):
        raise UnusableMessageError(BAD_GEOMETRY)
    return laser


def _parse_flaser(line: bytes, reader: NumberReader) -> LaserLine:
    start = len(FLASER)
    values = reader.read(line, start, 1)
    beams = _count(values, 0)
    if beams == 0:
        raise UnusableMessageError(NO_BEAMS)
    needed = 1 + beams + _POSES + 1
    values = _ensure(values, needed, line, start)
    poses = values[1 + beams : needed].tolist()
    angle_min, increment = flaser_geometry(beams) if beams > 1 else (0.0, math.pi)
    return LaserLine(
        stamp=poses[6],
        logged=_logged(line),
        ranges=single(values[1 : 1 + beams]),
        intensities=_EMPTY,
        angle_min=angle_min,
        angle_increment=increment,
        range_max=SICK_RANGE_MAX,
        laser_pose=(poses[0], poses[1], poses[2]),
        robot_pose=(poses[3], poses[4], poses[5]),
    )


def _parse_robotlaser(line: bytes, reader: NumberReader) -> LaserLine:
    start = len(ROBOTLASER)
    values = reader.read(line, start, _HEADER)
    beams = _count(values, _HEADER - 1)
    if beams == 0:
        raise UnusableMessageError(NO_BEAMS)
    values = _ensure(values, _HEADER + beams + 1, line, start)
    remissions = _count(values, _HEADER + beams)
    poses_at = _HEADER + beams + 1 + remissions
    needed = poses_at + _POSES + _AFTER_POSES + 1
    values = _ensure(values, needed, line, start)
    _, angle_min, field_of_view, increment, range_max = values[:5].tolist()
    poses = values[poses_at:needed].tolist()
    if not increment and beams > 1:
        increment = field_of_view / (beams - 1)
    remission = single(values[poses_at - remissions : poses_at])
    return LaserLine(
        stamp=poses[-1],
        logged=_logged(line),
        ranges=single(values[_HEADER : _HEADER + beams]),
        intensities=remission if remissions == beams else _EMPTY,
        angle_min=angle_min,
        angle_increment=increment,
        range_max=range_max,
        laser_pose=(poses[0], poses[1], poses[2]),
        robot_pose=(poses[3], poses[4], poses[5]),
    )


def parse_odom(line: bytes, reader: NumberReader) -> tuple[float, float, Pose]:
    """Stamp, time on the logger's clock and pose of an ODOM line.

    Raises
    ------
    UnusableMessageError
        The line is cut off or its stamp is not finite.
    """
    values = reader.read(line, len(ODOM), 7)
    if values.size < 7:
        raise UnusableMessageError(UNREADABLE_LINE)
    x, y, theta, _, _, _, stamp = values[:7].tolist()
    if not math.isfinite(stamp):
        raise UnusableMessageError(BAD_STAMP)
    return stamp, _logged(line), (x, y, theta)


def _count(values: FloatArray, index: int) -> int:
    """A number of entries written in the line itself."""
    if values.size <= index or not 0 <= values[index] <= 1e6 or values[index] % 1:
        raise UnusableMessageError(UNREADABLE_LINE)
    return int(values[index])


def _ensure(values: FloatArray, needed: int, line: bytes, start: int) -> FloatArray:
    if values.size < needed:
        values = read_any(line, start)
    if values.size < needed:
        raise UnusableMessageError(UNREADABLE_LINE)
    return values


def _logged(line: bytes) -> float:
    """The logger's own time, after the name of the host at the end of the line."""
    try:
        return float(line[line.rstrip().rfind(b" ") :])
    except ValueError:
        return math.nan
