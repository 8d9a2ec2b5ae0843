"""OctoMap's binary files (.bt): whether each leaf is free or occupied, for other programs."""

from pathlib import Path

import numpy as np

from glassslam.errors import OutputError
from glassslam.volume.octree import Leaves, Octree


def write_octomap(tree: Octree, path: str | Path) -> Path:
    """Write a binary OctoMap file: every leaf becomes as certain as it can be, equal ones are merged.

    Parameters
    ----------
    tree : Octree
        The volume.
    path : str or Path
        The file, usually .bt.

    Returns
    -------
    Path
        The file written.

    Raises
    ------
    OutputError
        The whole span of the tree is one single leaf, which the format cannot say.
    OSError
        The file cannot be written.
    """
    decided = most_likely(tree)
    nodes, _ = decided.count()
    if nodes == 1:
        raise OutputError("a volume of one leaf that spans everything has no OctoMap file")
    header = (
        b"# Octomap OcTree binary file\n"
        b"# one byte pair per inner node: 1 free, 2 occupied, 3 inner, 0 unknown\n"
        b"id OcTree\nsize %d\nres %s\ndata\n" % (nodes, repr(tree.resolution).encode())
    )
    target = Path(path)
    target.write_bytes(header + decided.binary())
    return target


def most_likely(tree: Octree) -> Octree:
    """A tree whose leaves are at the bounds: free or occupied, whichever is more likely."""
    leaves, clamp = tree.leaves(), tree.clamp
    bounds = np.where(leaves.log_odds >= clamp.occupied, clamp.high, clamp.low).astype(np.float32)
    return Octree.from_leaves(Leaves(leaves.codes, leaves.depths, bounds), tree.resolution, clamp)
