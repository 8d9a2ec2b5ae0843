"""A recording mapped in one call."""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

from glassslam.config import Config, SonarConfig
from glassslam.records import LaserScan, RangeRing, Record, RecordingInfo
from glassslam.sources import SourceOptions, open_recording

if TYPE_CHECKING:
    from glassslam.fusion.listener import SonarListener
    from glassslam.slam.mapper import Mapper
    from glassslam.slam.result import MapResult, OccupancyMap
    from glassslam.sources import Recording

_SECONDS_BETWEEN_REPORTS = 0.1


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a run has come.

    Attributes
    ----------
    stage : {"mapping", "finishing", "done"}
        Reading and matching scans; the last loop closures, optimisation and drawing; nothing more.
    scans : int
        Scans read so far.
    recorded_seconds : float
        Recorded time passed so far, s.
    info : RecordingInfo
        The source; its duration and scan count tell how much there is.
    """

    stage: Literal["mapping", "finishing", "done"]
    scans: int
    recorded_seconds: float
    info: RecordingInfo


ProgressCallback: TypeAlias = Callable[[Progress], None]


def map_recording(
    recording: str | Path | Sequence[str | Path],
    config: Config | None = None,
    *,
    source_options: SourceOptions | None = None,
    progress: ProgressCallback | None = None,
) -> "MapResult":
    """Map a recording from its first to its last scan.

    Parameters
    ----------
    recording : path or sequence of paths
        A bag, mcap or CARMEN log, or several that follow each other.
    config : Config, optional
        Parameters; the defaults when left out.
    source_options : SourceOptions, optional
        Topics, extrinsics and the part of the recording to use.
    progress : callable, optional
        Called with a `Progress` about ten times a second, in the calling thread.

    Returns
    -------
    MapResult
        Map, trajectory, pose graph and statistics; what the source dropped is counted in
        `statistics.messages_dropped`, what it warned of stands in `statistics.warnings`, and what could not
        be read of it in `statistics.damage`.

    Raises
    ------
    RecordingError
        The recording cannot be read, or holds no usable scan (`NoScansError`).
    UsageError
        The options do not fit the recording.

    Examples
    --------
    >>> import glassslam as gs
    >>> result = gs.map_recording("run.bag")  # doctest: +SKIP
    >>> result.trajectory.poses[-1]  # doctest: +SKIP
    array([12.31,  4.02,  1.57])
    >>> gs.write_results(result, "run-map")  # doctest: +SKIP
    """
    run, reporter = _slam(recording, config, source_options, progress)
    result = run.result()
    reporter.tell("done")
    return result


class FinishedRun:
    """SLAM of a recording, from which results can be drawn several times with other parameters of the sonars.

    Parameters
    ----------
    mapper : Mapper
        The mapper, finished.
    sonar : SonarListener or None
        Sweeps of the recording; None where it has none.
    source : Recording
        The source, read to its end.

    Examples
    --------
    >>> import glassslam as gs
    >>> run = gs.run_slam("run.bag")  # doctest: +SKIP
    >>> sides = run.result(run.config.sonar.model_copy(update={"pose_kind": "Loc"}))  # doctest: +SKIP
    """

    def __init__(self, mapper: "Mapper", sonar: "SonarListener | None", source: "Recording") -> None:
        self._mapper, self._sonar, self._source = mapper, sonar, source

    @property
    def config(self) -> Config:
        """The configuration of the run."""
        return self._mapper.config

    def returns_map(self) -> "OccupancyMap":
        """Map of the lidar in which beams without echo clear nothing."""
        return self._mapper.returns_map()

    def result(
        self, sonar: SonarConfig | None = None, lidar_map: "OccupancyMap | None" = None
    ) -> "MapResult":
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
        listener = self._sonar
        if listener is None:
            result = self._mapper.drawn(self._source.info)
        else:
            listener = listener if sonar is None else listener.with_config(sonar)
            result = self._mapper.drawn(self._source.info, [listener.glass])
            result = listener.joined(result if lidar_map is None else replace(result, lidar_map=lidar_map))
        result.statistics.messages_dropped.update(self._source.dropped)
        result.statistics.damage.extend(self._source.damage)
        result.statistics.warnings[:0] = self._source.warnings
        return result


def run_slam(
    recording: str | Path | Sequence[str | Path],
    config: Config | None = None,
    *,
    source_options: SourceOptions | None = None,
    progress: ProgressCallback | None = None,
) -> FinishedRun:
    """Localise and map a recording, and leave the drawing of results to the caller.

    Parameters
    ----------
    recording, config, source_options, progress
        As for `map_recording`.

    Raises
    ------
    RecordingError
        The recording cannot be read, or holds no usable scan (`NoScansError`).
    UsageError
        The options do not fit the recording.
    """
    run, reporter = _slam(recording, config, source_options, progress)
    reporter.tell("done")
    return run


class _Reporter:
    """Counts scans and calls the callback now and then."""

    def __init__(self, callback: ProgressCallback | None, info: RecordingInfo) -> None:
        self._callback, self._info = callback, info
        self._first, self._last, self._due = 0.0, 0.0, 0.0
        self.scans = 0

    def count(self, scan: LaserScan) -> None:
        # Stamps may step back; recorded time does not.
        self._first, self._last = (
            (self._first, max(self._last, scan.stamp)) if self.scans else (scan.stamp, scan.stamp)
        )
        self.scans += 1
        if time.monotonic() >= self._due:
            self.tell("mapping")
            self._due = time.monotonic() + _SECONDS_BETWEEN_REPORTS

    def tell(self, stage: Literal["mapping", "finishing", "done"]) -> None:
        if self._callback is not None:
            self._callback(Progress(stage, self.scans, self._last - self._first, self._info))


def _slam(
    recording: str | Path | Sequence[str | Path],
    config: Config | None,
    source_options: SourceOptions | None,
    progress: ProgressCallback | None,
) -> tuple[FinishedRun, _Reporter]:
    paths = [recording] if isinstance(recording, str | Path) else list(recording)
    source = open_recording(paths, source_options or SourceOptions())
    # The kernels are loaded only now: a recording that cannot be read is told at once.
    from glassslam.slam.mapper import Mapper  # noqa: PLC0415

    config = config or Config()
    mapper = Mapper(config, source.info.base_from_laser)
    sonar = _listener(source, config)
    reporter = _Reporter(progress, source.info)
    try:
        _feed(mapper, sonar, _filtered(source, config), reporter)
        reporter.tell("finishing")
        mapper.settle()
    finally:
        mapper.close()
    return FinishedRun(mapper, sonar, source), reporter


def _listener(source: "Recording", config: Config) -> "SonarListener | None":
    """What collects the sonar of a recording; None where it has none."""
    if source.info.sonar_ring is None:
        return None
    from glassslam.fusion.listener import SonarListener  # noqa: PLC0415  (only for recordings with sonar)

    return SonarListener(source.info.sonar_ring, config.sonar)


def _filtered(source: "Recording", config: Config) -> Iterator[Record]:
    """The records, with the scans corrected by sonar where the configuration asks for it."""
    ring = source.info.sonar_ring
    if ring is None or not config.sonar.scan_filter.enabled:
        return source.records()
    from glassslam.fusion.filter_stream import filtered_records  # noqa: PLC0415

    place = np.array(source.info.base_from_laser)
    return filtered_records(source.records(), place, ring, config.sonar.scan_filter)


def _feed(
    mapper: "Mapper", sonar: "SonarListener | None", records: Iterator[Record], reporter: _Reporter
) -> None:
    for record in records:
        if isinstance(record, RangeRing):
            if sonar is not None:
                sonar.add(record)
            continue
        mapper.add(record)
        if isinstance(record, LaserScan):
            reporter.count(record)
