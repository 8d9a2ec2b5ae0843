"""SLAM of a recording that is done: results are drawn from it, once or several times."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from glassslam.config import Config, SonarConfig
from glassslam.records import Damage, PointSet, RangeRing, RecordingInfo
from glassslam.slam.result import MapResult, OccupancyMap, RunStatistics
from glassslam.slam.settled import SettledRun, draw, returns_map


@dataclass(frozen=True, slots=True)
class SourceFacts:
    """What is to be told of a recording that was read.

    Attributes
    ----------
    info : RecordingInfo
        The source.
    dropped : dict
        Reason -> messages that could not become records.
    damage : tuple of Damage
        What could not be read.
    warnings : tuple of str
        What a user should know, one line each.
    """

    info: RecordingInfo
    dropped: dict[str, int]
    damage: tuple[Damage, ...] = ()
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class FinishedRun:
    """Poses of a recording and all it holds beside scans, from which results are drawn.

    Attributes
    ----------
    settled : SettledRun
        Nodes, poses and glass of the lidar.
    facts : SourceFacts
        The recording.
    sweeps : sequence of RangeRing
        Sweeps of the sonars, in the order of the recording.
    points : sequence of PointSet
        Points of 3D ultrasonic sensors, in the order of the recording.
    is_whole : bool
        Whether the recording was read to its end.

    Examples
    --------
    >>> import glassslam as gs
    >>> run = gs.run_slam("run.bag")  # doctest: +SKIP
    >>> sides = run.result(run.config.sonar.model_copy(update={"pose_kind": "Loc"}))  # doctest: +SKIP
    """

    settled: SettledRun
    facts: SourceFacts
    sweeps: Sequence[RangeRing] = ()
    points: Sequence[PointSet] = ()
    is_whole: bool = True

    @property
    def config(self) -> Config:
        """The configuration of the run."""
        return self.settled.config

    def with_config(self, config: Config) -> "FinishedRun":
        """The same run to be drawn with other parameters; those of SLAM have no effect here."""
        return replace(self, settled=replace(self.settled, config=config))

    def returns_map(self) -> OccupancyMap:
        """Map of the lidar in which beams without echo clear nothing."""
        return returns_map(self.settled)

    def result(self, sonar: SonarConfig | None = None, lidar_map: OccupancyMap | None = None) -> MapResult:
        """Map, trajectory and statistics of the run.

        Parameters
        ----------
        sonar : SonarConfig, optional
            Parameters of the sonars in place of those of the run; its `scan_filter` acts before SLAM and has
            no effect here.
        lidar_map : OccupancyMap, optional
            What the rules that join two maps take for the map of the lidar.

        Raises
        ------
        GridError
            A sweep with another number of ranges than the ring has sonars.
        """
        result = self._with_volume(self._drawn(sonar or self.config.sonar, lidar_map))
        return replace(result, statistics=self._told(result.statistics))

    def _drawn(self, sonar: SonarConfig, lidar_map: OccupancyMap | None) -> MapResult:
        info = self.facts.info
        if info.sonar_ring is None:
            return draw(self.settled, info)
        from glassslam.fusion.listener import SonarListener  # noqa: PLC0415  (only recordings with sonar)

        listener = SonarListener(info.sonar_ring, sonar, self.sweeps)
        result = draw(self.settled, info, [listener.glass])
        return listener.joined(result if lidar_map is None else replace(result, lidar_map=lidar_map))

    def _with_volume(self, result: MapResult) -> MapResult:
        if not self.points:
            return result
        from glassslam.volume.listener import VolumeListener  # noqa: PLC0415  (only recordings with points)

        height = self.facts.info.laser_height
        return VolumeListener(self.config.volume, self.points, height).joined(result)

    def _told(self, statistics: RunStatistics) -> RunStatistics:
        """The statistics of SLAM with what is to be told of the source."""
        facts = self.facts
        return replace(
            statistics,
            messages_dropped={**statistics.messages_dropped, **facts.dropped},
            damage=[*statistics.damage, *facts.damage],
            warnings=[*facts.warnings, *statistics.warnings],
        )
