"""`glassslam render`: draw the results of a run again, without SLAM."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from glassslam.cli.endings import explained_end
from glassslam.cli.interruption import Terminated
from glassslam.cli.run import Manner, conclude, go_on_with
from glassslam.cli.workplace import (
    check_own,
    check_room,
    finished_session_path,
    is_replacing,
    made_directory,
    named_target,
    remove_own,
    session_path,
)
from glassslam.errors import (
    GlassSlamError,
    InterruptedRunError,
    SessionError,
    UsageError,
)

if TYPE_CHECKING:
    from glassslam.config import Config
    from glassslam.finished import FinishedRun
    from glassslam.session import Session

EXAMPLES = """\
  glassslam render run-map --set map.resolution=0.02             finer cells
  glassslam render run-map --set glass.scheme=off -o no-glass    without glass in the map
  glassslam render run-map --set sonar.fusion.method=rsf_all     another decision layer
  glassslam render run-map --calibration mine/                   look for glass in another way
"""

Directory = Annotated[
    Path, typer.Argument(metavar="DIR", help="Results of glassslam map.", show_default=False)
]
Output = Annotated[
    Path | None,
    typer.Option("--output", "-o", metavar="DIR", help="Results directory [default: the same one]."),
]
Assignments = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="SECTION.NAME=VALUE", help="Change one parameter; may be repeated."),
]
Sensor = Annotated[
    str | None, typer.Option(metavar="NAME", help="Look for glass with a lidar of this kind; see map.")
]
CalibrationFile = Annotated[
    Path | None,
    typer.Option("--calibration", metavar="FILE", help="Look for glass with the calibration of this lidar."),
]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace earlier results in the output.")]
Json = Annotated[bool, typer.Option("--json", help="Print the report as JSON instead of the summary.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")]


def render(
    directory: Directory,
    output: Output = None,
    assignments: Assignments = None,
    sensor: Sensor = None,
    calibration: CalibrationFile = None,
    overwrite: Overwrite = False,
    json: Json = False,
    quiet: Quiet = False,
) -> int:
    """Draw all results of a run again with other parameters of map, glass, sonar and fusion.

    Poses stay as they are: parameters that take part in SLAM are refused. Everything comes from session.db;
    the recording is read only where scans have to be looked at for glass once more. The results are those
    that glassslam map gives with these parameters.
    """
    from glassslam.cli.settings import (  # noqa: PLC0415
        assigned,
        calibration_assignments,
        sensor_assignments,
    )
    from glassslam.outputs import Stopwatch  # noqa: PLC0415  (loads numpy)

    manner = Manner(Stopwatch(), json=json, quiet=quiet)
    wishes = [
        *sensor_assignments(sensor),
        *calibration_assignments(calibration, sensor),
        *(assignments or ()),
    ]
    target = named_target(directory)
    return _render(
        session_path(target) if output is None else finished_session_path(target),
        target,
        output or target,
        lambda config: assigned(config, wishes),
        overwrite=overwrite,
        in_place=output is None,
        manner=manner,
    )


def _render(
    source: Path,
    origin: Path,
    target: Path,
    change: "Callable[[Config], Config]",
    *,
    overwrite: bool,
    in_place: bool,
    manner: Manner,
) -> int:
    """Draw the results of a session, which belongs to the directory `origin`, into a directory."""
    from glassslam.outputs import check_directory  # noqa: PLC0415
    from glassslam.outputs.directory import restore_results, working_directory  # noqa: PLC0415
    from glassslam.outputs.lock import locked  # noqa: PLC0415
    from glassslam.session import SESSION_FILE, Session  # noqa: PLC0415

    with locked(target):
        folder = working_directory(target)
        if source.parent == folder:
            check_own(folder)
            replacing = is_replacing(folder, target, overwrite=overwrite)
        else:
            replacing = overwrite or in_place
        restore_results(target)
        check_directory(target, overwrite=replacing)
        if source.parent != folder:
            check_room(folder, target, overwrite=False)
            with made_directory(folder, replacing=replacing, copied=True):
                Session.copy(source, folder / SESSION_FILE)
        with (
            explained_end(target) if source.parent == folder else _undone(source, folder),
            Session.open(folder / SESSION_FILE) as session,
        ):
            if not session.is_finished:
                hint = f"go on: glassslam map --resume {origin}"
                raise UsageError(f"the run of {origin} is not finished", hint)
            finished = _changed(session, change(session.config), target, manner)
            return conclude(finished, session, target, overwrite=replacing, manner=manner)


@contextmanager
def _undone(source: Path, folder: Path) -> Iterator[None]:
    """Remove the copy of a session where it does not become results; the session itself is where it was."""
    again = "the results are as they were; draw them again"
    try:
        yield
    except (KeyboardInterrupt, Terminated) as error:
        remove_own(folder)
        code = 130 if isinstance(error, KeyboardInterrupt) else 143
        raise InterruptedRunError("interrupted", again, code) from error
    except InterruptedRunError as error:
        remove_own(folder)
        raise InterruptedRunError("interrupted", again, error.exit_code) from error
    except GlassSlamError as error:
        remove_own(folder)
        if isinstance(error, SessionError):
            message = error.message.replace(str(folder), str(source.parent))
            name = folder.name.removesuffix(".partial")
            hint = error.hint.replace(f"recover {name}", f"recover {source.parent.name}")
            raise SessionError(message, hint) from error
        raise


def _changed(session: "Session", config: "Config", target: Path, manner: Manner) -> "FinishedRun":
    """The finished run of a session with another configuration."""
    from glassslam.session.changes import needs_recording  # noqa: PLC0415

    again = needs_recording(session.config, config)
    if again:
        session.check_recordings()
    session.change(config, keep_findings=not again)
    return go_on_with(session, None, target, manner) if again else session.load()
