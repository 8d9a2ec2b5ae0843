"""The working directory of a run: DIR.partial, with its session, beside the results directory DIR."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from glassslam.errors import OutputError, UsageError

_SUFFIX = ".partial"


def named_target(directory: Path) -> Path:
    """The results directory meant by its own name or by that of its working directory."""
    if directory.name == _SUFFIX or directory.with_name(f"{directory.name}{_SUFFIX}").exists():
        return directory
    return directory.with_name(directory.name.removesuffix(_SUFFIX))


def session_path(target: Path) -> Path:
    """The session of a results directory: that of a run in progress, or else that of the results.

    Raises
    ------
    UsageError
        There is none.
    """
    from glassslam.outputs.directory import working_directory  # noqa: PLC0415
    from glassslam.session import SESSION_FILE  # noqa: PLC0415

    for folder in (working_directory(target), target.resolve()):
        if (folder / SESSION_FILE).is_file():
            return folder / SESSION_FILE
    raise UsageError(
        f"there is no session for {target}", "name the results directory of a run: -o DIR of glassslam map"
    )


def clear_but_session(folder: Path) -> None:
    """Remove what a partial map or a killed run has left beside the session."""
    from glassslam.session import SESSION_FILE  # noqa: PLC0415

    kept = {f"{SESSION_FILE}{ending}" for ending in ("", "-wal", "-shm", "-journal")}
    for path in folder.iterdir():
        if path.name not in kept:
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
    from glassslam.session import SESSION_FILE, is_session  # noqa: PLC0415

    if not folder.exists():
        return
    if not overwrite and is_session(folder / SESSION_FILE):
        raise UsageError(
            f"a run into {target} was interrupted and waits in {folder.name}",
            f"go on: glassslam map --resume {target}; or begin anew: --overwrite",
        )
    foreign = [path.name for path in folder.iterdir() if not path.is_file()]
    if foreign:
        raise OutputError(f"{folder} holds what is no result: {foreign[0]}", "choose another directory")


@contextmanager
def made_directory(folder: Path) -> Iterator[None]:
    """Make a working directory, empty, which stays where the block succeeds."""
    made = [parent for parent in folder.parents if not parent.exists()]
    try:
        if folder.exists():
            shutil.rmtree(folder)
        folder.mkdir(parents=True)
        yield
    except BaseException as error:
        shutil.rmtree(folder, ignore_errors=True)
        for parent in made:
            if parent.is_dir() and not any(parent.iterdir()):
                parent.rmdir()
        if isinstance(error, OSError):
            raise OutputError(f"cannot write {folder}: {error.strerror}") from error
        raise
