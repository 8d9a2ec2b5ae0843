"""Carrying out a run: written down in a working directory, interruptible, taken up where it ended."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from glassslam.cli.endings import explained_end, given_up_where_it_fails, way_out_told
from glassslam.cli.interruption import Bell, stopping
from glassslam.cli.workplace import (
    check_apart,
    check_own,
    check_room,
    clear_but_session,
    is_replacing,
    made_directory,
    named_target,
    session_path,
)
from glassslam.errors import InterruptedRunError, NoScansError, OutputError, SessionError

if TYPE_CHECKING:
    from glassslam.config import Config
    from glassslam.finished import FinishedRun
    from glassslam.outputs import Stopwatch
    from glassslam.session import Session
    from glassslam.sources import Recording, SourceOptions


@dataclass(frozen=True, slots=True)
class Manner:
    """How a command tells of its run.

    Attributes
    ----------
    stopwatch : Stopwatch
        Started with the command.
    json, quiet : bool
        Whether the report is printed as JSON; whether nothing is printed.
    """

    stopwatch: "Stopwatch"
    json: bool = False
    quiet: bool = False


def begin(
    recordings: Sequence[Path],
    target: Path,
    config: "Config",
    options: "SourceOptions",
    *,
    overwrite: bool,
    manner: Manner,
) -> int:
    """Map recordings into a results directory; the exit code.

    Raises
    ------
    UsageError
        There is a run for that directory which was not finished.
    InterruptedRunError
        A signal came; the run can be taken up again.
    """
    from glassslam.outputs.directory import (  # noqa: PLC0415
        check_directory,
        restore_results,
        working_directory,
    )
    from glassslam.outputs.lock import locked  # noqa: PLC0415
    from glassslam.session import SESSION_FILE, Session  # noqa: PLC0415
    from glassslam.sources import open_recording  # noqa: PLC0415  (loads rosbags)

    with locked(target):
        restore_results(target)
        folder = working_directory(target)
        check_directory(target, overwrite=overwrite)
        check_room(folder, target, overwrite=overwrite)
        check_apart(folder, (*recordings, options.sonar, options.sonar_ring))
        source = open_recording(recordings, options)
        with made_directory(folder, replacing=overwrite):
            session = Session.create(folder / SESSION_FILE, recordings, config, options)
        with explained_end(target), session, given_up_where_it_fails(session):
            finished = _slam(source, session, target, manner)
            with way_out_told(session, target):
                return conclude(finished, session, target, overwrite=overwrite, manner=manner)


def resume(
    directory: Path, recordings: Sequence[Path] | None, manner: Manner, *, overwrite: bool = False
) -> int:
    """Go on with a run that did not come to its end; the exit code.

    Parameters
    ----------
    directory : Path
        The results directory named when the run began.
    recordings : sequence of Path, optional
        Where its recordings are now; where they were when left out.
    manner : Manner
        How to tell of it.
    overwrite : bool
        Whether earlier results may be replaced, even if that was not said when the run began.

    Raises
    ------
    UsageError
        There is no such run, or there are results now that were not there when it began.
    SessionError
        Its session or its recordings are not what they were.
    """
    from glassslam.outputs.directory import check_directory, restore_results  # noqa: PLC0415
    from glassslam.outputs.lock import locked  # noqa: PLC0415
    from glassslam.session import Session  # noqa: PLC0415

    target = named_target(directory)
    with locked(target):
        path = session_path(target)
        if path.parent == target.resolve():
            restore_results(target)
            return _already_whole(target, manner)
        folder = path.parent
        check_own(folder)
        with explained_end(target), Session.open(path) as session:
            inputs = (recorded.found() for recorded in session.recordings)
            others = session.options.sonar, session.options.sonar_ring
            check_apart(folder, (*(recordings or inputs), *others))
            replacing = is_replacing(folder, target, overwrite=overwrite)
            restore_results(target)
            with way_out_told(session, target):
                check_directory(target, overwrite=replacing)
            clear_but_session(folder)
            finished = (
                session.load() if session.is_finished else go_on_with(session, recordings, target, manner)
            )
            with way_out_told(session, target):
                return conclude(finished, session, target, overwrite=replacing, manner=manner)


def conclude(
    finished: "FinishedRun", session: "Session", target: Path, *, overwrite: bool, manner: Manner
) -> int:
    """Draw a finished run, write its results, and tell of it; the exit code.

    Raises
    ------
    OutputError
        Something cannot be written; the session stays.
    """
    from glassslam.cli.settings import calibration_warnings  # noqa: PLC0415
    from glassslam.cli.terminal import complain  # noqa: PLC0415
    from glassslam.outputs import build_report, write_results  # noqa: PLC0415

    result = finished.result()
    result.statistics.warnings[:0] = calibration_warnings(finished.config)
    written = write_results(result, target, overwrite=overwrite, stopwatch=manner.stopwatch, session=session)
    try:
        return tell(build_report(result, manner.stopwatch.read()), written, target, manner)
    except OutputError as error:
        return complain(error.message, f"the results in {target} are whole", code=3)


def tell(report: dict[str, Any], written: Sequence[Path], target: Path, manner: Manner) -> int:
    """Print the summary of a run or its report; the exit code."""
    if manner.json:
        import json  # noqa: PLC0415  (only for --json)

        from glassslam.cli.terminal import emit  # noqa: PLC0415

        emit(json.dumps({"directory": str(target), **report}, indent=2, allow_nan=False) + "\n")
    elif not manner.quiet:
        from glassslam.cli.summary import show_summary  # noqa: PLC0415  (loads rich)

        show_summary(report, written)
    return 3 if is_damaged(report) else 0


def is_damaged(report: dict[str, Any]) -> bool:
    """Whether anything could not be read, or was dropped that the user did not ask to leave out."""
    return bool(report["damage"] or report["solver_failures"]) or any(
        (*report["scans"]["dropped"].values(), *report["messages_dropped"].values())
    )


def go_on_with(
    session: "Session", recordings: Sequence[Path] | None, target: Path, manner: Manner
) -> "FinishedRun":
    """Read the recordings of a session from the start, with what it knows, and on to their end.

    Raises
    ------
    SessionError
        The recordings are not what they were, or another version has begun the run.
    InterruptedRunError
        A signal came.
    """
    import glassslam  # noqa: PLC0415
    from glassslam.sources import open_recording  # noqa: PLC0415  (loads rosbags)

    if session.version != glassslam.__version__:
        raise SessionError(
            f"glassslam {session.version} has begun this run, and this is {glassslam.__version__}:"
            " the result would be of both",
            "map the recording anew, with --overwrite",
        )
    source = open_recording([*map(Path, session.check_recordings(recordings))], session.options)
    return _slam(source, session, target, manner)


def _slam(source: "Recording", session: "Session", target: Path, manner: Manner) -> "FinishedRun":
    """SLAM to the end of the recording.

    Raises
    ------
    InterruptedRunError
        A signal came; what there was of the map is written.
    """
    from glassslam.api import RunInProgress  # noqa: PLC0415  (loads numba and casadi)
    from glassslam.cli.progress import progress_bar  # noqa: PLC0415

    names = [recorded.given for recorded in session.recordings]
    with progress_bar(quiet=manner.quiet) as progress:
        run = RunInProgress(source, session.config, progress=progress, session=session, names=names)
        with stopping(run.hurry) as bell:
            try:
                finished = run.finished()
            except NoScansError as error:
                if not bell.rung:
                    raise
                session.close()
                raise _interruption(run, bell, target, "before there was a map") from error
            if finished.is_whole:
                return finished
            session.close()
            _write_partial(finished, session.path.parent, run, manner)
    raise _interruption(run, bell, target, f"a map of them is in {session.path.parent.name}")


def _write_partial(finished: "FinishedRun", folder: Path, run: Any, manner: Manner) -> None:
    from glassslam.outputs.results import write_files  # noqa: PLC0415

    result = finished.result()
    result.statistics.warnings.insert(
        0, f"interrupted after {run.scans} scans, {run.recorded_seconds:.1f} s: the rest is not in this map"
    )
    try:
        write_files(result, folder, manner.stopwatch)
    except OSError as error:
        raise OutputError(f"cannot write {folder}: {error.strerror}", "free some space") from error


def _interruption(run: Any, bell: Bell, target: Path, what: str) -> InterruptedRunError:
    return InterruptedRunError(
        f"interrupted after {run.scans} scans, {run.recorded_seconds:.1f} s; {what}",
        f"go on: glassslam map --resume {target}",
        bell.exit_code,
    )


def _already_whole(target: Path, manner: Manner) -> int:
    from glassslam.cli.terminal import emit  # noqa: PLC0415

    if not manner.quiet:
        emit(f"{target} is whole: there is nothing to go on with\n")
    return 0
