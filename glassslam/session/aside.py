"""What stands beside a session: the logs of the database, and a damaged session that was set aside."""

import filecmp
import shutil
from contextlib import suppress
from pathlib import Path

_LOGS = ("-wal", "-shm", "-journal")
_DAMAGED = ".damaged"


def remove_logs(path: Path) -> None:
    """Remove what the database keeps beside a session that is closed: nothing is left to be read from it."""
    for ending in _LOGS:
        with suppress(FileNotFoundError):
            path.with_name(f"{path.name}{ending}").unlink()


def set_aside(path: Path) -> None:
    """Copy a damaged session aside and take its logs there, so that another one can take its place.

    A log must never meet another file: the database would merge it.

    Raises
    ------
    OSError
        It cannot be written.
    """
    remove_damaged(path)
    aside = _aside(path)
    shutil.copyfile(path, aside)
    for ending in _LOGS:
        with suppress(FileNotFoundError):
            path.with_name(f"{path.name}{ending}").replace(aside.with_name(f"{aside.name}{ending}"))


def undo_aside(path: Path) -> None:
    """Give a session its logs back, where a process was killed before another one took its place."""
    aside = _aside(path)
    if not (path.is_file() and aside.is_file() and filecmp.cmp(path, aside, shallow=False)):
        return
    for ending in _LOGS:
        log, taken = (file.with_name(f"{file.name}{ending}") for file in (path, aside))
        if taken.exists() and not log.exists():
            taken.replace(log)


def remove_damaged(path: Path) -> None:
    """Remove what was set aside of a session, once there is a whole one."""
    aside = _aside(path)
    remove_logs(aside)
    aside.unlink(missing_ok=True)


def _aside(path: Path) -> Path:
    return path.with_name(f"{path.name}{_DAMAGED}")
