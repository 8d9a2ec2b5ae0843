"""ROS messages become plain records."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from glassslam.records import Float32Array, FloatArray, Imu, LaserScan, Odometry
from glassslam.sources.multiecho import EchoScan

NO_BEAMS = "scan without beams"
BAD_GEOMETRY = "scan with a zero or non-finite angle increment"
BAD_STAMP = "non-finite stamp"
BAD_ODOMETRY = "odometry that is not finite or has no orientation"
BAD_IMU = "imu without a finite angular velocity"
UNREADABLE = "unreadable message"

_EMPTY: Float32Array = np.empty(0, dtype=np.float32)


class UnusableMessageError(Exception):
    """A message that cannot become a record; the text is the reason counted."""


@dataclass(frozen=True, slots=True)
class Mount:
    """How scans of one topic are read.

    Attributes
    ----------
    range_ceiling : float
        Ranges from here on are the sensor's way of saying "no echo", m.
    mirrored : bool
        The laser hangs upside-down: its angles run the other way round seen from above.
    """

    range_ceiling: float = math.inf
    mirrored: bool = False


def stamp_of(header: Any, record_ns: int) -> float:
    """Time of a header, s; that of recording where a driver left the header empty."""
    nanoseconds: int = header.stamp.sec * 10**9 + header.stamp.nanosec
    return (nanoseconds or record_ns) / 1e9


def laser_scan(message: Any, record_ns: int, mount: Mount) -> LaserScan:
    """A scan from sensor_msgs/LaserScan.

    Raises
    ------
    UnusableMessageError
        The scan has no beams or no usable geometry.
    """
    stamp = stamp_of(message.header, record_ns)
    return _scan(message, message.header.frame_id, stamp, record_ns, mount)


def echo_scan(message: EchoScan, record_ns: int, mount: Mount) -> LaserScan:
    """A scan from a multi-echo scan whose echoes are chosen.

    Raises
    ------
    UnusableMessageError
        The scan has no beams or no usable geometry.
    """
    return _scan(message, message.frame_id, (message.stamp_ns or record_ns) / 1e9, record_ns, mount)


def _scan(message: Any, frame_id: str, stamp: float, record_ns: int, mount: Mount) -> LaserScan:
    ranges = _quiet(message.ranges)
    angle_min, increment = float(message.angle_min), float(message.angle_increment)
    if ranges.size == 0:
        raise UnusableMessageError(NO_BEAMS)
    if not (math.isfinite(angle_min) and math.isfinite(increment) and increment != 0.0):
        raise UnusableMessageError(BAD_GEOMETRY)
    if mount.mirrored:
        # Beams keep their order in time; only the sense of their angles changes.
        angle_min, increment = -angle_min, -increment
    intensities = _quiet(message.intensities)
    return LaserScan(
        stamp=stamp,
        ranges=ranges,
        angle_min=angle_min,
        angle_increment=increment,
        range_min=_lower_limit(message.range_min),
        range_max=upper_limit(message.range_max, mount.range_ceiling),
        time_increment=_time_increment(message.time_increment),
        intensities=intensities if intensities.size == ranges.size else _EMPTY,
        frame_id=frame_id,
        record_stamp=record_ns / 1e9,
    )


def _quiet(values: Float32Array) -> Float32Array:
    """Readings with signalling NaNs made quiet: every later cast of a damaged one would warn."""
    unread = np.isnan(values)
    return np.where(unread, np.float32(np.nan), values) if unread.any() else values


def upper_limit(announced: float, ceiling: float) -> float:
    """The range from which on a beam had no echo, m: the lower of header and observed no-echo value."""
    return min(float(announced), ceiling) if announced > 0 else ceiling


def _lower_limit(announced: float) -> float:
    return float(announced) if math.isfinite(announced) and announced > 0 else 0.0


def _time_increment(announced: float) -> float:
    return float(announced) if math.isfinite(announced) else 0.0


def has_foreign_intensities(message: Any) -> bool:
    """Whether there are intensities, but not one for each beam."""
    return message.intensities.size not in {0, message.ranges.size}


def odometry(message: Any, record_ns: int) -> Odometry:
    """Odometry from nav_msgs/Odometry.

    Raises
    ------
    UnusableMessageError
        The pose is not finite or has no orientation.
    """
    pose = message.pose.pose
    return _odometry(stamp_of(message.header, record_ns), pose.position, pose.orientation, record_ns)


def odometry_from_transform(stamped: Any, record_ns: int) -> Odometry:
    """Odometry from geometry_msgs/TransformStamped.

    Raises
    ------
    UnusableMessageError
        The pose is not finite or has no orientation.
    """
    transform = stamped.transform
    stamp = stamp_of(stamped.header, record_ns)
    return _odometry(stamp, transform.translation, transform.rotation, record_ns)


def _odometry(stamp: float, position: Any, rotation: Any, record_ns: int) -> Odometry:
    x, y, z, w = rotation.x, rotation.y, rotation.z, rotation.w
    norm = w * w + x * x + y * y + z * z
    if not (math.isfinite(norm) and norm > 1e-6 and math.isfinite(position.x) and math.isfinite(position.y)):
        raise UnusableMessageError(BAD_ODOMETRY)
    heading = math.atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)
    return Odometry(stamp, (float(position.x), float(position.y), heading), record_ns / 1e9)


def imu(message: Any, record_ns: int, base_from_imu: FloatArray) -> Imu:
    """Yaw rate of the base from sensor_msgs/Imu; `base_from_imu` is a matrix of shape (4, 4).

    Raises
    ------
    UnusableMessageError
        There is no angular velocity, or it is not finite.
    """
    rate = message.angular_velocity
    x, y, z = base_from_imu[2, :3].tolist()
    yaw_rate = float(x * rate.x + y * rate.y + z * rate.z)
    # By the convention of the message, -1 here says that the sensor has no gyroscope.
    absent = len(message.angular_velocity_covariance) > 0 and message.angular_velocity_covariance[0] == -1.0
    if absent or not math.isfinite(yaw_rate):
        raise UnusableMessageError(BAD_IMU)
    return Imu(stamp_of(message.header, record_ns), yaw_rate, record_ns / 1e9)
