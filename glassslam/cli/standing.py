"""Whether a robot of which no trajectory is given stands, as far as its odometry tells."""

import math
from collections.abc import Iterable, Iterator

from glassslam.geometry import wrap_angle
from glassslam.records import Odometry, Record

# wheels that stand count a step now and then, and arms of robots shake them
_FAR, _TURNED = 0.1, math.radians(5.0)


class Standing:
    """Follows the odometry of a recording while others read it.

    Examples
    --------
    >>> robot = Standing()
    >>> ways = [Odometry(0.0, (0.0, 0.0, 0.0)), Odometry(1.0, (2.5, 0.0, 0.0))]
    >>> len(list(robot.watched(ways))), robot.farthest
    (2, 2.5)
    """

    def __init__(self) -> None:
        self._start: tuple[float, float, float] | None = None
        self.farthest, self.turned = 0.0, 0.0

    def watched(self, records: Iterable[Record]) -> Iterator[Record]:
        """The records as they come."""
        for record in records:
            if isinstance(record, Odometry) and all(map(math.isfinite, record.pose)):
                self._add(record.pose)
            yield record

    def _add(self, pose: tuple[float, float, float]) -> None:
        x, y, theta = self._start = self._start or pose
        self.farthest = max(self.farthest, math.hypot(pose[0] - x, pose[1] - y))
        self.turned = max(self.turned, abs(float(wrap_angle(pose[2] - theta))))

    @property
    def warnings(self) -> list[str]:
        """That the robot was moving; empty where it stood, or nothing tells."""
        if self.farthest <= _FAR and self.turned <= _TURNED:
            return []
        motion = f"{self.farthest:.1f} m" if self.farthest > _FAR else f"{math.degrees(self.turned):.0f} deg"
        return [
            f"by its odometry the robot moves {motion}, and all was placed as if it stood at the origin: "
            "give its poses with --trajectory, as map writes them"
        ]
