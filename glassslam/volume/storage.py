"""volume.npz: a volume as numpy arrays, which load without pickle."""

from pathlib import Path
from typing import BinaryIO

import numpy as np

from glassslam.errors import GridError, OutputError
from glassslam.regularfile import regular
from glassslam.volume.octree import Leaves, Octree
from glassslam.volume.odds import Clamp

FORMAT = "glassslam-volume"
VERSION = 1
_NAMES = ("format", "version", "resolution", "clamp", "codes", "depths", "log_odds")


def save_volume(tree: Octree, path: str | Path) -> Path:
    """Write the leaves of a volume.

    The arrays are `format` and `version`, `resolution` (m), `clamp` (lower, upper and threshold as
    probabilities), and for each leaf, by increasing code: `codes` (int64, three interleaved keys of 16 bits,
    x lowest; key 32768 begins at the origin), `depths` (uint8; 16 is a voxel, 15 a cube of 8) and `log_odds`
    (float32).

    Parameters
    ----------
    tree : Octree
        The volume.
    path : str or Path
        The file to write.

    Returns
    -------
    Path
        The file written; the same volume always makes the same bytes.

    Raises
    ------
    OSError
        The file cannot be written.
    """
    leaves, target = tree.leaves(), Path(path)
    bounds = np.array([tree.clamp.lower, tree.clamp.upper, tree.clamp.threshold])
    file: BinaryIO
    with target.open("wb") as file:
        np.savez_compressed(
            file,
            format=np.array(FORMAT),
            version=np.array(VERSION),
            resolution=np.array(tree.resolution),
            clamp=bounds,
            codes=leaves.codes,
            depths=leaves.depths,
            log_odds=leaves.log_odds,
        )
    return target


def load_volume(path: str | Path) -> Octree:
    """Read what `save_volume` wrote.

    Parameters
    ----------
    path : str or Path
        The file.

    Raises
    ------
    OutputError
        The file cannot be read, is none of ours, of a later version, or damaged.
    """
    try:
        # a damaged file that numpy itself has opened would stay open
        with regular(path).open("rb") as content, np.load(content, allow_pickle=False) as file:
            arrays = {name: file[name] for name in _NAMES if name in file}
    except Exception as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else "not an npz file"
        raise OutputError(f"cannot read {path}: {reason}") from error
    if set(arrays) != set(_NAMES) or str(arrays["format"]) != FORMAT:
        raise OutputError(f"{path} is no volume", f"expected arrays {', '.join(_NAMES)}")
    if int(arrays["version"]) != VERSION:
        raise OutputError(f"{path} is of version {arrays['version']}, known is {VERSION}")
    try:
        clamp = Clamp(*(float(value) for value in arrays["clamp"]))
        leaves = Leaves(
            arrays["codes"].astype(np.int64), arrays["depths"].astype(np.uint8),
            arrays["log_odds"].astype(np.float32),
        )  # fmt: skip
        return Octree.from_leaves(leaves, float(arrays["resolution"]), clamp)
    except (GridError, TypeError, ValueError) as error:
        raise OutputError(f"{path} is damaged: {error}") from error
