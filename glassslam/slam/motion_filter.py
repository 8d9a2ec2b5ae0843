"""The motion filter: which scans become nodes."""

import math

from glassslam.config import MotionFilterConfig
from glassslam.geometry import between
from glassslam.records import FloatArray


class MotionFilter:
    """Lets a scan through after enough travel, turn or time."""

    def __init__(self, config: MotionFilterConfig) -> None:
        self._config = config
        self._stamp = -math.inf
        self._pose: FloatArray | None = None

    def admits(self, stamp: float, pose: FloatArray) -> bool:
        """Whether the scan at a pose (3,) becomes a node; if so it is the new reference."""
        if self._pose is not None:
            motion = between(self._pose, pose)
            if (
                math.hypot(motion[0], motion[1]) < self._config.max_distance
                and abs(motion[2]) < math.radians(self._config.max_angle_deg)
                and abs(stamp - self._stamp) < self._config.max_time
            ):
                return False
        self._stamp, self._pose = stamp, pose
        return True
