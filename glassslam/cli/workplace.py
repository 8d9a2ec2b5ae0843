"""The working directory of a run: DIR.partial, with its session, beside the results directory DIR."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from glassslam.errors import GlassSlamError, OutputError, UsageError

_SUFFIX = ".partial"
_MAY_REPLACE = "session.db.overwrite"
_COPIED = "session.db.copied"


def named_target(directory: Path) -> Path:
    """The results directory meant by its own name or by that of its working directory.

    Raises
    ------
    UsageError
        It has no name: it is the root of all.
    """
    named = directory if directory.name not in ("", "..") else directory.resolve()
    if not named.name:
        raise UsageError(f"{directory} is no results directory", "name the results directory of a run")
    if named.name == _SUFFIX or named.with_name(f"{named.name}{_SUFFIX}").exists():
        return named
    return named.with_name(named.name.removesuffix(_SUFFIX))


def session_path(target: Path) -> Path:
    """The session of a results directory: that of a run in progress, or else that of the results.

    Raises
    ------
    UsageError
        There is none.
    """
    sessions = _sessions(target)
    if not sessions:
        raise UsageError(
            f"there is no session for {target}",
            "name the results directory of a run: -o DIR of glassslam map",
        )
    return sessions[0]


def finished_session_path(target: Path) -> Path:
    """As `session_path`, but that of the results where the run in progress is not finished.

    Raises
    ------
    UsageError
        There is none.
    """
    path = session_path(target)
    return path if _is_finished(path) else _sessions(target)[-1]


def _sessions(target: Path) -> list[Path]:
    from glassslam.outputs.directory import working_directory  # noqa: PLC0415
    from glassslam.session import SESSION_FILE, is_begun  # noqa: PLC0415

    folders = working_directory(target), target.resolve()
    found = [folder / SESSION_FILE for folder in folders if (folder / SESSION_FILE).is_file()]
    # a run that was killed before it wrote anything does not hide the results, nor does a copy of them
    begun = [path for path in found if is_begun(path)]
    return [path for path in begun if not (path.parent / _COPIED).exists()] or begun or found


def _is_finished(path: Path) -> bool:
    """Whether the run of a session came to its end; one that is damaged or in use did not."""
    import sqlite3  # noqa: PLC0415

    from glassslam.session.database import reading  # noqa: PLC0415

    try:
        with reading(path) as database:
            found = database.execute("SELECT 1 FROM facts WHERE name = 'is_whole'").fetchone()
    except (GlassSlamError, sqlite3.Error, UnicodeDecodeError):
        return False
    return found is not None


def check_own(folder: Path) -> None:
    """Make sure that a working directory holds nothing but what runs write there.

    Raises
    ------
    OutputError
        It does, or is no directory.
    """
    if folder.is_symlink():
        raise OutputError(f"{folder} is a link", "remove it, or choose another directory")
    if not folder.is_dir():
        raise OutputError(f"{folder} is a file", "choose another directory")
    foreign = sorted(path.name for path in folder.iterdir() if not _is_own(path))
    if foreign:
        raise OutputError(
            f"{folder} holds what is no result: {foreign[0]}", "move it away, or choose another directory"
        )


def check_apart(folder: Path, inputs: Iterable[str | Path | None]) -> None:
    """Make sure that nothing a run reads lies in its working directory.

    Raises
    ------
    OutputError
        Something does.
    """
    for path in inputs:
        if path is not None and folder in (place := Path(path).resolve(), *place.parents):
            raise OutputError(
                f"{path} lies in {folder}, which belongs to the run", "move it, or choose another directory"
            )


def _is_own(path: Path) -> bool:
    from glassslam.outputs.directory import ALL_FILES, STATE_FILES  # noqa: PLC0415

    beside = tuple(f"{name}{mark}" for name in STATE_FILES for mark in "-.")
    is_named_so = path.name in ALL_FILES or path.name.startswith(beside)
    return is_named_so and (path.is_symlink() or path.is_file())


def clear_but_session(folder: Path) -> None:
    """Remove what a partial map or a killed run has left beside the session."""
    from glassslam.session import SESSION_FILE  # noqa: PLC0415

    for path in folder.iterdir():
        half_made = path.name == f"{SESSION_FILE}.new"
        if _is_own(path) and (half_made or not path.name.startswith(SESSION_FILE)):
            path.unlink()


def remove_own(folder: Path) -> None:
    """Remove a working directory; it stays where somebody else has put something there."""
    with suppress(OSError):
        _clear(folder)
        folder.rmdir()


def _clear(folder: Path) -> None:
    from glassslam.session import SESSION_FILE  # noqa: PLC0415

    # without its session the rest would look like results; and a log must never meet another session
    own = sorted(filter(_is_own, folder.iterdir()), key=lambda path: len(path.name), reverse=True)
    for path in sorted(own, key=lambda path: path.name.startswith(SESSION_FILE)):
        path.unlink()


def check_room(folder: Path, target: Path, *, overwrite: bool) -> None:
    """Make sure that a run may have a working directory of its own.

    Parameters
    ----------
    folder : Path
        The working directory; what an earlier run has left there goes when it is made.
    target : Path
        The results directory.
    overwrite : bool
        Whether an earlier run may be given up.

    Raises
    ------
    UsageError
        An earlier run waits there to be finished.
    OutputError
        Something of another kind is there.
    """
    from glassslam.session import SESSION_FILE, is_begun, is_session  # noqa: PLC0415

    if not (folder.exists() or folder.is_symlink()):
        return
    check_own(folder)
    if (folder / _COPIED).exists():
        return
    if not overwrite and is_session(folder / SESSION_FILE):
        raise UsageError(
            f"a run into {target} was interrupted and waits in {folder.name}",
            f"go on: glassslam map --resume {target}; or begin anew: --overwrite",
        )
    if not overwrite and is_begun(folder / SESSION_FILE):
        raise UsageError(
            f"{folder.name} holds the session of a run into {target}, and it is damaged",
            f"save what there is: glassslam recover {target}; or begin anew: --overwrite",
        )
    if _holds_results(folder):
        raise OutputError(f"{folder} holds whole results", "move them away, or choose another directory")


def _holds_results(folder: Path) -> bool:
    """Whether results were written there for good: their session is one that needs no log any more."""
    from glassslam.outputs.directory import RESULT_FILES  # noqa: PLC0415
    from glassslam.session import SESSION_FILE  # noqa: PLC0415

    if not all((folder / name).exists() for name in RESULT_FILES):
        return False
    try:
        with (folder / SESSION_FILE).open("rb") as file:
            return file.read(20)[18:] == b"\1\1"  # how it is written, by the file format of SQLite
    except FileNotFoundError:
        return True


@contextmanager
def made_directory(folder: Path, *, replacing: bool, copied: bool = False) -> Iterator[None]:
    """Make a working directory, empty, which stays where the block succeeds.

    Parameters
    ----------
    folder : Path
        The working directory; `check_room` has looked at it.
    replacing : bool
        Whether its results may replace earlier ones; noted there for those who go on with the run.
    copied : bool
        Whether it is for the copy of a session, which may go at any time; noted there as well.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        _clear(folder)
        if replacing:
            allow_replacing(folder)
        if copied:
            (folder / _COPIED).touch()
        yield
    except BaseException as error:
        remove_own(folder)
        if isinstance(error, OSError):
            raise OutputError(f"cannot write {folder}: {error.strerror}") from error
        raise


def allow_replacing(folder: Path) -> None:
    """Note in a working directory that its results may replace earlier ones.

    Raises
    ------
    OSError
        It cannot be written.
    """
    (folder / _MAY_REPLACE).touch()


def is_replacing(folder: Path, target: Path, *, overwrite: bool) -> bool:
    """Whether a run that goes on may replace earlier results: as said now, or when it was begun.

    Raises
    ------
    OutputError
        It cannot be noted for the next time.
    """
    from glassslam.outputs.directory import is_being_replaced  # noqa: PLC0415

    if not (overwrite or (folder / _MAY_REPLACE).exists() or is_being_replaced(target)):
        return False
    try:
        allow_replacing(folder)
    except OSError as error:
        raise OutputError(f"cannot write {folder}: {error.strerror}") from error
    return True
