"""Watches on the way whether anything tells how the robot moves: odometry that does, or walls that hold."""

import math
from array import array
from dataclasses import dataclass, field

import numpy as np

from glassslam.geometry import wrap_angle
from glassslam.records import FloatArray, LaserScan
from glassslam.slam.bare_kernels import wall_spread
from glassslam.slam.restless import by_direction, restless_share

_SAME, _SAME_PLACE, _SAME_HEADING = 1e-9, 0.15, 0.1
_MOST_KEPT = 64
_LEAST_TIME, _LEAST_SCANS, _LONGEST_GAP = 5.0, 20, 5.0
_RESTLESS = 0.15
_NEAREST, _FARTHEST = 0.05, 100.0


@dataclass(frozen=True, slots=True)
class Stuck:
    """A stretch in which the odometry, or the robot in the map, stood still and the scans did not.

    Attributes
    ----------
    first, last : int
        Its scans.
    share : float
        Share of the directions that changed; see `restless_share`.
    """

    first: int
    last: int
    share: float


@dataclass(frozen=True, slots=True)
class MotionReport:
    """What a watch found; one element per scan.

    Attributes
    ----------
    wall_spread : ndarray of float64, shape (n,)
        How far walls differ in direction: about 0 where all are parallel; NaN where odometry tells.
    wall_heading : ndarray of float64, shape (n,)
        The direction of most of them in the frame of the base, rad; NaN likewise.
    odometry : ndarray of float64, shape (n, 3)
        Poses of the base in the odometry frame, m and rad; NaN where odometry did not reach the scan.
    stuck : tuple of Stuck
        Where the odometry is wrong.
    missed : tuple of Stuck
        Where the map is: the robot rests in it.
    """

    wall_spread: FloatArray
    wall_heading: FloatArray
    odometry: FloatArray
    stuck: tuple[Stuck, ...] = ()
    missed: tuple[Stuck, ...] = ()


@dataclass(slots=True)
class _Still:
    """Scans since a pose rests, some from all over that time."""

    pose: FloatArray
    first: int
    begin: float
    end: float
    count: int = 0
    some: list[FloatArray] = field(default_factory=list)
    step: int = 1

    def add(self, scan: LaserScan) -> None:
        """Take a scan; when the samples are full, every other one is given up."""
        if self.count % self.step == 0:
            limits = max(scan.range_min, _NEAREST), min(scan.range_max, _FARTHEST)
            self.some.append(by_direction(scan.ranges, scan.angle_min, scan.angle_increment, limits))
            if len(self.some) == 2 * _MOST_KEPT:
                self.some, self.step = self.some[::2], 2 * self.step
        self.count += 1
        self.end = scan.stamp

    def goes_on(self, scan: LaserScan, pose: FloatArray, reach: FloatArray) -> bool:
        """Whether the pose still rests, without a break of the recording."""
        moved = pose - self.pose
        moved[2] = wrap_angle(moved[2])
        return bool((np.abs(moved) <= reach).all() and abs(scan.stamp - self.end) <= _LONGEST_GAP)

    def judged(self) -> Stuck | None:
        """What it is, if it is long enough and the scans changed."""
        if self.count < _LEAST_SCANS or self.end - self.begin < _LEAST_TIME:
            return None
        share = restless_share(self.some)
        return Stuck(self.first, self.first + self.count - 1, share) if share > _RESTLESS else None


class _Rests:
    """Stretches in which some pose rested within `way`, m, and `turn`, rad, and the scans changed."""

    def __init__(self, way: float, turn: float) -> None:
        self._reach = np.array([way, way, turn])
        self._still: _Still | None = None
        self._found: list[Stuck] = []

    def add(self, number: int, scan: LaserScan, pose: FloatArray | None) -> None:
        """Take the next scan, and the pose at it."""
        if self._still is not None and (pose is None or not self._still.goes_on(scan, pose, self._reach)):
            self._found = self.found()
            self._still = None
        if pose is None:
            return
        if self._still is None:
            self._still = _Still(np.array(pose), number, scan.stamp, scan.stamp)
        self._still.add(scan)

    def found(self) -> list[Stuck]:
        """All so far."""
        last = None if self._still is None else self._still.judged()
        return self._found if last is None else [*self._found, last]


class MotionWatch:
    """Looks at every scan for what tells its motion.

    Parameters
    ----------
    laser_yaw : float
        Heading of the laser on the robot, rad.
    """

    def __init__(self, laser_yaw: float = 0.0) -> None:
        self._laser_yaw = laser_yaw
        self._walls = array("d")
        self._odometry = array("d")
        self._wheels, self._map = _Rests(_SAME, _SAME), _Rests(_SAME_PLACE, _SAME_HEADING)

    def add(
        self, scan: LaserScan, odometry_pose: FloatArray | None, found_pose: FloatArray | None = None
    ) -> None:
        """Take the next scan, where the odometry was, shape (3,), if known, and where the map has it."""
        number = len(self._walls) // 2
        self._walls.extend(self._walls_of(scan) if odometry_pose is None else (math.nan, math.nan))
        self._odometry.extend((math.nan,) * 3 if odometry_pose is None else odometry_pose.tolist())
        self._wheels.add(number, scan, odometry_pose)
        self._map.add(number, scan, found_pose)

    def report(self) -> MotionReport:
        """Everything found so far."""
        spread, heading = np.array(self._walls).reshape(-1, 2).T
        odometry = np.array(self._odometry).reshape(-1, 3)
        return MotionReport(spread, heading, odometry, tuple(self._wheels.found()), tuple(self._map.found()))

    def _walls_of(self, scan: LaserScan) -> tuple[float, float]:
        farthest = min(scan.range_max, _FARTHEST)
        spread, heading = wall_spread(
            scan.ranges, scan.angle_min, scan.angle_increment, max(scan.range_min, _NEAREST), farthest
        )
        return spread, heading + self._laser_yaw
