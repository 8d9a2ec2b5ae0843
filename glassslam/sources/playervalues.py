"""Lines of a Player log become scans, poses and sweeps."""

import math
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np

from glassslam.records import Float32Array, FloatArray
from glassslam.sources.carmenlines import UNREADABLE_LINE, NumberReader, read_any
from glassslam.sources.messages import BAD_GEOMETRY, NO_BEAMS, UnusableMessageError
from glassslam.sources.playerlines import PlayerLine
from glassslam.sources.textlines import single

Pose: TypeAlias = tuple[float, float, float]


class _Layout(NamedTuple):
    """Places of the numbers before the beams of a scan; the last of them is the number of beams."""

    head: int
    angles: int
    range_max: int | None = None
    pose: int | None = None


# Versions differ in an identifier, a pose and the largest range.
_LAYOUTS = (_Layout(4, 0), _Layout(6, 1, 4), _Layout(5, 0, 3), _Layout(9, 4, 7, 1))


@dataclass(frozen=True, slots=True)
class PlayerScan:
    """A scan as a line holds it.

    Attributes
    ----------
    angle_min, angle_increment : float
        Angles in the laser frame, rad.
    range_max : float
        Largest range, m; inf where the line does not say.
    ranges, intensities : ndarray of float32, shape (n,)
        Metres; echo strength.
    robot_pose : tuple of float or None
        (x, y, theta) in the odometry frame, where it was written with the scan.
    """

    angle_min: float
    angle_increment: float
    range_max: float
    ranges: Float32Array
    intensities: Float32Array
    robot_pose: Pose | None = None


def parse_scan(line: PlayerLine, reader: NumberReader) -> PlayerScan:
    """A scan of the laser interface: angles, number of beams, and range and intensity of each.

    Raises
    ------
    UnusableMessageError
        The line is cut off or its geometry makes no sense.
    """
    for values in (_numbers(line, reader, 6), read_any(line.text, 0)):
        for layout in _LAYOUTS:
            if (
                _is_count(values, layout.head - 1)
                and values.size == layout.head + 2 * values[layout.head - 1]
            ):
                return _scan_of(values, layout)
    raise UnusableMessageError(UNREADABLE_LINE)


def _scan_of(values: FloatArray, layout: "_Layout") -> PlayerScan:
    beams = single(values[layout.head :].reshape(-1, 2))
    if len(beams) == 0:
        raise UnusableMessageError(NO_BEAMS)
    angles = values[layout.angles : layout.angles + 3].tolist()
    far = math.inf if layout.range_max is None else float(values[layout.range_max])
    pose = None if layout.pose is None else _pose(values[layout.pose :])
    return _scan(angles, far, beams[:, 0], beams[:, 1], pose)


def scan_of_ranger(ranges: Float32Array, configuration: FloatArray) -> PlayerScan:
    """A scan of the ranger interface, whose angles stand in another line.

    Raises
    ------
    UnusableMessageError
        The geometry makes no sense.
    """
    if len(ranges) == 0:
        raise UnusableMessageError(NO_BEAMS)
    low, high, step, _, far = configuration[:5].tolist()
    return _scan([low, high, step], far, ranges, np.empty(0, dtype=np.float32), None)


def _scan(
    angles: list[float], far: float, ranges: Float32Array, strengths: Float32Array, pose: Pose | None
) -> PlayerScan:
    low, high, step = angles
    if not step and len(ranges) > 1:
        step = (high - low) / (len(ranges) - 1)
    if not (math.isfinite(low) and math.isfinite(step) and step):
        raise UnusableMessageError(BAD_GEOMETRY)
    return PlayerScan(low, step, far if far > 0.0 else math.inf, ranges, strengths, pose)


def parse_pose(line: PlayerLine, reader: NumberReader) -> Pose:
    """Pose of a position line, or of a device on the robot, m and rad.

    Raises
    ------
    UnusableMessageError
        The line is cut off.
    """
    return _pose(_numbers(line, reader, 3))


def parse_sonar(line: PlayerLine, reader: NumberReader) -> tuple[FloatArray | None, Float32Array | None]:
    """Poses (n, 3) and ranges (n,) of a sonar line, as far as it holds them.

    Raises
    ------
    UnusableMessageError
        The line is cut off.
    """
    values = _numbers(line, reader, 1).copy()
    if line.kind == "sweep":
        return None, single(_counted(values, 1)[0])
    poses, rest = _counted(values, 3)
    if line.kind == "ring":
        return poses.reshape(-1, 3), None
    return poses.reshape(-1, 3), single(_counted(rest, 1)[0])


def parse_ranges(line: PlayerLine, reader: NumberReader) -> tuple[Float32Array, FloatArray]:
    """Ranges of a ranger line, and the numbers after them.

    Raises
    ------
    UnusableMessageError
        The line is cut off.
    """
    ranges, rest = _counted(_numbers(line, reader, 1).copy(), 1)
    return single(ranges), rest


def parse_elements(line: PlayerLine, reader: NumberReader) -> tuple[Pose, FloatArray]:
    """Pose of a ranger on the robot, and of its elements, shape (n, 3), from a line of its geometry.

    Raises
    ------
    UnusableMessageError
        The line is cut off.
    """
    values = _numbers(line, reader, 10).copy()
    x, y, _, _, _, yaw = values[:6].tolist()
    elements, _ = _counted(values[9:], 6)
    return (x, y, yaw), elements.reshape(-1, 6)[:, [0, 1, 5]]


def parse_configuration(line: PlayerLine, reader: NumberReader) -> FloatArray:
    """Least and largest angle, resolution, least and largest range of a ranger, shape (5,).

    Raises
    ------
    UnusableMessageError
        The line is cut off.
    """
    return _numbers(line, reader, 5)[:5].copy()


def _numbers(line: PlayerLine, reader: NumberReader, at_least: int) -> FloatArray:
    values = reader.read(line.text, 0, at_least)
    if values.size < at_least:
        raise UnusableMessageError(UNREADABLE_LINE)
    return values


def _is_count(values: FloatArray, place: int) -> bool:
    return bool(values.size > place and 0.0 <= values[place] <= 1e6 and values[place] % 1.0 == 0.0)


def _counted(values: FloatArray, width: int) -> tuple[FloatArray, FloatArray]:
    """A number of groups of numbers that its own count precedes, and what follows."""
    if not _is_count(values, 0) or values.size < 1 + width * int(values[0]):
        raise UnusableMessageError(UNREADABLE_LINE)
    end = 1 + width * int(values[0])
    return values[1:end], values[end:]


def _pose(values: FloatArray) -> Pose:
    x, y, yaw = values[:3].tolist()
    return x, y, yaw
