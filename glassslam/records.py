"""Plain sensor records: what flows from a recording into the mapper."""

from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.float64]
Float32Array: TypeAlias = NDArray[np.float32]


def _empty() -> Float32Array:
    return np.empty(0, dtype=np.float32)


@dataclass(frozen=True, slots=True)
class LaserScan:
    """One sweep of a planar lidar, as recorded.

    Attributes
    ----------
    stamp : float
        Time of the first beam, s.
    ranges : ndarray of float32, shape (n,)
        Metres; +inf or at least `range_max`: no echo; NaN, -inf, 0 or below `range_min`: invalid.
    angle_min, angle_increment : float
        Angle of the first beam and step between beams in the laser frame, rad.
    range_min, range_max : float
        Limits of the sensor, m.
    time_increment : float
        Time between two beams, s; 0 when unknown.
    intensities : ndarray of float32, shape (n,) or (0,)
        Echo strength in the unit of the sensor; empty when not recorded.
    frame_id : str
        Name of the laser frame.
    record_stamp : float
        Time at which the message was recorded, s.
    """

    stamp: float
    ranges: Float32Array
    angle_min: float
    angle_increment: float
    range_min: float
    range_max: float
    time_increment: float = 0.0
    intensities: Float32Array = field(default_factory=_empty)
    frame_id: str = "laser"
    record_stamp: float = 0.0


@dataclass(frozen=True, slots=True)
class Odometry:
    """Pose of the robot base in the drifting odometry frame.

    Attributes
    ----------
    stamp : float
        Time, s.
    pose : tuple of float
        (x, y, theta) of the base in the odometry frame, m and rad.
    record_stamp : float
        Time at which the message was recorded, s.
    """

    stamp: float
    pose: tuple[float, float, float]
    record_stamp: float = 0.0


@dataclass(frozen=True, slots=True)
class Imu:
    """Yaw rate of the robot base.

    Attributes
    ----------
    stamp : float
        Time, s.
    yaw_rate : float
        Angular velocity about the vertical axis of the base, rad/s, counter-clockwise positive.
    record_stamp : float
        Time at which the message was recorded, s.
    """

    stamp: float
    yaw_rate: float
    record_stamp: float = 0.0


@dataclass(frozen=True, slots=True)
class SonarRing:
    """Where the sonars of a robot sit.

    Attributes
    ----------
    poses : ndarray of float64, shape (n, 3)
        Pose (x, y, yaw) of every sonar in the base frame, m and rad; it looks along its x axis.
    field_of_view : float
        Full opening angle of the cone, rad.
    range_min, range_max : float
        Limits of the sonars, m.
    name : str
        Name of the ring; empty when it was read from a recording.
    """

    poses: FloatArray
    field_of_view: float
    range_min: float
    range_max: float
    name: str = ""


@dataclass(frozen=True, slots=True)
class RangeRing:
    """One sweep of a ring of sonars.

    Attributes
    ----------
    stamp : float
        Time, s.
    ranges : ndarray of float32, shape (n,)
        One range per sonar, m; +inf: no echo; NaN: no new reading.
    record_stamp : float
        Time at which the message was recorded, s.
    """

    stamp: float
    ranges: Float32Array
    record_stamp: float = 0.0


@dataclass(frozen=True, slots=True)
class PointSet:
    """Points of a 3D ultrasonic sensor, in the frame of the base.

    Attributes
    ----------
    stamp : float
        Time, s.
    points : ndarray of float32, shape (n, 3)
        Echoes, m.
    origin : ndarray of float64, shape (3,)
        Where the sensor sits in the base frame, m.
    record_stamp : float
        Time at which the message was recorded, s.
    axis : tuple of float
        Where the sensor looks in the base frame, of length 1.
    """

    stamp: float
    points: Float32Array
    origin: FloatArray
    record_stamp: float = 0.0
    axis: tuple[float, float, float] = (1.0, 0.0, 0.0)


Record: TypeAlias = LaserScan | Odometry | Imu | RangeRing | PointSet


@dataclass(frozen=True, slots=True)
class Damage:
    """A part of a recording that could not be read.

    Attributes
    ----------
    file : str
        The file, as given.
    offset : int
        Byte at which the part begins.
    bytes : int
        Its length as far as the file holds it.
    first_stamp, last_stamp : float or None
        Record times between which messages are missing, s; None when not known.
    messages_lost : int
        How many messages of all topics are missing; an estimate where no index says it.
    reason : str
        What is wrong with it.
    """

    file: str
    offset: int
    bytes: int
    first_stamp: float | None
    last_stamp: float | None
    messages_lost: int
    reason: str

    @property
    def seconds_lost(self) -> float:
        """Recorded time between the messages around the damage, s; 0 when not known."""
        if self.first_stamp is None or self.last_stamp is None:
            return 0.0
        return max(0.0, self.last_stamp - self.first_stamp)

    @property
    def text(self) -> str:
        """One line for a user."""
        lost = f"about {self.messages_lost} messages and {self.seconds_lost:.1f} s lost"
        what = lost if self.messages_lost else "no message lost"
        return f"{self.file}: {self.bytes} bytes at offset {self.offset} unreadable ({self.reason}): {what}"


@dataclass(frozen=True, slots=True)
class RecordingInfo:
    """What a source knows of the recording it streams.

    Attributes
    ----------
    paths : tuple of str
        The files read, as given.
    format : str
        "rosbag1", "rosbag2-sqlite3", "rosbag2-mcap", "carmen" or "player".
    duration : float
        Recorded time from the first to the last record used, s.
    scan_count : int
        Number of scan messages announced by the index (0 when unknown).
    base_from_laser : tuple of float
        Pose (x, y, yaw) of the laser in the base frame, m and rad.
    scan_topic, odom_topic, imu_topic : str
        Topics in use; empty when there is none. Odometry from tf is named "tf:PARENT->CHILD".
    no_echo : float or None
        The range written for beams without echo, m (may be inf); None when it is not known.
    sonar_ring : SonarRing or None
        Where the sonars sit; None without a ring.
    sonar_topics : tuple of str
        Topics of the ring and of 3D ultrasonic sensors in use.
    points_topics : tuple of str
        Those of 3D ultrasonic sensors among them.
    laser_height : float or None
        Height of the laser above the base, m; None when the recording does not tell it.
    """

    paths: tuple[str, ...]
    format: str
    duration: float
    scan_count: int
    base_from_laser: tuple[float, float, float] = (0.0, 0.0, 0.0)
    scan_topic: str = ""
    odom_topic: str = ""
    imu_topic: str = ""
    no_echo: float | None = None
    sonar_ring: SonarRing | None = None
    sonar_topics: tuple[str, ...] = ()
    points_topics: tuple[str, ...] = ()
    laser_height: float | None = None


@dataclass(frozen=True, slots=True)
class Trajectory:
    """Stamped planar poses, in the order of the recording.

    Attributes
    ----------
    stamps : ndarray of float64, shape (n,)
        Times, s; not necessarily increasing.
    poses : ndarray of float64, shape (n, 3)
        (x, y, theta) in the map frame, m and rad.
    """

    stamps: FloatArray
    poses: FloatArray

    def __post_init__(self) -> None:
        if self.stamps.ndim != 1 or self.poses.shape != (self.stamps.size, 3):
            raise ValueError(f"poses of shape {self.poses.shape} do not fit {self.stamps.shape} stamps")
