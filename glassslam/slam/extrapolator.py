"""Prediction of the next pose from odometry, an inertial sensor or constant velocity (pose extrapolator)."""

import math
from dataclasses import dataclass

import numpy as np

from glassslam.geometry import between, compose
from glassslam.records import FloatArray, Imu, Odometry
from glassslam.slam.odometry_track import OdometryTrack, YawTrack

_LONGEST_STEP = 0.6
_SHORTEST_STEP = 0.01
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
    """

    pose_in_local: FloatArray
    distance: float
    rotation: float
    twist: FloatArray
    alternative: FloatArray | None
    measured: bool
    after_gap: bool


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
        self._velocity = between(self._middle, middle) / step if _is_usual(step) else None
        self._middle_stamp, self._middle = stamp + half_sweep, middle
        self._stamp, self._pose = stamp, pose_in_local
        if middle is not pose_in_local and odometry_pose is None and self._velocity is not None:
            self._pose = compose(middle, -half_sweep * self._velocity)
        self._odometry_pose = odometry_pose
        self._heading = self.yaw.angle_at(stamp)

    def predict(self, stamp: float, odometry_pose: FloatArray | None) -> Prediction:
        """Expected pose of the next scan, from its stamp and the pose of the odometry at it, if known."""
        step = stamp - self._stamp
        coasting = self._coast(step)
        moved = self._odometry_motion(odometry_pose, step)
        motion = moved if moved is not None else self._turn_by_imu(stamp, coasting)
        alternative = None
        if moved is not None and coasting is not None:
            gap = moved - coasting
            if math.hypot(gap[0], gap[1]) > 0.1 or abs(gap[2]) > 0.06:
                alternative = compose(self._pose, coasting)
        twist = motion / step if _is_usual(step) else np.zeros(3)
        return Prediction(
            compose(self._pose, motion),
            math.hypot(motion[0], motion[1]),
            abs(float(motion[2])),
            twist,
            alternative,
            moved is not None,
            not 0.0 < step < _LONGEST_STEP,
        )

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


def _is_usual(step: float) -> bool:
    """Whether a velocity can be told from two poses so far apart in time, s."""
    return _SHORTEST_STEP < step < _LONGEST_STEP
