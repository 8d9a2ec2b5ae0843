"""The sonar log of a pi-map scene as a file of readings."""

from collections.abc import Iterator
from pathlib import Path

from glassslam.errors import RecordingError, UsageError
from glassslam.records import RangeRing
from glassslam.sources.options import SourceOptions
from glassslam.sources.pimap import POSE_VALUES, read_pimap_sonar
from glassslam.sources.rings import load_ring
from glassslam.sources.sonarfile import Drop, SonarFile
from glassslam.sources.sweeps import SweepFilter, sweep_rule

TOPIC = "pi-map sonar"

# The robot of that data.
_RING = "pioneer-3dx"


class PimapSonarFile(SonarFile):
    """Sweeps of a pi-map text log; see `SonarFile`.

    Raises
    ------
    RecordingError
        The file is damaged, or holds poses.
    UsageError
        The ring has another number of sonars, or a topic is named.
    """

    def __init__(self, path: Path, options: SourceOptions) -> None:
        self._times, self._ranges = read_pimap_sonar(path)
        count = self._ranges.shape[1]
        if count == POSE_VALUES:
            raise RecordingError(f"{path} holds poses, not ranges", "name the file that ends in _sonar.txt")
        if options.sonar_topics:
            raise UsageError(f"{path} has no topics", "leave out --sonar-topic")
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

    def records(self, drop: Drop) -> Iterator[RangeRing]:  # noqa: ARG002  (nothing is dropped)
        """Sweeps in the order of the file."""
        filtered = SweepFilter(self._rule, self._ranges.shape[1])
        for time, ranges in zip(self._times.tolist(), self._ranges, strict=True):
            yield RangeRing(time, filtered.read(time, ranges), time)
