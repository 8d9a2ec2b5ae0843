"""What must be known of the sonars in bags before their records can be streamed."""

from collections.abc import Mapping, Sequence
from functools import cached_property, partial

import numpy as np

from glassslam.errors import UsageError
from glassslam.records import FloatArray, SonarRing
from glassslam.sources.bag import RANGE, RANGE_ARRAY, TS_SCAN, Bag, Topic
from glassslam.sources.frames import BASE_FRAMES, guess_base, read_tree
from glassslam.sources.options import SourceOptions
from glassslam.sources.rangesonar import plan_ranges
from glassslam.sources.ringgeometry import ring_behind
from glassslam.sources.rings import load_ring
from glassslam.sources.sonarfeed import NO_SONAR, POINTS_OF, SonarPlan
from glassslam.sources.sonarmessages import array_ranges
from glassslam.sources.sonarsamples import (
    Stretch,
    array_series,
    cloud_series,
    framed_points,
    stretch,
    stretches,
)
from glassslam.sources.sonartopics import is_named, sonar_topics
from glassslam.sources.sweeps import Series, sweep_rule
from glassslam.sources.topics import describe
from glassslam.sources.transforms import TransformTree, frame_name

RING_HINT = "--sonar-ring NAME or FILE says where the sonars sit"

# A cloud of more points comes from another kind of sensor, unless it is named.
_MOST_POINTS = 64


def plan_sonar(
    bags: Sequence[Bag],
    topics: Sequence[Topic],
    transforms: Sequence[Topic],
    base: str,
    options: SourceOptions,
    *,
    required: bool = False,
) -> SonarPlan:
    """Decide how the sonars in bags that are pieces of one recording are read.

    Parameters
    ----------
    bags : sequence of Bag
        The opened files.
    topics : sequence of Topic
        All that was recorded.
    transforms : sequence of Topic
        The tf topics among them.
    base : str
        The base frame; empty when the recording does not name it.
    options : SourceOptions
        The wishes of the user. Without any, sonar that cannot be used costs a warning,
    required : bool
        unless this says that it must be usable.

    Raises
    ------
    UsageError
        The wishes do not fit the recording.
    ConfigError
        The file of the ring describes none.
    """
    seconds = max(0.0, (max(bag.end for bag in bags) - min(bag.start for bag in bags)) / 1e9)
    chosen = sonar_topics(topics, seconds, options)
    ring = None if options.sonar_ring is None else load_ring(options.sonar_ring)
    if not chosen:
        if ring is not None and not options.without_sonar:
            raise UsageError("a sonar ring was named, but there is no sonar in the recording")
        return NO_SONAR
    planner = _Planner(bags, chosen, transforms, base, options, ring, seconds)
    try:
        return planner.run()
    except UsageError as error:
        if required or options.sonar_topics or ring is not None:
            raise
        hint = f" ({error.hint})" if error.hint else ""
        return planner.points_alone(f"sonar is not used: {error.message}{hint}")


