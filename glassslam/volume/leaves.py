"""Voxels by number: keys, Morton codes, and the cubes a tree is made of."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glassslam.errors import GridError
from glassslam.records import Float32Array
from glassslam.volume import octree_kernels as kernels
from glassslam.volume.octree_kernels import DEPTH, Int64Array

CENTRE = 1 << (DEPTH - 1)
"""Key of the voxel whose lowest corner is the origin."""


@dataclass(frozen=True, slots=True)
class Leaves:
    """Cubes of one value each, in the order of their codes.

    Attributes
    ----------
    codes : ndarray of int64, shape (n,)
        Morton code of the lowest voxel of each cube.
    depths : ndarray of uint8, shape (n,)
        Level of each: 16 is a single voxel, each level less doubles the edge.
    log_odds : ndarray of float32, shape (n,)
        Natural log odds of being occupied.
    """

    codes: Int64Array
    depths: NDArray[np.uint8]
    log_odds: Float32Array

    @property
    def keys(self) -> Int64Array:
        """Keys (n, 3) of the lowest voxel of each cube."""
        return decode(self.codes)

    @property
    def edges(self) -> Int64Array:
        """Edge of each cube in voxels, shape (n,)."""
        return np.left_shift(np.int64(1), DEPTH - self.depths.astype(np.int64))

    def where(self, chosen: NDArray[np.bool_]) -> "Leaves":
        """Those for which `chosen`, shape (n,), is true."""
        return Leaves(self.codes[chosen], self.depths[chosen], self.log_odds[chosen])

    def voxels(self) -> "Leaves":
        """The same, larger cubes taken apart into voxels of the finest level."""
        counts = np.left_shift(np.int64(1), 3 * (DEPTH - self.depths.astype(np.int64)))
        ends = np.cumsum(counts)
        within: Int64Array = np.arange(int(counts.sum())) - np.repeat(ends - counts, counts)
        depths = np.full(within.size, DEPTH, dtype=np.uint8)
        return Leaves(np.repeat(self.codes, counts) + within, depths, np.repeat(self.log_odds, counts))

    def __len__(self) -> int:
        return self.codes.size


def room_for(count: int) -> Leaves:
    """Leaves to be filled in."""
    return Leaves(
        np.empty(count, dtype=np.int64),
        np.empty(count, dtype=np.uint8),
        np.empty(count, dtype=np.float32),
    )


def encode(keys: Int64Array) -> Int64Array:
    """Morton codes (n,) of keys (n, 3), each from 0 to 65535."""
    codes = np.empty(len(keys), dtype=np.int64)
    kernels.encode(np.ascontiguousarray(keys, dtype=np.int64), codes)
    return codes


def decode(codes: Int64Array) -> Int64Array:
    """Keys (n, 3) of Morton codes (n,)."""
    keys = np.empty((codes.size, 3), dtype=np.int64)
    kernels.decode(np.ascontiguousarray(codes, dtype=np.int64), keys)
    return keys


def check_leaves(leaves: Leaves) -> None:
    """Refuse leaves that are not those of a tree.

    Raises
    ------
    GridError
        Cubes overlap, are not in order, are not aligned with their level, or have no value.
    """
    codes, depths = leaves.codes, leaves.depths.astype(np.int64)
    if codes.size == 0:
        return
    if depths.max() > DEPTH or codes.min() < 0 or np.isnan(leaves.log_odds).any():
        raise GridError("a leaf of a volume lies outside of the tree or has no value")
    voxels = np.left_shift(np.int64(1), 3 * (DEPTH - depths))
    ends = codes + voxels
    if (codes % voxels).any() or (codes[1:] < ends[:-1]).any() or ends[-1] > 1 << (3 * DEPTH):
        raise GridError("leaves of a volume overlap, are out of order or not aligned with their level")
