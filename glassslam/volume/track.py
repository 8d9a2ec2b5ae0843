"""Where the robot was at any time of a given trajectory."""

import numpy as np

from glassslam.geometry import between, interpolate
from glassslam.records import FloatArray, Trajectory

_SLACK = 0.5
_STEP = 0.05
_LONGEST_GAP = 3.0
_STANDING_M, _STANDING_RAD = 0.1, 0.05


class Track:
    """A trajectory as a function of time, heading along the shorter arc.

    A trajectory of one pose is that of a robot that stands. Otherwise nothing is known more than half a
    second before the first or after the last pose; within that time these are held. Gaps of more than three
    seconds end and begin a trajectory as well, unless the robot stands still meanwhile.

    Parameters
    ----------
    trajectory : Trajectory
        Poses in any order, at least one.
    """

    def __init__(self, trajectory: Trajectory) -> None:
        order = np.argsort(trajectory.stamps, kind="stable")
        self._stamps, self._poses = trajectory.stamps[order], trajectory.poses[order]

    def at(self, stamp: float) -> FloatArray | None:
        """Pose (3,) at a time, or None where nothing is known."""
        stamps = self._stamps
        if stamps.size == 1:
            return np.array(self._poses[0])
        if not stamps[0] - _SLACK <= stamp <= stamps[-1] + _SLACK:
            return None
        k = int(np.searchsorted(stamps, stamp).clip(1, stamps.size - 1))
        gap = stamps[k] - stamps[k - 1]
        if gap > _LONGEST_GAP and self._moves(k):
            near = k - 1 if stamp - stamps[k - 1] < stamps[k] - stamp else k
            return np.array(self._poses[near]) if abs(stamp - stamps[near]) <= _SLACK else None
        fraction = (stamp - stamps[k - 1]) / gap if gap > 0.0 else 0.0
        return interpolate(self._poses[k - 1], self._poses[k], min(max(fraction, 0.0), 1.0))

    def _moves(self, k: int) -> bool:
        """Whether the robot has moved from the pose before to pose k."""
        x, y, turn = np.abs(between(self._poses[k - 1], self._poses[k])).tolist()
        return bool(max(x, y) > _STANDING_M or turn > _STANDING_RAD)

    def twist_at(self, stamp: float) -> FloatArray:
        """Velocity (3,) of the base in its own frame, m/s and rad/s; zero where it is not known."""
        before, after = self.at(stamp - 0.5 * _STEP), self.at(stamp + 0.5 * _STEP)
        if before is None or after is None:
            return np.zeros(3)
        return between(before, after) / _STEP
