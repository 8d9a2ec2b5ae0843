"""What is told, and what is kept, when a run ends before its end."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from glassslam.cli.interruption import Terminated
from glassslam.cli.workplace import remove_own
from glassslam.errors import (
    GlassSlamError,
    InterruptedRunError,
    MapSizeError,
    OutputError,
    UnreachableRecordingError,
    UsageError,
)

if TYPE_CHECKING:
    from glassslam.session import Session


@contextmanager
def explained_end(target: Path) -> Iterator[None]:
    """Tell with every end before the end how to go on."""
    go_on = f"glassslam map --resume {target}"
    try:
        yield
    except OutputError as error:
        hint = f"{error.hint}; " if error.hint else ""
        raise OutputError(error.message, f"{hint}then go on: {go_on}") from error
    except UnreachableRecordingError as error:
        hint = f"what was done is kept; when it is there again, go on: {go_on}"
        raise UnreachableRecordingError(error.message, hint) from error
    except (KeyboardInterrupt, Terminated) as error:
        code = 130 if isinstance(error, KeyboardInterrupt) else 143
        raise InterruptedRunError("interrupted", f"go on: {go_on}", code) from error


@contextmanager
def way_out_told(session: "Session", target: Path) -> Iterator[None]:
    """Tell what to do with a run whose map is too large, or in whose place results have appeared."""
    try:
        yield
    except MapSizeError as error:
        hint = f"{error.hint}; poses are kept: glassslam render {target} --set ..."
        raise MapSizeError(error.message, hint) from error
    except UsageError as error:
        beside = f"; or keep both: glassslam render {target} -o OTHER" if session.is_finished else ""
        hint = f"the run is kept; replace them: glassslam map --resume {target} --overwrite{beside}"
        raise UsageError(error.message, hint) from error


@contextmanager
def given_up_where_it_fails(session: "Session") -> Iterator[None]:
    """Remove the session of a run that would fail again, and no other."""
    try:
        yield
    except (OutputError, InterruptedRunError, UnreachableRecordingError):
        raise
    except GlassSlamError as error:
        if not (session.is_finished and isinstance(error, MapSizeError | UsageError)):
            session.abandon()
            remove_own(session.path.parent)
        raise
