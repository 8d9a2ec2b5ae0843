"""`glassslam recover`: save what is left of a damaged session."""

import os
import shutil
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from glassslam.cli.workplace import allow_replacing, check_own, named_target, session_path
from glassslam.errors import OutputError, SessionError

if TYPE_CHECKING:
    from glassslam.session.salvage import Salvage

EXAMPLES = """\
  glassslam recover run-map             save what can be trusted
  glassslam map --resume run-map        then do the rest again
"""

Directory = Annotated[
    Path, typer.Argument(metavar="DIR", help="Results directory of the run.", show_default=False)
]


def recover(directory: Directory) -> int:
    """Save what is left of the session of a run, interrupted or finished, whose file is damaged.

    Every part of a session has a checksum. The longest beginning of the run that is sound becomes the session
    in DIR.partial, with a map of it; glassslam map --resume DIR does the rest again and gives the same bytes
    as a run without damage. DIR itself is left alone until then.
    """
    from glassslam.cli.terminal import emit  # noqa: PLC0415
    from glassslam.outputs.lock import locked  # noqa: PLC0415
    from glassslam.session.aside import undo_aside  # noqa: PLC0415

    target = named_target(directory)
    with locked(target):
        path = session_path(target)
        undo_aside(path)
        if _is_sound(path):
            emit(f"{path} is sound: there is nothing to save\n")
            return 0
        saved, session = _saved(path, target)
        emit(f"{_told(saved)}; go on: glassslam map --resume {target}\n")
        if not saved.is_finished and saved.nodes:
            _draw(session)
            emit(f"a map of it is in {session.parent.name}\n")
    return 3


def _is_sound(path: Path) -> bool:
    """Whether a session can be read from its first to its last row.

    Raises
    ------
    SessionError
        It is of a newer version.
    """
    from glassslam.session import Session, is_session  # noqa: PLC0415
    from glassslam.session.database import check_header  # noqa: PLC0415
    from glassslam.session.salvage import scans_found  # noqa: PLC0415

    if is_session(path):
        check_header(path)
    # opening a database may change it, and results that turn out to be sound are left as they are
    with tempfile.TemporaryDirectory(prefix=f".{path.parent.name}.", dir=path.parent.parent) as folder:
        for ending in ("", "-wal", "-journal"):
            with suppress(FileNotFoundError):
                shutil.copyfile(f"{path}{ending}", Path(folder) / f"{path.name}{ending}")
        try:
            with Session.open(Path(folder) / path.name) as session:
                session.check()
                return bool(scans_found(path) <= session.journal.scans)
        except SessionError:
            return False


def _saved(path: Path, target: Path) -> "tuple[Salvage, Path]":
    """Put a new session in the working directory; a damaged one that stood there stays beside it."""
    from glassslam.outputs.directory import working_directory  # noqa: PLC0415
    from glassslam.session import SESSION_FILE  # noqa: PLC0415
    from glassslam.session.aside import set_aside  # noqa: PLC0415
    from glassslam.session.salvage import salvage  # noqa: PLC0415

    folder = working_directory(target)
    made = folder / SESSION_FILE
    fresh = made.with_name(f"{SESSION_FILE}.new")
    try:
        folder.mkdir(exist_ok=True)
        check_own(folder)
        fresh.unlink(missing_ok=True)
        saved = salvage(path, fresh)
        if path == made:
            set_aside(path)
        fresh.replace(made)
        if path != made:  # the damaged results are what the run will replace
            allow_replacing(folder)
    except SessionError as error:
        if path != made or not (target / SESSION_FILE).is_file():
            raise
        hint = f"{error.hint}; or remove {folder.name}: what {target} holds stays as it was"
        raise SessionError(error.message, hint) from error
    except OSError as error:
        raise OutputError(f"cannot write {folder}: {error.strerror}", "free some space") from error
    finally:
        fresh.unlink(missing_ok=True)
        if not os.listdir(folder):  # noqa: PTH208
            folder.rmdir()
    return saved, made


def _told(saved: "Salvage") -> str:
    if saved.is_finished:
        return f"saved the whole run, {saved.scans} scans"
    lost = f"; {saved.scans_beyond} scans after a gap must be matched again" if saved.scans_beyond else ""
    return f"saved {saved.scans} scans and {saved.rounds} rounds of loop closing{lost}"


def _draw(path: Path) -> None:
    from glassslam.outputs.results import write_files  # noqa: PLC0415
    from glassslam.session import Session  # noqa: PLC0415
    from glassslam.session.rebuild import rebuilt  # noqa: PLC0415  (loads numba)

    with Session.open(path) as session:
        result = rebuilt(session).result()
    try:
        write_files(result, path.parent)
    except OSError as error:
        raise OutputError(f"cannot write {path.parent}: {error.strerror}", "free some space") from error
