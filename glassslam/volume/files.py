"""All files made of a volume, written into one directory."""

import os
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from glassslam.errors import OutputError, UsageError
from glassslam.volume.octomap_file import write_octomap
from glassslam.volume.octree import Octree
from glassslam.volume.pictures import write_slices, write_top_view
from glassslam.volume.ply import write_ply
from glassslam.volume.projection import Band
from glassslam.volume.storage import save_volume

VOLUME_FILES = ("volume.npz", "volume.bt", "volume.ply", "volume.png", "slices.png")
"""What is made of every volume."""


def check_folder(directory: str | Path, *, overwrite: bool = False) -> Path:
    """Make sure, before any work is done, that a volume may be written into a directory.

    Raises
    ------
    UsageError
        There is a volume already, which may not be replaced.
    OutputError
        It is a file.
    """
    target = Path(directory)
    if target.exists() and not target.is_dir():
        raise OutputError(f"{directory} is a file", "name a directory for the volume")
    present = [name for name in VOLUME_FILES if (target / name).exists()]
    if present and not overwrite:
        raise UsageError(f"{directory} already holds {present[0]}", "use --overwrite to replace it")
    return target


def write_volume(
    tree: Octree,
    directory: str | Path,
    *,
    band: Band | None = None,
    also: Callable[[Path], list[Path]] | None = None,
    overwrite: bool = False,
) -> list[Path]:
    """Write `VOLUME_FILES`, all of them or none.

    Parameters
    ----------
    tree : Octree
        The volume.
    directory : str or Path
        Made when it does not exist; other files in it are left alone.
    band : tuple of float, optional
        Heights shown in the pictures, m; all when left out.
    also : callable, optional
        Given a folder, writes more files into it, and names them.
    overwrite : bool
        Whether an earlier volume there may be replaced.

    Returns
    -------
    list of Path
        The files written.

    Raises
    ------
    UsageError, OutputError
        As by `check_folder`; or the volume is empty, or something cannot be written.
    """
    target = check_folder(directory, overwrite=overwrite)
    made = [folder for folder in (target, *target.parents) if not folder.exists()]
    try:
        target.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".volume.", dir=target) as staged:
            paths = write_files(tree, Path(staged), band)
            paths += also(Path(staged)) if also else []
            return _publish(paths, target)
    except BaseException as error:
        for folder in made:
            with suppress(OSError):  # it is not empty: others have written there meanwhile
                folder.rmdir()
        if isinstance(error, OSError):
            raise OutputError(f"cannot write {directory}: {error.strerror or error}") from error
        raise


def write_files(tree: Octree, folder: Path, band: Band | None = None) -> list[Path]:
    """Write `VOLUME_FILES` one after the other into a folder that is there.

    Parameters
    ----------
    tree : Octree
        The volume.
    folder : Path
        Where the files go.
    band : tuple of float, optional
        Heights shown in the pictures, m; all when left out.

    Raises
    ------
    OutputError
        The volume is empty.
    OSError
        A file cannot be written.
    """
    writers: tuple[Callable[[Path], Path], ...] = (
        lambda path: save_volume(tree, path),
        lambda path: write_octomap(tree, path),
        lambda path: write_ply(tree, path),
        lambda path: write_top_view(tree, path, band),
        lambda path: write_slices(tree, path, band),
    )
    return [write(folder / name) for name, write in zip(VOLUME_FILES, writers, strict=True)]


def _publish(staged: list[Path], target: Path) -> list[Path]:
    """Put finished files in their places, all of them or none."""
    for path in staged:
        with path.open("rb") as file:
            os.fsync(file.fileno())
    finals = [target / path.name for path in staged]
    kept = {final: path.with_name(f"{path.name}.old") for final, path in zip(finals, staged, strict=True)}
    try:
        for path, final in zip(staged, finals, strict=True):
            if final.exists():
                final.rename(kept[final])
            path.rename(final)
    except BaseException:
        for path, final in zip(staged, finals, strict=True):
            if not path.exists():
                final.unlink(missing_ok=True)
            if kept[final].exists():
                kept[final].rename(final)
        raise
    return finals
