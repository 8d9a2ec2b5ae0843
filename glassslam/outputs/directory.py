"""A results directory that appears whole or not at all."""

import errno
import os
import shutil
import tempfile
from collections.abc import Iterator, Sequence, Set
from contextlib import contextmanager, suppress
from pathlib import Path

from glassslam.errors import OutputError, UsageError

RESULT_FILES = (
    "map.yaml",
    "map.pgm",
    "map.png",
    "trajectory.tum",
    "graph.g2o",
    "config.yaml",
    "report.json",
    "report.html",
)
"""What every run writes."""
GLASS_FILES = ("glass.geojson", "glass_beams.npz", "labels.png", "calibration.yaml")
"""What a run that looks for glass writes as well; the last only where it has calibrated its lidar itself."""
SONAR_FILES = (
    "sonar_map.yaml",
    "sonar_map.pgm",
    "sonar_map.png",
    "fused_map.yaml",
    "fused_map.pgm",
    "fused_map.png",
    "source_map.png",
)
"""What a run with sonar writes as well."""
VOLUME_FILES = (
    "volume.npz",
    "volume.bt",
    "volume.ply",
    "volume.png",
    "slices.png",
    "volume_map.yaml",
    "volume_map.pgm",
    "volume_map.png",
)
"""What a run with points of a 3D ultrasonic sensor writes as well."""
STATE_FILES = ("session.db",)
"""What a run of the command line writes as well: all it takes to draw its results again."""
ALL_FILES = RESULT_FILES + GLASS_FILES + SONAR_FILES + VOLUME_FILES + STATE_FILES
"""Everything that may stand in a results directory."""

_HINTS = {
    errno.ENOSPC: "free some space or choose another disk",
    errno.EDQUOT: "the quota of this disk is used up",
    errno.EACCES: "choose a directory you may write",
    errno.EPERM: "choose a directory you may write",
    errno.EROFS: "choose a directory on a writable disk",
    errno.ENOTDIR: "a part of the path is a file",
}


def check_directory(
    directory: str | Path, *, overwrite: bool = False, files: Sequence[str] = ALL_FILES
) -> Path:
    """Make sure, before any work is done, that results may be written to a directory.

    Parameters
    ----------
    directory : str or Path
        Where the results shall be; need not exist.
    overwrite : bool
        Whether earlier results there may be replaced.
    files : sequence of str
        Names of the files that are results.

    Returns
    -------
    Path
        The directory, absolute and without symbolic links.

    Raises
    ------
    UsageError
        It holds earlier results, which may not be replaced.
    OutputError
        It is a file or a mount point, holds foreign files, or lies where nothing can be written.
    """
    target = Path(directory).resolve()
    if target.exists() and not target.is_dir():
        raise OutputError(f"{directory} is a file", "name a directory for the results")
    try:
        present = sorted(entry.name for entry in target.iterdir()) if target.exists() else []
    except OSError as error:
        raise _unwritable(directory, error) from error
    if foreign := [name for name in present if name not in files]:
        raise OutputError(
            f"{directory} holds files that are no results: {', '.join(foreign[:3])}", "choose a new directory"
        )
    if present and not overwrite:
        raise UsageError(f"{directory} already holds results", "use --overwrite to replace them")
    if _is_mount(target):  # nothing can be renamed to take its place
        raise OutputError(f"{directory} is a mount point", "name a folder inside it")
    _check_parent(directory, target)
    return target


def _is_mount(target: Path) -> bool:
    if os.path.ismount(target):
        return True
    # a folder that is mounted a second time on the same disk shows only here
    with suppress(OSError):
        lines = Path("/proc/self/mountinfo").read_text(errors="surrogateescape").splitlines()
        return _escaped(str(target)) in {line.split(" ")[4] for line in lines}
    return False


def _escaped(path: str) -> str:
    """A path as the kernel lists it."""
    return "".join(f"\\{ord(sign):03o}" if sign in " \t\n\\" else sign for sign in path)


def _check_parent(directory: str | Path, target: Path) -> None:
    parent = next(folder for folder in target.parents if folder.exists())
    if not parent.is_dir():
        raise OutputError(f"cannot write {directory}: {parent} is a file")
    # Trying is surer than asking: permissions say nothing of read-only disks, and all is allowed to root.
    # The name is known before the folder is made, so that a signal in between leaves nothing behind.
    trial = parent / f".{target.name}.{os.getpid()}"
    try:
        trial.mkdir()
    except FileExistsError:
        pass
    except OSError as error:
        raise _unwritable(directory, error) from error
    finally:
        with suppress(OSError):
            trial.rmdir()


