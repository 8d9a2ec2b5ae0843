"""A recording mapped in one call."""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

from glassslam.config import Config
from glassslam.finished import FinishedRun, SourceFacts
from glassslam.records import LaserScan, PointSet, RangeRing, Record, RecordingInfo
from glassslam.sources import SourceOptions, open_recording

if TYPE_CHECKING:
    from glassslam.session import Session
    from glassslam.slam.result import MapResult
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
    session: "Session | None" = None,
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
    session : Session, optional
        Where the run is written down as it goes; a session that knows a part of it already is gone on with.

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
    run = run_slam(recording, config, source_options=source_options, progress=progress, session=session)
    return run.result()


def run_slam(
    recording: str | Path | Sequence[str | Path],
    config: Config | None = None,
    *,
    source_options: SourceOptions | None = None,
    progress: ProgressCallback | None = None,
    session: "Session | None" = None,
) -> FinishedRun:
    """Localise and map a recording, and leave the drawing of results to the caller.

    Parameters
    ----------
    recording, config, source_options, progress, session
        As for `map_recording`.

    Raises
    ------
    RecordingError
        The recording cannot be read, or holds no usable scan (`NoScansError`).
    UsageError
        The options do not fit the recording.
    """
    paths = [recording] if isinstance(recording, str | Path) else list(recording)
    source = open_recording(paths, source_options or SourceOptions())
    return RunInProgress(source, config, progress=progress, session=session).finished()


class _Reporter:
    """Counts scans and calls the callback now and then."""

    def __init__(self, callback: ProgressCallback | None, info: RecordingInfo) -> None:
        self._callback, self._info = callback, info
        self._first, self._last, self._due = 0.0, 0.0, 0.0
        self.scans = 0

    @property
    def recorded_seconds(self) -> float:
        return self._last - self._first

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
            self._callback(Progress(stage, self.scans, self.recorded_seconds, self._info))


@dataclass(slots=True)
class _Others:
    """Records beside those of the mapper, kept until poses are known."""

    sweeps: list[RangeRing] = field(default_factory=list)
    points: list[PointSet] = field(default_factory=list)


class RunInProgress:
    """SLAM of a recording, which another thread or a signal may bring to an early end.

    Parameters
    ----------
    source : Recording
        The recording, opened.
    config, progress, session
        As for `map_recording`.
    names : sequence of str, optional
        Names of the recordings for the report, where they are not their paths.
    """

    def __init__(
        self,
        source: "Recording",
        config: Config | None = None,
        *,
        progress: ProgressCallback | None = None,
        session: "Session | None" = None,
        names: Sequence[str] | None = None,
    ) -> None:
        # The kernels are loaded only now: a recording that cannot be read is told at once.
        from glassslam.slam.mapper import Mapper  # noqa: PLC0415

        self._source, self._config, self._session = source, config or Config(), session
        info = source.info
        self._info = info if names is None else replace(info, paths=tuple(names))
        journal = None if session is None else session.journal
        self._mapper = Mapper(self._config, info.base_from_laser, journal)
        self._others = _Others()
        self._reporter = _Reporter(progress, self._info)

    @property
    def scans(self) -> int:
        """Scans read so far."""
        return self._reporter.scans

    @property
    def recorded_seconds(self) -> float:
        """Recorded time passed so far, s."""
        return self._reporter.recorded_seconds

    def hurry(self) -> None:
        """End soon with what there is; from any thread, and from a handler of signals."""
        self._mapper.hurry()

    def finished(self) -> FinishedRun:
        """Read the recording to its end, or until told to hurry, close the last loops and optimise.

        Raises
        ------
        RecordingError
            The recording cannot be read, or holds no usable scan (`NoScansError`).
        OutputError
            The session cannot be written.
        """
        try:
            self._feed(_filtered(self._source, self._config))
            if self._session is not None:
                self._session.journal.flush()
            self._reporter.tell("finishing")
            settled = self._mapper.settle()
        finally:
            self._mapper.close()
        run = FinishedRun(
            settled, self._facts(), self._others.sweeps, self._others.points, not self._mapper.is_hurried
        )
        if self._session is not None and run.is_whole:
            self._session.save(run)
        self._reporter.tell("done")
        return run

    def _feed(self, records: Iterator[Record]) -> None:
        for record in records:
            if self._mapper.is_hurried:
                return
            if isinstance(record, RangeRing):
                self._others.sweeps.append(record)
            elif isinstance(record, PointSet):
                self._others.points.append(record)
            else:
                self._mapper.add(record)
            if isinstance(record, LaserScan):
                self._reporter.count(record)

    def _facts(self) -> SourceFacts:
        source = self._source
        return SourceFacts(self._info, dict(source.dropped), tuple(source.damage), tuple(source.warnings))


def _filtered(source: "Recording", config: Config) -> Iterator[Record]:
    """The records, with the scans corrected by sonar where the configuration asks for it."""
    ring = source.info.sonar_ring
    if ring is None or not config.sonar.scan_filter.enabled:
        return source.records()
    from glassslam.fusion.filter_stream import filtered_records  # noqa: PLC0415

    place = np.array(source.info.base_from_laser)
    return filtered_records(source.records(), place, ring, config.sonar.scan_filter)
