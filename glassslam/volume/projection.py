"""A volume seen from above: the fused 2D map, slices, and the height of what is highest."""

import math
from collections.abc import Iterable, Iterator
from typing import Literal, TypeAlias, get_args

import numpy as np

from glassslam.errors import GridError
from glassslam.grid.probability_grid import MOST_CELLS
from glassslam.records import Float32Array, FloatArray
from glassslam.slam.result import OccupancyMap
from glassslam.volume import projection_kernels as kernels
from glassslam.volume.octree import CENTRE, Leaves, Octree
from glassslam.volume.octree_kernels import Int64Array
from glassslam.volume.odds import probabilities

Rule: TypeAlias = Literal["max", "pool"]
Band: TypeAlias = tuple[float, float]


def project(tree: Octree, band: Band, rule: Rule = "max") -> OccupancyMap:
    """The voxels of a height band projected on x-y (section 3 of the lidar and 3D ultrasonic fusion).

    A cell is unknown where no voxel of its column and band was observed. With `max` the most occupied voxel
    of its column decides where any counts as occupied: what is in the way of a robot at any height.
    Otherwise the most free one does: voxels seen once only would hide what is known of those beside them.
    With `pool` a cell is the logarithmic opinion pool of the known voxels, all of the same weight: one
    voxel of a lamp in a column of free ones reads as free.

    Parameters
    ----------
    tree : Octree
        The volume.
    band : tuple of float
        Lowest and highest z, m, widened to whole voxels.
    rule : {"max", "pool"}
        What becomes of a column.

    Raises
    ------
    GridError
        The band is empty or not finite, there is no such rule, or the map would be too large for memory.
    """
    return next(project_bands(tree, [band], rule))


def project_bands(tree: Octree, bands: Iterable[Band], rule: Rule = "max") -> Iterator[OccupancyMap]:
    """`project` for several bands, one after the other: the voxels are gathered once.

    Raises
    ------
    GridError
        As by `project`.
    """
    if rule not in get_args(Rule):
        raise GridError(f"there is no rule {rule!r} of projection", f"known: {', '.join(get_args(Rule))}")
    leaves, low, size = tree.leaves(), *_extent(tree)
    keys, edges = leaves.keys, leaves.edges
    for band in bands:
        bottom, top = band_keys(tree, band)
        largest = np.full(size, -np.inf, dtype=np.float32)
        smallest = np.full(size, np.inf, dtype=np.float32)
        total, count = np.zeros(size, dtype=np.float32), np.zeros(size, dtype=np.int32)
        kernels.project_leaves(
            keys, edges, leaves.log_odds, low, bottom, top, largest, smallest, total, count
        )
        decisive = np.where(largest >= tree.clamp.occupied, largest, smallest)
        value = decisive if rule == "max" else total / np.maximum(count, 1)
        probability = np.where(count > 0, probabilities(value), np.float32(np.nan))
        yield OccupancyMap(probability, tree.resolution, _corner(tree, low))


def band_keys(tree: Octree, band: Band) -> tuple[int, int]:
    """Key of the lowest layer of a band of heights, and of the one after the highest.

    Raises
    ------
    GridError
        The band is empty or not finite.
    """
    low, high = band
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise GridError(f"there is no height from {low:g} to {high:g} m", "give the lower one first")
    # A bound meant to lie between two layers may miss by the last bit of a division, or lie beyond the tree.
    bottom, top = (min(max(height / tree.resolution, -CENTRE), CENTRE) for height in band)
    return math.floor(bottom + 1e-6) + CENTRE, math.ceil(top - 1e-6) + CENTRE


def top_heights(tree: Octree, leaves: Leaves) -> tuple[Float32Array, tuple[float, float]]:
    """Upper side of the highest of some leaves in every column, m, and the corner of cell (0, 0).

    Returns
    -------
    heights : ndarray of float32, shape (rows, columns)
        NaN where there is none. Row 0 is the lowest y.
    origin : tuple of float
        Lower left corner of cell (0, 0), m.
    """
    low, size = _extent(tree)
    tops: Int64Array = np.full(size, -1, dtype=np.int64)
    kernels.highest(leaves.keys, leaves.edges, low, tops)
    heights: FloatArray = np.where(tops < 0, np.nan, (tops - CENTRE) * tree.resolution)
    return heights.astype(np.float32), _corner(tree, low)


def _extent(tree: Octree) -> tuple[Int64Array, tuple[int, int]]:
    """Key (x, y) of the lowest cell of all that is known, and the number of rows and columns."""
    low, high = tree.key_bounds()
    columns, rows = (high - low)[:2].tolist()
    if columns * rows > MOST_CELLS:
        width, length = columns * tree.resolution, rows * tree.resolution
        raise GridError(
            f"{width:.0f} x {length:.0f} m in voxels of {tree.resolution:g} m are too many for a map",
            "raise volume.resolution",
        )
    return low[:2].copy(), (rows, columns)


def _corner(tree: Octree, low: Int64Array) -> tuple[float, float]:
    x, y = ((low - CENTRE) * tree.resolution).tolist()
    return x, y