@contextmanager
def staged_directory(
    directory: str | Path,
    *,
    overwrite: bool = False,
    files: Sequence[str] = ALL_FILES,
    working: Path | None = None,
) -> Iterator[Path]:
    """Lend a folder which takes the place of `directory` when the block ends without error.

    Parameters
    ----------
    directory : str or Path
        Where the results shall be.
    overwrite : bool
        Whether earlier results there may be replaced; they stay untouched until the new ones are whole.
    files : sequence of str
        Names of the files that are results.
    working : Path, optional
        The folder to lend, beside `directory`; what stood in it before the block stays when the block fails.
        A new one, of which nothing stays, when left out.

    Yields
    ------
    Path
        The folder to write into; whatever it holds is flushed to disk before it is renamed.

    Raises
    ------
    UsageError, OutputError
        As by `check_directory`; any OSError inside the block becomes an OutputError.
    """
    target = check_directory(directory, overwrite=overwrite, files=files)
    staged, kept = working, set[Path]() if working is None else set(working.iterdir())
    made = [folder for folder in target.parents if not folder.exists()]
    is_published = False
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        if staged is None:
            staged = Path(tempfile.mkdtemp(prefix=f".{target.name}.", suffix=".partial", dir=target.parent))
        yield staged
        staged.chmod(0o777 & ~_umask())
        for path in (*staged.iterdir(), staged):
            _flush(path)
        _publish(staged, target, staged.with_suffix(".old") if working is None else _retired(target))
        is_published = True
    except OSError as error:
        raise _unwritable(directory, error) from error
    finally:
        if staged is not None and not is_published:
            _clear(staged, kept)
        for folder in made:
            with suppress(OSError):  # it holds the results, or what others have written meanwhile
                folder.rmdir()


def working_directory(directory: str | Path) -> Path:
    """Where a run that is not finished keeps its session: DIR.partial, beside DIR."""
    target = Path(directory).resolve()
    return target.with_name(f"{target.name}.partial")


def restore_results(directory: str | Path) -> None:
    """Put earlier results back that a run was about to replace in the moment it was killed.

    Where it had replaced them already, they are removed as the run would have done.
    """
    target = Path(directory).resolve()
    if not _retired(target).is_dir():
        return
    if target.exists():
        shutil.rmtree(_retired(target), ignore_errors=True)
    else:
        _retired(target).rename(target)


def is_being_replaced(directory: str | Path) -> bool:
    """Whether a run was killed when it had put earlier results aside, before its own took their place."""
    target = Path(directory).resolve()
    return _retired(target).is_dir() and not target.exists()


def _retired(target: Path) -> Path:
    """Where earlier results are while new ones take their place."""
    return target.with_name(f".{target.name}.replaced")


def _clear(folder: Path, kept: Set[Path]) -> None:
    """Remove what a failed block has written; all of the folder where nothing stood in it before."""
    if not kept:
        shutil.rmtree(folder, ignore_errors=True)
        return
    for path in set(folder.iterdir()) - kept:
        path.unlink(missing_ok=True)


def _publish(staged: Path, target: Path, retired: Path) -> None:
    if not target.exists():
        _drop_notes(staged)
        staged.rename(target)
        _flush_names(target.parent)
        shutil.rmtree(retired, ignore_errors=True)
        return
    shutil.rmtree(retired, ignore_errors=True)
    try:
        target.rename(retired)
        _drop_notes(staged)
        staged.rename(target)
    except BaseException:
        if retired.exists() and not target.exists():
            retired.rename(target)
        # where another run has put its results meanwhile, they are the newer ones
        shutil.rmtree(retired, ignore_errors=True)
        raise
    _flush_names(target.parent)
    shutil.rmtree(retired, ignore_errors=True)


def _drop_notes(folder: Path) -> None:
    """Remove what a run keeps beside its session until its results are whole."""
    for path in folder.iterdir():
        if path.name.startswith(tuple(f"{name}." for name in STATE_FILES)):
            path.unlink()


def _flush_names(folder: Path) -> None:
    # everything is in its place: a disk that cannot promise it for the next power cut does not undo that
    with suppress(OSError):
        _flush(folder)


def _flush(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _umask() -> int:
    mask = os.umask(0o022)
    os.umask(mask)
    return mask


def _unwritable(directory: str | Path, error: OSError) -> OutputError:
    hint = _HINTS.get(error.errno or 0, "")
    return OutputError(f"cannot write {directory}: {error.strerror or error}", hint)
