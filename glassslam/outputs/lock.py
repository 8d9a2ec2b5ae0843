"""One run at a time writes into a results directory."""

import fcntl
import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from glassslam.errors import OutputError

_ATTEMPTS = 20


@contextmanager
def locked(directory: str | Path) -> Iterator[None]:
    """Keep other runs out of a directory while the block runs; the end of the process lets them in as well.

    The lock is a hidden file beside the directory. Parents that do not exist are made for it, for it must be
    the same one before and after the directory is there; they go with it where they stay empty. On disks that
    know no locks there is none.

    Parameters
    ----------
    directory : str or Path
        Where results will be; need not exist.

    Raises
    ------
    OutputError
        Another run is writing there, or a directory stands in the place of the lock.
    """
    target = Path(directory).resolve()
    path = target.with_name(f".{target.name}.lock") if target.name else target / ".lock"
    made = [folder for folder in target.parents if not folder.exists()]
    descriptor = None
    try:
        with _undisturbed():
            descriptor = _acquire(path, directory)
        yield
    finally:
        if descriptor is not None:
            with suppress(OSError):
                path.unlink()
            os.close(descriptor)
        for folder in made:
            with suppress(OSError):  # it holds the results, or what others have written meanwhile
                folder.rmdir()


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Keep signals waiting: one that came between making the lock and knowing of it would leave it behind."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _acquire(path: Path, directory: str | Path) -> int | None:
    """Descriptor of the locked file; None where locks are not to be had."""
    attempts = iter(range(_ATTEMPTS))
    while True:
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)
        except FileNotFoundError:  # a run that failed has removed the parents it had made
            if next(attempts, None) is None:
                return None
            continue
        except IsADirectoryError as error:
            raise OutputError(
                f"cannot lock {directory}: {path} is a directory", "remove it, or choose another directory"
            ) from error
        except OSError:  # what cannot be written at all is told by those who write
            return None
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            is_ours = _is_at(path, descriptor)
        except BlockingIOError as error:
            os.close(descriptor)
            raise OutputError(
                f"another run is writing to {directory}", "wait for it, or choose another directory"
            ) from error
        except OSError:
            os.close(descriptor)
            return None
        if is_ours:
            return descriptor
        os.close(descriptor)  # the run before has removed the file in the meantime


def _is_at(path: Path, descriptor: int) -> bool:
    try:
        return os.path.samestat(path.stat(), os.fstat(descriptor))
    except FileNotFoundError:
        return False
