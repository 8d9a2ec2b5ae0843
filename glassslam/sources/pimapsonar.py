"""The sonar log of a pi-map scene as a file of readings."""

from collections.abc import Iterator
from pathlib import Path

from glassslam.errors import RecordingError, UsageError
from glassslam.records import Damage, RangeRing
from glassslam.sources.carmenlines import UNREADABLE_LINE
from glassslam.sources.options import SourceOptions
from glassslam.sources.pimap import POSE_VALUES, read_pimap
from glassslam.sources.rings import load_ring
from glassslam.sources.sonarfile import Drop, SonarFile
from glassslam.sources.sweeps import SweepFilter, sweep_rule
from glassslam.sources.textlines import single

TOPIC = "pi-map sonar"

# The robot of that data.
_RING = "pioneer-3dx"


class PimapSonarFile(SonarFile):
    """Sweeps of a pi-map text log; see `SonarFile`.

    Raises
    ------
    RecordingError
        The file cannot be read, or holds poses.
    UsageError
        The ring has another number of sonars, or a topic is named.
    """

    def __init__(self, path: Path, options: SourceOptions) -> None:
        log = read_pimap(path, strict=options.strict)
        self._times, self._ranges = log.sweep_times, single(log.values)
        self._dropped, self._damage = log.dropped, log.damage
        count = self._ranges.shape[1]
        if count == POSE_VALUES:
            raise RecordingError(f"{path} holds poses, not ranges", "name the file that ends in _sonar.txt")
        if options.sonar_topics or options.points_topics:
            named = "--sonar-topic" if options.sonar_topics else "--points-topic"
            raise UsageError(f"{path} has no topics", f"leave out {named}")
        ring = load_ring(options.sonar_ring or _RING)
        if len(ring.poses) != count:
            raise UsageError(
                f"the ring {ring.name} has {len(ring.poses)} sonars, {path} holds {count} ranges a line",
                "choose another ring with --sonar-ring",
            )
        self.path, self.ring, self.topics = path, ring, (TOPIC,)
        self.span = float(self._times[0]), float(self._times[-1])
        self._rule = sweep_rule(ring, [(self._times, self._ranges)])
        self.rule = self._rule

    @property
    def damage(self) -> tuple[Damage, ...]:
        """What could not be read."""
        return self._damage

    def records(self, drop: Drop) -> Iterator[RangeRing]:
        """Sweeps in the order of the file."""
        for _ in range(self._dropped):
            drop(UNREADABLE_LINE)
        filtered = SweepFilter(self._rule, self._ranges.shape[1])
        for time, ranges in zip(self._times.tolist(), self._ranges, strict=True):
            yield RangeRing(time, filtered.read(time, ranges), time)
