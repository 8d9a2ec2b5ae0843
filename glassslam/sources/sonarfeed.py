"""Sonar messages of a bag become records."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeAlias

import numpy as np

from glassslam.records import Float32Array, FloatArray, PointSet, RangeRing, SonarRing
from glassslam.sources.bag import CLOUD, CLOUD2, RANGE, RANGE_ARRAY, TS_SCAN, Topic
from glassslam.sources.messages import UnusableMessageError, stamp_of
from glassslam.sources.ringgeometry import ring_ranges
from glassslam.sources.sonarmessages import (
    array_ranges,
    cloud2_points,
    cloud_points,
    range_limits,
    scan_points,
)
from glassslam.sources.sweeps import SweepFilter, SweepRule
from glassslam.sources.transforms import frame_name

OTHER_SIZE = "sonar message with another number of readings than the ring has"
STRANGE_SONAR = "range of a sonar that is not in the ring"

SensorKey: TypeAlias = tuple[str, str]
SonarRecord: TypeAlias = RangeRing | PointSet
ReadSonar: TypeAlias = Callable[[Any, int], Sequence[SonarRecord]]

POINTS_OF: Mapping[str, Callable[[Any], Float32Array]] = {
    CLOUD: cloud_points,
    CLOUD2: cloud2_points,
    TS_SCAN: scan_points,
}


@dataclass(frozen=True, slots=True)
class SonarPlan:
    """How the sonar topics of a bag are read.

    Attributes
    ----------
    ring : SonarRing or None
        The ring, where there is one.
    rule : SweepRule or None
        How its ranges are read.
    ring_topics, point_topics : tuple of Topic
        Topics of the ring, and of 3D sensors.
    sensors : mapping
        (topic, frame) of a sensor_msgs/Range -> place in the ring.
    base_from_frame : mapping
        Topic -> pose of its frame in the base frame, shape (4, 4).
    warnings : tuple of str
        What a user should know.
    """

    ring: SonarRing | None
    rule: SweepRule | None
    ring_topics: tuple[Topic, ...]
    point_topics: tuple[Topic, ...]
    sensors: Mapping[SensorKey, int]
    base_from_frame: Mapping[str, FloatArray]
    warnings: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all topics in use."""
        return tuple(topic.name for topic in (*self.ring_topics, *self.point_topics))

    @property
    def points_names(self) -> tuple[str, ...]:
        """Names of the topics of 3D sensors."""
        return tuple(topic.name for topic in self.point_topics)

    def uses(self, topic: Topic) -> bool:
        """Whether messages of a topic are read."""
        used = (*self.ring_topics, *self.point_topics)
        return any((other.name, other.msgtype) == (topic.name, topic.msgtype) for other in used)


NO_SONAR = SonarPlan(None, None, (), (), {}, {})


@dataclass(slots=True)
class _OpenSweep:
    """Ranges of one stamp, of which more may follow."""

    stamp: float
    record_ns: int
    ranges: Float32Array
    told: set[int]


class SonarFeed:
    """Reads the messages of one pass; remembers what each sonar last said.

    Single ranges of one and the same stamp become one sweep, which is complete when a range of another stamp
    comes, or when `flush` is called.

    Parameters
    ----------
    plan : SonarPlan
        How they are read.
    """

    def __init__(self, plan: SonarPlan) -> None:
        self._plan = plan
        self._size = 0 if plan.ring is None else len(plan.ring.poses)
        self._filter = None if plan.rule is None else SweepFilter(plan.rule, self._size)
        self._open: _OpenSweep | None = None

    def reader(self, topic: Topic) -> ReadSonar:
        """The function from a decoded message and its record time (ns) to the records complete with it.

        It raises `UnusableMessageError` for a message that cannot become one.
        """
        if topic.name in {other.name for other in self._plan.point_topics}:
            return partial(self._points, topic)
        if topic.msgtype == RANGE:
            return partial(self._range, topic)
        return partial(self._sweep, topic)

    def flush(self) -> Sequence[SonarRecord]:
        """The sweep that still waits for ranges, if there is one."""
        sweep, self._open = self._open, None
        return () if sweep is None else (self._ring(sweep.stamp, sweep.ranges, sweep.record_ns),)

    def _range(self, topic: Topic, message: Any, record_ns: int) -> Sequence[SonarRecord]:
        place = self._plan.sensors.get((topic.name, frame_name(message.header.frame_id)))
        if place is None:
            raise UnusableMessageError(STRANGE_SONAR)
        stamp, value = stamp_of(message.header, record_ns), limited_range(message)
        sweep = self._open
        complete: Sequence[SonarRecord] = ()
        if sweep is None or sweep.stamp != stamp or place in sweep.told:
            complete = self.flush()
            sweep = _OpenSweep(stamp, record_ns, np.full(self._size, np.nan, dtype=np.float32), set())
            self._open = sweep
        sweep.ranges[place] = value
        sweep.told.add(place)
        return complete

    def _sweep(self, topic: Topic, message: Any, record_ns: int) -> Sequence[SonarRecord]:
        ring = self._plan.ring
        if topic.msgtype == RANGE_ARRAY:
            stamp, ranges = record_ns / 1e9, array_ranges(message)
        else:
            stamp = stamp_of(message.header, record_ns)
            points = self._in_base(topic, POINTS_OF[topic.msgtype](message))
            same = ring is not None and len(points) == len(ring.poses)
            ranges = ring_ranges(points, ring.poses) if ring is not None and same else points[:, 0]
        if ring is None or len(ranges) != len(ring.poses):
            raise UnusableMessageError(OTHER_SIZE)
        return (self._ring(stamp, ranges, record_ns),)

    def _ring(self, stamp: float, ranges: Float32Array, record_ns: int) -> RangeRing:
        readings = ranges if self._filter is None else self._filter.read(stamp, ranges)
        return RangeRing(stamp, readings, record_ns / 1e9)

    def _points(self, topic: Topic, message: Any, record_ns: int) -> Sequence[SonarRecord]:
        points = POINTS_OF[topic.msgtype](message)
        points = self._in_base(topic, points[np.all(np.isfinite(points), axis=1)])
        matrix = self._plan.base_from_frame[topic.name]
        origin, (x, y, z) = matrix[:3, 3].copy(), matrix[:3, 0].tolist()
        return (PointSet(stamp_of(message.header, record_ns), points, origin, record_ns / 1e9, (x, y, z)),)

    def _in_base(self, topic: Topic, points: Float32Array) -> Float32Array:
        matrix = self._plan.base_from_frame[topic.name]
        # a mount as far away as a transform can say is no number any more in single precision
        with np.errstate(over="ignore", invalid="ignore"):
            return np.asarray(points @ matrix[:3, :3].T + matrix[:3, 3], dtype=np.float32)


def limited_range(message: Any) -> float:
    """Range of a sensor_msgs/Range, m: +inf from its maximum on, NaN below its minimum.

    Raises
    ------
    UnusableMessageError
        Its limits make no sense.
    """
    _, near, far = range_limits(message)
    value = float(message.range)
    return np.inf if value >= far else value if value >= near else np.nan
