"""Prediction of the next pose from odometry, an inertial sensor or constant velocity (pose extrapolator)."""

import math
from dataclasses import dataclass

import numpy as np

from glassslam.geometry import between, compose
from glassslam.records import FloatArray, Imu, Odometry
from glassslam.slam.odometry_track import OdometryTrack, YawTrack
from glassslam.slam.tracking import Event

_LONGEST_STEP = 0.6
_SHORTEST_STEP = 0.01
_LONG_SILENCE, _MANY_STEPS, _CLOCK_STEP = 5.0, 10.0, 1.0
_ZERO_DISTANCE, _ZERO_TURN = 0.3, 0.1
_LARGEST_JUMP, _FASTEST, _FARTHEST = 3.0, 15.0, 100.0


@dataclass(frozen=True, slots=True)
class Prediction:
    """Where a scan is expected.

    Attributes
    ----------
    pose_in_local : ndarray of float64, shape (3,)
        Expected pose of the base, m and rad.
    distance, rotation : float
        Motion since the last pose that odometry (or the velocity) claims, m and rad.
    twist : ndarray of float64, shape (3,)
        Velocity of the base in its own frame, m/s and rad/s.
    alternative : ndarray of float64, shape (3,), or None
        What constant velocity expects where that differs much from the odometry: odometry of real
        robots freezes and jumps.
    measured : bool
        Whether odometry stands behind the prediction.
    after_gap : bool
        Whether the recording is silent for so long before the scan that the robot may be anywhere near.
    event : Event
        What the recording did since the last pose.
    """

    pose_in_local: FloatArray
    distance: float
    rotation: float
    twist: FloatArray
    alternative: FloatArray | None
    measured: bool
    after_gap: bool
    event: Event = Event.NONE


