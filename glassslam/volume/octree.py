"""A log-odds octree of voxels, with clamping and pruning (Hornung et al. 2013; OctoMap)."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from glassslam.errors import GridError
from glassslam.records import Float32Array, FloatArray
from glassslam.volume import octree_kernels as kernels
from glassslam.volume.leaves import CENTRE, Leaves, check_leaves, decode, encode, room_for
from glassslam.volume.octomap_kernels import write_nodes
from glassslam.volume.octree_kernels import DEPTH, Int64Array
from glassslam.volume.odds import Clamp

__all__ = ["CENTRE", "Leaves", "Memory", "Octree", "decode", "encode"]

_FIRST_NODES = 1 << 12


@dataclass(frozen=True, slots=True)
class Memory:
    """What a tree takes.

    Attributes
    ----------
    nodes, leaves : int
        Known nodes, inner ones included, and those without children.
    used_bytes, reserved_bytes : int
        Bytes of the blocks in use, and of all that are held.
    full_grid_bytes : int
        What a dense float32 grid over the same bounding box would take.
    """

    nodes: int
    leaves: int
    used_bytes: int
    reserved_bytes: int
    full_grid_bytes: int


class Octree:
    """A map of cubic voxels in 16 levels around the origin.

    Nodes live in two arrays, an int32 index of children and a float32 of log odds: 8 bytes a node.

    Parameters
    ----------
    resolution : float
        Edge of a voxel, m; the tree spans 65536 of them along each axis.
    clamp : Clamp, optional
        Bounds and threshold of the voxels.

    Raises
    ------
    GridError
        A resolution that is not positive.

    Examples
    --------
    >>> import numpy as np
    >>> tree = Octree(0.1)
    >>> point = np.array([[1.0, 2.0, 0.3]])
    >>> tree.add(tree.codes(point), np.array([0.85], dtype=np.float32))
    >>> round(float(tree.log_odds_at(point)[0]), 2)
    0.85
    """

    def __init__(self, resolution: float = 0.05, clamp: Clamp | None = None) -> None:
        if not (np.isfinite(resolution) and resolution > 0):
            raise GridError(f"resolution of a volume is {resolution} m", "it must be positive")
        self.resolution = float(resolution)
        self.clamp = clamp or Clamp()
        self._first_child = np.full(_FIRST_NODES, kernels.LEAF, dtype=np.int32)
        self._log_odds = np.full(_FIRST_NODES, np.nan, dtype=np.float32)
        self._pool = np.array([8, kernels.LEAF, 0], dtype=np.int64)

    @classmethod
    def from_leaves(cls, leaves: Leaves, resolution: float, clamp: Clamp | None = None) -> Self:
        """A tree made of cubes that do not overlap, in the order of their codes.

        Raises
        ------
        GridError
            Cubes overlap, are not in order, are not aligned with their level or have no value.
        """
        tree = cls(resolution, clamp)
        check_leaves(leaves)
        tree._enter(leaves.codes, leaves.depths.astype(np.int64), leaves.log_odds, assign=True)
        return tree

    def codes(self, points: FloatArray) -> Int64Array:
        """Codes (n,) of the voxels that hold points (n, 3), m.

        Raises
        ------
        GridError
            A point is not finite or outside of the tree.
        """
        keys = np.floor(np.asarray(points, dtype=np.float64) / self.resolution) + CENTRE
        if not ((keys >= 0) & (keys < 2 * CENTRE)).all():
            raise GridError(
                "a point is not finite or outside of the volume",
                f"voxels of {self.resolution:g} m reach {CENTRE * self.resolution:g} m from the origin",
            )
        return encode(keys.astype(np.int64))

    def add(self, codes: Int64Array, log_odds: Float32Array) -> None:
        """Add log odds (n,) to voxels (n,), clamped after each; the same voxel may be given several times."""
        order = np.argsort(codes, kind="stable")
        self.add_sorted(codes[order], np.asarray(log_odds, dtype=np.float32)[order])

    def add_sorted(self, codes: Int64Array, log_odds: Float32Array) -> None:
        """`add` for codes in increasing order."""
        self._enter(codes, np.full(codes.size, DEPTH), np.asarray(log_odds, dtype=np.float32), assign=False)

    def log_odds_of(self, codes: Int64Array, depth: int = DEPTH) -> Float32Array:
        """Log odds (n,) of voxels, or of the nodes that hold them at a depth; NaN where never observed."""
        out = np.empty(codes.size, dtype=np.float32)
        kernels.look_up(self._first_child, self._log_odds, codes, depth, out)
        return out

    def log_odds_at(self, points: FloatArray, depth: int = DEPTH) -> Float32Array:
        """Log odds (n,) at points (n, 3), m; NaN where never observed."""
        return self.log_odds_of(self.codes(points), depth)

    def leaves(self, depth: int = DEPTH) -> Leaves:
        """All known leaves of the tree cut at a depth, where a node has the largest value of its children.

        Raises
        ------
        GridError
            A depth that is not 0 to 16.
        """
        if not 0 <= depth <= DEPTH:
            raise GridError(f"there is no depth {depth}", f"choose one from 0 to {DEPTH}")
        count = self._list(depth, room_for(0))
        leaves = room_for(count)
        if count:
            self._list(depth, leaves)
        return leaves

    def occupied(self, depth: int = DEPTH) -> Leaves:
        """The leaves that count as occupied."""
        leaves = self.leaves(depth)
        return leaves.where(leaves.log_odds >= self.clamp.occupied)

    def centres(self, leaves: Leaves) -> FloatArray:
        """Centres (n, 3) of cubes, m."""
        return np.asarray((leaves.keys - CENTRE + 0.5 * leaves.edges[:, None]) * self.resolution)

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lowest and highest corner (3,) of all that is known, m; both zero for an empty tree."""
        low, high = self.key_bounds()
        return np.multiply(low - CENTRE, self.resolution), np.multiply(high - CENTRE, self.resolution)

    def key_bounds(self) -> tuple[Int64Array, Int64Array]:
        """Lowest key of what is known and one past the highest, each (3,)."""
        leaves = self.leaves()
        if not len(leaves):
            return np.full(3, CENTRE), np.full(3, CENTRE)
        keys = leaves.keys
        return keys.min(axis=0), (keys + leaves.edges[:, None]).max(axis=0)

    def volumes(self) -> tuple[int, int]:
        """Number of voxels that are occupied, and of those that are free; larger cubes count as many."""
        leaves = self.leaves()
        voxels, occupied = leaves.edges**3, leaves.log_odds >= self.clamp.occupied
        return int(voxels[occupied].sum()), int(voxels[~occupied].sum())

    def memory(self) -> Memory:
        """Nodes and bytes."""
        nodes, leaves = self.count()
        used = int(self._pool[kernels.USED]) - 8 * int(self._pool[kernels.FREE_BLOCKS])
        low, high = self.key_bounds()
        reserved = self._first_child.nbytes + self._log_odds.nbytes
        return Memory(nodes, leaves, 8 * used, reserved, 4 * int(np.prod(high - low)))

    def _enter(self, codes: Int64Array, depths: Int64Array, values: Float32Array, *, assign: bool) -> None:
        low, high, done = self.clamp.low, self.clamp.high, 0
        while done < codes.size:
            done += kernels.enter(
                self._first_child, self._log_odds, self._pool, codes[done:], depths[done:], values[done:],
                low, high, assign,
            )  # fmt: skip
            if done < codes.size:
                self._grow()

    def count(self) -> tuple[int, int]:
        """Number of known nodes, inner ones included, and of those that are leaves."""
        return kernels.count_nodes(self._first_child, self._log_odds)

    def binary(self) -> bytes:
        """The tree as OctoMap's binary files hold it: two bytes per inner node, the root first."""
        nodes, leaves = self.count()
        out = np.empty(2 * (nodes - leaves), dtype=np.uint8)
        if out.size:
            write_nodes(self._first_child, self._log_odds, self.clamp.occupied, out)
        return out.tobytes()

    def _list(self, depth: int, leaves: Leaves) -> int:
        return kernels.list_leaves(
            self._first_child, self._log_odds, depth, leaves.codes, leaves.depths, leaves.log_odds
        )

    def _grow(self) -> None:
        more = self._first_child.size // 2
        self._first_child = np.concatenate((self._first_child, np.full(more, kernels.LEAF, dtype=np.int32)))
        self._log_odds = np.concatenate((self._log_odds, np.full(more, np.nan, dtype=np.float32)))
