"""Occupied voxels as a point cloud for other programs."""

from pathlib import Path

import numpy as np

from glassslam.volume.colours import height_colours
from glassslam.volume.octree import Octree
from glassslam.volume.odds import probabilities

_VERTEX = np.dtype(
    [
        ("x", "<f4"), ("y", "<f4"), ("z", "<f4"),
        ("red", "u1"), ("green", "u1"), ("blue", "u1"),
        ("probability", "<f4"),
    ]
)  # fmt: skip
_PLY_NAMES = {"f4": "float", "u1": "uchar"}


def write_ply(tree: Octree, path: str | Path) -> Path:
    """Write the centre of every occupied voxel, coloured by height, as binary little-endian PLY.

    Parameters
    ----------
    tree : Octree
        The volume; merged voxels are taken apart.
    path : str or Path
        The file to write.

    Returns
    -------
    Path
        The file written; coordinates in m, map frame.

    Raises
    ------
    OSError
        The file cannot be written.
    """
    voxels = tree.occupied().voxels()
    centres = tree.centres(voxels)
    rows = np.zeros(len(voxels), dtype=_VERTEX)
    rows["x"], rows["y"], rows["z"] = centres.T
    z = centres[:, 2]
    colours = height_colours(z, z.min(initial=np.inf), z.max(initial=-np.inf)) if len(z) else np.empty((0, 3))
    rows["red"], rows["green"], rows["blue"] = colours.T
    rows["probability"] = probabilities(voxels.log_odds)
    target = Path(path)
    target.write_bytes(_header(len(rows)).encode("ascii") + rows.tobytes())
    return target


def _header(count: int) -> str:
    kinds = {name: _PLY_NAMES[_VERTEX[name].str[1:]] for name in _VERTEX.names or ()}
    properties = "".join(f"property {kind} {name}\n" for name, kind in kinds.items())
    return (
        "ply\nformat binary_little_endian 1.0\ncomment centres of occupied voxels, m\n"
        f"element vertex {count}\n{properties}end_header\n"
    )
