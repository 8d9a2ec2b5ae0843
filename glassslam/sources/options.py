"""What a user may say about how a recording is read."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, TypeAlias, get_args

from glassslam.errors import UsageError

Echo: TypeAlias = Literal["first", "last", "strongest"]

UNUSED = "none"


@dataclass(frozen=True, slots=True)
class SourceOptions:
    """Which part of a recording is used, and how.

    Attributes
    ----------
    scan_topic, odom_topic, imu_topic : str or None
        Topics by name (a leading slash does not matter); None: the only candidate there is. "none" switches
        odometry or the IMU off. "tf" or "tf:PARENT->CHILD" takes odometry from a transform.
    laser_pose : tuple of float or None
        Pose (x, y, yaw) of the laser in the base frame, m and rad; None: from the recording.
    start : float
        Seconds skipped at the beginning of the recording (record time), s.
    duration : float or None
        Length of the part used, s; None: up to the end.
    every : int
        Use every n-th scan.
    echo : {"first", "last", "strongest"}
        Which echo of a MultiEchoLaserScan becomes the range. The first is the nearest surface, as a
        single-echo lidar reports it.
    sonar : str, Path or None
        A second file, which holds the sonar readings: a bag, a Player log or a pi-map text log.
    sonar_topic : str, tuple of str or None
        Topics of the sonars by name; None: what looks like sonar. "none" switches sonar off.
    points_topic : str, tuple of str or None
        Topics of 3D ultrasonic sensors by name; None: those of the sonar topics that turn out to be points.
        "none" leaves points out.
    sonar_ring : str, Path or None
        Where the sonars sit: the name of a shipped ring or a YAML file; None: as recorded.
    strict : bool
        Refuse a damaged file; otherwise what is readable is read, and `Recording.damage` tells the rest.

    Raises
    ------
    UsageError
        A value is out of its domain.
    """

    scan_topic: str | None = None
    odom_topic: str | None = None
    imu_topic: str | None = None
    laser_pose: tuple[float, float, float] | None = None
    start: float = 0.0
    duration: float | None = None
    every: int = 1
    echo: Echo = "first"
    sonar: str | Path | None = None
    sonar_topic: str | tuple[str, ...] | None = None
    sonar_ring: str | Path | None = None
    points_topic: str | tuple[str, ...] | None = None
    strict: bool = False

    def __post_init__(self) -> None:
        if not (math.isfinite(self.start) and self.start >= 0):
            raise UsageError(f"--start must be a time of 0 s or more, not {self.start:g}")
        if self.duration is not None and not (math.isfinite(self.duration) and self.duration > 0):
            raise UsageError(f"--duration must be a time above 0 s, not {self.duration:g}")
        if self.every < 1:
            raise UsageError(f"--every must be 1 or more, not {self.every}")
        if self.echo not in get_args(Echo):
            raise UsageError(
                f"--echo: unknown echo {self.echo!r}", f"known here: {', '.join(get_args(Echo))}"
            )
        if self.laser_pose is not None and not _is_pose(self.laser_pose):
            raise UsageError(f"laser pose must be three finite numbers x,y,yaw, not {self.laser_pose}")
        if self.scan_topic == UNUSED:
            raise UsageError("a map needs scans: the scan topic cannot be 'none'")
        if self.without_sonar and self.sonar is not None:
            raise UsageError("a sonar file was named and sonar switched off", "leave out one of the two")

    @property
    def sonar_topics(self) -> tuple[str, ...]:
        """The topics of `sonar_topic`, however they were given."""
        return _several(self.sonar_topic)

    @property
    def without_sonar(self) -> bool:
        """Whether sonar is switched off."""
        return UNUSED in self.sonar_topics

    @property
    def points_topics(self) -> tuple[str, ...]:
        """The topics named in `points_topic`, however they were given; none where points are left out."""
        return () if self.without_points else _several(self.points_topic)

    @property
    def without_points(self) -> bool:
        """Whether points of 3D sensors are left out."""
        return UNUSED in _several(self.points_topic)


def _several(wish: str | tuple[str, ...] | None) -> tuple[str, ...]:
    return () if wish is None else (wish,) if isinstance(wish, str) else tuple(wish)


def _is_pose(values: tuple[float, ...]) -> bool:
    return len(values) == 3 and all(math.isfinite(value) for value in values)
