"""A recording looked over: everything a user wants to know before mapping it."""

from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from glassslam.errors import NoScansError, RecordingError, UsageError
from glassslam.records import PointSet, RangeRing, Record, SonarRing
from glassslam.sources.formats import Piece, resolve
from glassslam.sources.observers import gather
from glassslam.sources.options import SourceOptions
from glassslam.sources.recording import Recording, open_recording
from glassslam.sources.report import Plan, RecordingReport
from glassslam.sources.sonarfile import SonarFile, open_sonar
from glassslam.sources.sonarobserver import SonarObserver
from glassslam.sources.sonarreport import SonarReport
from glassslam.sources.sweeps import SweepRule


def inspect_recording(
    paths: str | Path | Sequence[str | Path], options: SourceOptions | None = None
) -> RecordingReport:
    """Read a recording from end to end and report on it.

    Parameters
    ----------
    paths : path or sequence of paths
        As for `open_recording`.
    options : SourceOptions, optional
        What would be said to `map`.

    Returns
    -------
    RecordingReport
        Topics, times, geometry, ranges, intensities, frames, sonar, and what a map would be made from.

    Raises
    ------
    RecordingError
        A file is missing, empty or foreign; or damaged, and nothing is readable or `strict` was said.
    """
    pieces = resolve([paths] if isinstance(paths, str | Path) else list(paths))
    chosen = SourceOptions() if options is None else options
    recording, plan = _plan(pieces, chosen)
    if recording is not None:
        report = _report(pieces, plan, tuple(recording.warnings), strict=chosen.strict)
        return replace(report, sonars=_of_recording(recording))
    sonars, warnings = _of_files([piece.path for piece in pieces], chosen)
    return replace(_report(pieces, plan, (), strict=chosen.strict), sonars=sonars, warnings=warnings)


def _report(
    pieces: Sequence[Piece], plan: Plan, warnings: tuple[str, ...], *, strict: bool
) -> RecordingReport:
    if pieces[0].format == "pimap":
        from glassslam.sources.pimapinspection import inspect_pimap  # noqa: PLC0415

        return inspect_pimap(pieces, plan, strict=strict)
    if pieces[0].format == "carmen":
        from glassslam.sources.carmeninspection import inspect_carmen  # noqa: PLC0415  (loads kernels)

        return inspect_carmen(pieces, plan, warnings)
    if pieces[0].format == "player":
        from glassslam.sources.playerinspection import inspect_player  # noqa: PLC0415  (loads kernels)

        return inspect_player(pieces, plan, warnings)
    from glassslam.sources.baginspection import BagInspection  # noqa: PLC0415  (loads rosbags)

    return BagInspection(pieces, strict=strict).run(plan, warnings)


def _plan(pieces: Sequence[Piece], options: SourceOptions) -> tuple[Recording | None, Plan]:
    """The recording as `map` would open it, where it would, and what it would use."""
    try:
        recording = open_recording([piece.path for piece in pieces], options)
    except (UsageError, NoScansError) as error:
        return None, Plan(problem=error.message, hint=error.hint)
    info = recording.info
    plan = Plan(
        scan_topic=info.scan_topic,
        odom_topic=info.odom_topic,
        imu_topic=info.imu_topic,
        base_from_laser=info.base_from_laser,
        sonar_topics=info.sonar_topics,
        sonar_ring=ring_title(info.sonar_ring),
        points_topics=info.points_topics,
        laser_height=info.laser_height,
    )
    return recording, plan


def ring_title(ring: SonarRing | None) -> str:
    """What a ring is called; empty without one."""
    return "" if ring is None else ring.name or "as recorded"


def _of_recording(recording: Recording) -> tuple[SonarReport, ...]:
    """What the sonars of a recording say; they cost a second reading, and only where there are any."""
    info = recording.info
    if not info.sonar_topics:
        return ()
    rule = recording.sonar_rule
    observers = _observers(info.sonar_topics, info.points_topics, info.sonar_ring, rule)
    with suppress(NoScansError):
        _observe(observers, recording.records())
    return gather(observer.report() for observer in observers)


def _of_files(
    paths: Sequence[Path], options: SourceOptions
) -> tuple[tuple[SonarReport, ...], tuple[str, ...]]:
    """What the sonars say in files that `map` could not use, and why they say nothing."""
    found: list[SonarReport] = []
    warnings: list[str] = []
    for path in paths if options.sonar is None else [options.sonar]:
        try:
            file = open_sonar(path, options)
        except UsageError as error:
            warnings.append(f"sonar is not used: {error.message}" + (error.hint and f" ({error.hint})"))
        except RecordingError:  # no sonar in it, of which the plan says nothing either
            continue
        else:
            found.extend(_of_file(file))
            warnings.extend(file.warnings)
    return tuple(found), tuple(warnings)


def _of_file(file: SonarFile) -> tuple[SonarReport, ...]:
    observers = _observers(file.topics, file.points_topics, file.ring, file.rule)
    _observe(observers, file.records(lambda _: None))
    return gather(observer.report() for observer in observers)


def _observers(
    topics: Sequence[str], points: Sequence[str], ring: SonarRing | None, rule: SweepRule | None
) -> list[SonarObserver]:
    """One observer for the ring, one for 3D sensors."""
    of_points = SonarObserver(points, None, rule)
    if ring is None:
        return [of_points]
    swept = [topic for topic in topics if topic not in points]
    return [SonarObserver(swept, ring, rule), of_points]


def _observe(observers: Sequence[SonarObserver], records: Iterable[Record]) -> None:
    for record in records:
        if isinstance(record, RangeRing | PointSet):
            for observer in observers:
                observer.add(record)
