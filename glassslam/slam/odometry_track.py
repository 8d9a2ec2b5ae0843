"""Where the odometry says the robot was: interpolation to the time of a scan."""

import math
from bisect import bisect_right
from collections.abc import MutableSequence

import numpy as np

from glassslam.geometry import between, compose, interpolate
from glassslam.records import FloatArray, Imu, Odometry

_KEPT = 20_000
_KEPT_BEFORE_STEP = 512
_LONGEST_EXTRAPOLATION = 0.5
_MOST_LATE = 4
_CLOCK_STEP = 1.0


def mend_late_stamps(times: MutableSequence[float], following: float) -> None:
    """Move up to four late stamps at the end of `times` before the stamp of the record that follows, s.

    Old loggers stamp single records up to a second late, though they write them in the right order.
    Late stamps are spread evenly between the last good one and the following one. A clock that really
    stepped back (no good stamp within reach) is left alone.
    """
    good = len(times) - 1
    while good >= 0 and times[good] > following and len(times) - good <= _MOST_LATE:
        good -= 1
    late = len(times) - 1 - good
    if good < 0 or late == 0 or times[good] > following:
        return
    step = (following - times[good]) / (late + 1)
    for k in range(late):
        times[good + 1 + k] = times[good] + (k + 1) * step


class OdometryTrack:
    """The last odometry poses, in the order they arrived.

    Stamps may step back in old logs; an older stretch never overrules a newer one. Enough is kept for
    the scans that wait, however much slower than the odometry they come.

    Attributes
    ----------
    dropped : int
        Poses left out because they were not finite.
    """

    def __init__(self) -> None:
        self._stamps: list[float] = []
        self._poses: list[FloatArray] = []
        self._rising = 0
        self.dropped = 0

    def __len__(self) -> int:
        return len(self._stamps)

    @property
    def latest(self) -> float:
        """Stamp of the last pose that arrived, s; -inf before the first."""
        return self._stamps[-1] if self._stamps else -math.inf

    @property
    def latest_pose(self) -> FloatArray | None:
        """The last pose that arrived, shape (3,)."""
        return self._poses[-1] if self._poses else None

    def add(self, odometry: Odometry) -> None:
        """Take a pose; one that is not finite is counted in `dropped` and left out."""
        if not (math.isfinite(odometry.stamp) and all(map(math.isfinite, odometry.pose))):
            self.dropped += 1
            return
        mend_late_stamps(self._stamps, odometry.stamp)
        if odometry.stamp < self.latest:
            self._rising = len(self._stamps)
        self._stamps.append(odometry.stamp)
        self._poses.append(np.array(odometry.pose, dtype=np.float64))
        if len(self._stamps) > 2 * _KEPT:
            del self._stamps[:_KEPT], self._poses[:_KEPT]
            self._rising = max(self._rising - _KEPT, 0)

    def pose_at(self, stamp: float) -> FloatArray | None:
        """Pose of the base in the odometry frame, shape (3,), or None where the track does not reach.

        Interpolated between the newest two neighbours that enclose the stamp; up to half a second
        beyond the last pose it is extrapolated with the last velocity.
        """
        if not self._stamps:
            return None
        if stamp >= self.latest:
            return self._extrapolate(stamp)
        k = self._enclosing(stamp)
        if k < 0:
            return None
        before, after = self._stamps[k], self._stamps[k + 1]
        return interpolate(self._poses[k], self._poses[k + 1], (stamp - before) / (after - before))

    def longest_silence(self, start: float, end: float) -> float:
        """Longest time without a pose between two stamps, s."""
        first = bisect_right(self._stamps, start, lo=self._rising)
        last = bisect_right(self._stamps, end, lo=first)
        return float(np.diff([start, *self._stamps[first:last], end]).max())

    def _enclosing(self, stamp: float) -> int:
        """Newest index whose pose and the next one enclose a stamp before the latest; -1 when none do."""
        k = bisect_right(self._stamps, stamp, lo=self._rising) - 1
        if k >= self._rising:
            return k
        for k in range(self._rising - 1, max(self._rising - _KEPT_BEFORE_STEP, 0) - 1, -1):
            if self._stamps[k] <= stamp < self._stamps[k + 1]:
                return k
        return -1

    def _extrapolate(self, stamp: float) -> FloatArray | None:
        ahead = stamp - self.latest
        if ahead > _LONGEST_EXTRAPOLATION:
            return None
        step = self.latest - self._stamps[-2] if len(self._stamps) > 1 else 0.0
        if ahead == 0.0 or not 0.0 < step <= _LONGEST_EXTRAPOLATION:
            return self._poses[-1]
        motion = between(self._poses[-2], self._poses[-1])
        return compose(self._poses[-1], motion * (ahead / step))


class YawTrack:
    """Heading integrated from the yaw rates of an inertial sensor.

    Attributes
    ----------
    dropped : int
        Rates left out because they were not finite or came late.
    """

    def __init__(self) -> None:
        self._stamps: list[float] = []
        self._angles: list[float] = []
        self._rates: list[float] = []
        self.dropped = 0

    def add(self, imu: Imu) -> None:
        """Take a rate; one that is not finite or not newer than the last is counted in `dropped`.

        A stamp more than a second back is a clock that was set: the heading goes on from there. What
        happened in a gap of more than half a second is not known; no turn is assumed.
        """
        last = self._stamps[-1] if self._stamps else -math.inf
        step = imu.stamp - last
        if not (math.isfinite(imu.stamp) and math.isfinite(imu.yaw_rate)) or -_CLOCK_STEP <= step <= 0.0:
            self.dropped += 1
            return
        angle = self._angles[-1] if self._angles else 0.0
        if step < 0.0:
            self._forget(len(self._stamps))
        elif step <= _LONGEST_EXTRAPOLATION:
            angle += imu.yaw_rate * step
        self._stamps.append(imu.stamp)
        self._angles.append(angle)
        self._rates.append(imu.yaw_rate)
        if len(self._stamps) > 2 * _KEPT:
            self._forget(_KEPT)

    def angle_at(self, stamp: float) -> float | None:
        """Integrated heading, rad, or None farther than half a second from the known rates."""
        k = bisect_right(self._stamps, stamp) - 1
        if k < 0 or stamp - self._stamps[k] > _LONGEST_EXTRAPOLATION:
            return None
        return self._angles[k] + self._rates[k] * (stamp - self._stamps[k])

    def _forget(self, count: int) -> None:
        for values in (self._stamps, self._angles, self._rates):
            del values[:count]