class PoseExtrapolator:
    """Keeps what is needed to predict the pose of the next scan.

    Velocity is measured between the middles of the sweeps. A scan undistorted with a wrong velocity
    fits best where its middle is right, so its pose at the first beam is off by half the error; a
    velocity from such poses feeds the error back and grows without bound on a spinning lidar.

    Attributes
    ----------
    odometry, yaw : OdometryTrack, YawTrack
        What the sensors of motion said.
    jumps : int
        Steps of the odometry no robot could have made.
    """

    def __init__(self) -> None:
        self.odometry = OdometryTrack()
        self.yaw = YawTrack()
        self._stamp = math.nan
        self._period = 0.0
        self._pose = np.zeros(3)
        self._middle_stamp = math.nan
        self._middle = np.zeros(3)
        self._odometry_pose: FloatArray | None = None
        self._heading: float | None = None
        self._velocity: FloatArray | None = None
        self.jumps = 0

    def add_odometry(self, odometry: Odometry) -> None:
        """Take an odometry pose."""
        self.odometry.add(odometry)

    def add_imu(self, imu: Imu) -> None:
        """Take a yaw rate."""
        self.yaw.add(imu)

    def add_pose(
        self,
        stamp: float,
        pose_in_local: FloatArray,
        odometry_pose: FloatArray | None,
        half_sweep: float = 0.0,
        twist: FloatArray | None = None,
    ) -> None:
        """Take the matched pose of a scan.

        Parameters
        ----------
        stamp : float
            Time of the first beam, s.
        pose_in_local : ndarray of float64, shape (3,)
            Pose of the base at it, m and rad.
        odometry_pose : ndarray of float64, shape (3,), or None
            Where the odometry was.
        half_sweep : float
            Time from the first to the middle beam, s; 0 when motion was not undone.
        twist : ndarray of float64, shape (3,), or None
            Velocity with which motion was undone, m/s and rad/s.
        """
        middle = pose_in_local
        if twist is not None and half_sweep != 0.0:
            middle = compose(pose_in_local, twist * half_sweep)
        step = stamp + half_sweep - self._middle_stamp
        if _is_usual(step):
            self._velocity = between(self._middle, middle) / step
        elif not self._is_clock_set(stamp):
            self._velocity = None
        self._middle_stamp, self._middle = stamp + half_sweep, middle
        if not self._is_clock_set(stamp):
            self._period = max(0.0, stamp - self._stamp)
        self._stamp, self._pose = stamp, pose_in_local
        if middle is not pose_in_local and odometry_pose is None and self._velocity is not None:
            self._pose = compose(middle, -half_sweep * self._velocity)
        self._odometry_pose = odometry_pose
        self._heading = self.yaw.angle_at(stamp)

    def predict(self, stamp: float, odometry_pose: FloatArray | None) -> Prediction:
        """Expected pose of the next scan, from its stamp and the pose of the odometry at it, if known."""
        # a clock that is set back most likely does not stop the robot
        step = self._period if self._is_clock_set(stamp) else stamp - self._stamp
        coasting = self._coast(step)
        jumps = self.jumps
        event = self._break_before(stamp)
        moved = None
        if event is Event.NONE or not _has_begun_anew(self._odometry_pose, odometry_pose):
            moved = self._odometry_motion(odometry_pose, step)
        motion = moved if moved is not None else self._turn_by_imu(stamp, coasting)
        twist = motion / step if _is_usual(step) else np.zeros(3)
        return Prediction(
            compose(self._pose, motion),
            math.hypot(motion[0], motion[1]),
            abs(float(motion[2])),
            twist,
            self._alternative(moved, coasting),
            moved is not None,
            not 0.0 < stamp - self._stamp < _LONGEST_STEP,
            event | (Event.ODOMETRY_JUMP if self.jumps > jumps else Event.NONE),
        )

    def _alternative(self, moved: FloatArray | None, coasting: FloatArray | None) -> FloatArray | None:
        """Where constant velocity leads, if that is elsewhere than where the odometry does."""
        if moved is None or coasting is None:
            return None
        gap = moved - coasting
        is_elsewhere = math.hypot(gap[0], gap[1]) > 0.1 or abs(gap[2]) > 0.06
        return compose(self._pose, coasting) if is_elsewhere else None

    def _break_before(self, stamp: float) -> Event:
        """Whether the clock was set, or nothing is known of a time long enough to be carried elsewhere."""
        step = stamp - self._stamp
        if self._is_clock_set(stamp):
            return Event.CLOCK_BACK
        is_long = step > max(_LONG_SILENCE, _MANY_STEPS * self._period)
        if is_long and self.odometry.longest_silence(self._stamp, stamp) > _LONG_SILENCE:
            return Event.GAP
        return Event.NONE

    def _is_clock_set(self, stamp: float) -> bool:
        return stamp < self._stamp - _CLOCK_STEP

    def _odometry_motion(self, now: FloatArray | None, step: float) -> FloatArray | None:
        """Motion since the last scan, unless no robot is that fast: odometry that is reset says nothing."""
        if now is None or self._odometry_pose is None:
            return None
        motion = between(self._odometry_pose, now)
        # however long a recording was silent: such a step would tear the map apart if it were wrong
        if math.hypot(motion[0], motion[1]) > min(_LARGEST_JUMP + _FASTEST * max(step, 0.0), _FARTHEST):
            self.jumps += 1
            return None
        return motion

    def _coast(self, step: float) -> FloatArray | None:
        if self._velocity is None or not 0.0 < step < _LONGEST_STEP:
            return None
        return self._velocity * step

    def _turn_by_imu(self, stamp: float, coasting: FloatArray | None) -> FloatArray:
        motion = np.zeros(3) if coasting is None else coasting.copy()
        now = self.yaw.angle_at(stamp)
        if now is not None and self._heading is not None:
            motion[2] = now - self._heading
        return motion


def _has_begun_anew(before: FloatArray | None, now: FloatArray | None) -> bool:
    """Whether odometry starts from zero again, as after the robot was switched off."""
    if before is None or now is None:
        return False
    return _is_at_zero(now) and not _is_at_zero(before)


def _is_at_zero(pose: FloatArray) -> bool:
    return math.hypot(pose[0], pose[1]) < _ZERO_DISTANCE and abs(pose[2]) < _ZERO_TURN


def _is_usual(step: float) -> bool:
    """Whether a velocity can be told from two poses so far apart in time, s."""
    return _SHORTEST_STEP < step < _LONGEST_STEP