class _Planner:
    """The steps of `plan_sonar`, in which warnings gather."""

    def __init__(
        self,
        bags: Sequence[Bag],
        chosen: Sequence[Topic],
        transforms: Sequence[Topic],
        base: str,
        options: SourceOptions,
        ring: SonarRing | None,
        seconds: float,
    ) -> None:
        self._bags, self._chosen, self._base = bags, chosen, base
        self._options, self._ring, self._seconds = options, ring, seconds
        self._transforms = transforms
        self._warnings: list[str] = []
        self._matrices: dict[str, FloatArray] = {}
        self._points: tuple[Topic, ...] = ()

    def run(self) -> SonarPlan:
        ranges = [topic for topic in self._chosen if topic.msgtype == RANGE]
        clouds = {topic: self._clouds(topic) for topic in self._chosen if topic.msgtype in POINTS_OF}
        rings = {topic: self._ring_of(topic, found) for topic, found in clouds.items()}
        arrays = [topic for topic in self._chosen if topic.msgtype == RANGE_ARRAY]
        self._points = tuple(
            topic for topic, found in clouds.items() if self._gives_points(topic, found, rings)
        )
        sweeps = [*(topic for topic in clouds if rings[topic] is not None), *arrays]
        if ranges:
            # What drivers publish beside single ranges is the same again.
            tree, base, ring = self._tree, self._base, self._ring
            wished = bool(self._options.sonar_topics)
            plan = plan_ranges(ranges, partial(stretches, self._bags), tree, base, ring, wished=wished)
            if plan is not None:
                return self._finished(plan.ring, plan)
        if len(sweeps) > 1:
            raise UsageError(
                f"several sonar topics: {describe(sweeps, self._seconds)}", "choose one with --sonar-topic"
            )
        if not sweeps:
            if self._ring is not None:
                raise UsageError(f"no sonar in the recording fits the ring {self._ring.name}", RING_HINT)
            return self._finished(None, NO_SONAR)
        (topic,) = sweeps
        known = rings.get(topic)
        found, series = self._array(topic) if known is None else (known, cloud_series(clouds[topic], known))
        plan = SonarPlan(found, sweep_rule(found, series), (topic,), (), {}, {})
        return self._finished(found, plan)

    def points_alone(self, warning: str) -> SonarPlan:
        """The points that `run` has found before it failed."""
        self._warnings.append(warning)
        return self._finished(None, NO_SONAR)

    @cached_property
    def _tree(self) -> TransformTree:
        return read_tree(self._bags, self._transforms, [])

    def _is_wished(self, topic: Topic) -> bool:
        return is_named(topic, (*self._options.sonar_topics, *self._options.points_topics))

    def _gives_points(
        self, topic: Topic, found: Sequence[Stretch], rings: Mapping[Topic, SonarRing | None]
    ) -> bool:
        """Whether the clouds of a topic are points of a 3D sensor, and wanted."""
        options = self._options
        wanted = not options.points_topics or is_named(topic, options.points_topics)
        return bool(found) and rings[topic] is None and wanted and not options.without_points

    def _finished(self, ring: SonarRing | None, plan: SonarPlan) -> SonarPlan:
        matrices, warnings = self._matrices, tuple(self._warnings)
        return SonarPlan(ring, plan.rule, plan.ring_topics, self._points, plan.sensors, matrices, warnings)

    def _array(self, topic: Topic) -> tuple[SonarRing, list[Series]]:
        """The ring of a topic of plain numbers, which only the user can know."""
        ring = self._ring
        if ring is None:
            raise UsageError(f"{topic.name} does not tell where its sonars sit", RING_HINT)
        series = array_series(stretches(self._bags, topic, array_ranges))
        self._check_size(topic, ring, {ranges.shape[1] for _, ranges in series})
        return ring, series

    def _check_size(self, topic: Topic, ring: SonarRing, sizes: set[int]) -> None:
        if len(ring.poses) not in sizes and sizes:
            raise UsageError(
                f"the ring {ring.name} has {len(ring.poses)} sonars, {topic.name} sends {max(sizes)} ranges",
                "choose another ring with --sonar-ring",
            )

    def _clouds(self, topic: Topic) -> list[Stretch]:
        """Stretches of clouds in the base frame; none when the topic is no sonar."""
        if not self._is_wished(topic) and self._is_dense(topic):
            return []
        moved = []
        for times, framed in stretches(self._bags, topic, partial(framed_points, topic)):
            matrix = self._matrix(topic, framed[0][0])
            # echoes that are not finite are left out when they are due
            with np.errstate(invalid="ignore"):
                moved.append((times, [points @ matrix[:3, :3].T + matrix[:3, 3] for _, points in framed]))
        return moved

    def _is_dense(self, topic: Topic) -> bool:
        """Whether the first cloud of a topic holds more points than any sonar sends."""
        read = partial(framed_points, topic)
        clouds = (stretch(bag, topic, bag.start, bag.end + 1, 1, read)[1] for bag in self._bags)
        first = next((framed[0] for framed in clouds if framed), None)
        return first is None or len(first[1]) > _MOST_POINTS

    def _matrix(self, topic: Topic, frame: str) -> FloatArray:
        """Pose of the frame of a topic in the base frame."""
        if topic.name not in self._matrices:
            name = frame_name(frame)
            base = self._base or guess_base(self._tree, name)
            matrix = self._tree.lookup(base, name)
            if matrix is None or (base == name and name not in (self._base, *BASE_FRAMES)):
                self._warnings.append(
                    f"no transform from {self._base or 'a base frame'} to {name}: {topic.name} is taken to be"
                    " seen from the base"
                )
            self._matrices[topic.name] = np.eye(4) if matrix is None else matrix
        return self._matrices[topic.name]

    def _ring_of(self, topic: Topic, found: Sequence[Stretch]) -> SonarRing | None:
        """The ring behind a topic of clouds; None when they are points of a 3D sensor."""
        if is_named(topic, self._options.points_topics):
            return None
        everything = [cloud for _, clouds in found for cloud in clouds]
        sizes = [len(cloud) for cloud in everything]
        ring = self._ring
        if ring is not None and is_named(topic, self._options.sonar_topics):
            self._check_size(topic, ring, set(sizes))
        if ring is not None and len(ring.poses) == max(set(sizes), key=sizes.count, default=0):
            return ring
        if topic.msgtype == TS_SCAN or len(set(sizes)) != 1 or min(sizes) < 2:
            return None
        return ring_behind(np.array(everything, dtype=np.float32))
