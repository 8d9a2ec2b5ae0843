"""OctoMap's binary files (.bt): whether each leaf is free or occupied, for other programs."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from glassslam.errors import GridError, OutputError
from glassslam.volume import octomap_kernels as kernels
from glassslam.volume.octree import Leaves, Octree
from glassslam.volume.octree_kernels import DEPTH, Int64Array
from glassslam.volume.odds import Clamp

_MAGIC = b"# Octomap OcTree binary file"
_PROBLEMS = {
    kernels.TOO_SHORT: "ends in the middle of the tree",
    kernels.TOO_DEEP: f"has nodes below level {DEPTH}",
}


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
        b"%s\n# one byte pair per inner node: 1 free, 2 occupied, 3 inner, 0 unknown\n"
        b"id OcTree\nsize %d\nres %s\ndata\n" % (_MAGIC, nodes, repr(tree.resolution).encode())
    )
    target = Path(path)
    target.write_bytes(header + decided.binary())
    return target


def most_likely(tree: Octree) -> Octree:
    """A tree whose leaves are at the bounds: free or occupied, whichever is more likely."""
    leaves, clamp = tree.leaves(), tree.clamp
    bounds = np.where(leaves.log_odds >= clamp.occupied, clamp.high, clamp.low).astype(np.float32)
    return Octree.from_leaves(Leaves(leaves.codes, leaves.depths, bounds), tree.resolution, clamp)


def read_octomap(path: str | Path, clamp: Clamp | None = None) -> Octree:
    """Read a binary OctoMap file; its leaves come to lie at the bounds.

    Parameters
    ----------
    path : str or Path
        The file.
    clamp : Clamp, optional
        Bounds of the tree.

    Raises
    ------
    OutputError
        The file cannot be read, is of another kind, or is damaged.
    """
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise OutputError(f"cannot read {path}: {error.strerror}") from error
    size, resolution, data = _split(path, content)
    codes, depths, occupied = _parse(path, data if size else b"\0\0", size)
    order = np.argsort(codes, kind="stable")
    clamp = clamp or Clamp()
    values = np.where(occupied[order], clamp.high, clamp.low).astype(np.float32)
    try:
        return Octree.from_leaves(Leaves(codes[order], depths[order], values), resolution, clamp)
    except GridError as error:
        raise OutputError(f"{path}: {error.message}") from error


def _split(path: str | Path, content: bytes) -> tuple[int, float, bytes]:
    """Number of nodes, resolution and the binary part of a file."""
    header, mark, data = content.partition(b"\ndata\n")
    lines = header.split(b"\n")
    if not lines[0].startswith(_MAGIC):
        raise OutputError(f"{path} is no binary OctoMap file", "its first line would say so")
    words = [line.split() for line in lines[1:] if line.strip() and not line.startswith(b"#")]
    fields = {word[0]: word[1] for word in words if len(word) == 2}
    if not mark or fields.get(b"id") != b"OcTree":
        kind = fields.get(b"id", b"unknown").decode("ascii", "replace")
        raise OutputError(f"{path} holds a tree of kind {kind!r}", "only plain occupancy trees are read")
    try:
        return int(fields[b"size"]), float(fields[b"res"]), data
    except (KeyError, ValueError) as error:
        raise OutputError(f"{path}: size or resolution is missing or no number") from error


def _parse(
    path: str | Path, data: bytes, size: int
) -> tuple[Int64Array, NDArray[np.uint8], NDArray[np.bool_]]:
    """Leaves of the binary part, in the order of the file."""
    most = 4 * len(data)  # eight children for every two bytes
    codes, depths = np.empty(most, dtype=np.int64), np.empty(most, dtype=np.uint8)
    occupied = np.empty(most, dtype=np.bool_)
    read, count = kernels.read_nodes(np.frombuffer(data, dtype=np.uint8), codes, depths, occupied)
    if read < 0:
        raise OutputError(f"{path} {_PROBLEMS[read]}", "the file is damaged")
    nodes = count + read // 2 if size else 0
    if nodes != size:
        raise OutputError(f"{path} holds {nodes} nodes, its header says {size}", "the file is damaged")
    return codes[:count], depths[:count], occupied[:count]
