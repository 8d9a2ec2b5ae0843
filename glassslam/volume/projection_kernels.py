"""Kernels that look at a volume from above."""

import numpy as np
from numpy.typing import NDArray

from glassslam.accelerate import kernel
from glassslam.records import Float32Array
from glassslam.volume.octree_kernels import Int64Array


@kernel
def project_leaves(
    keys: Int64Array,
    edges: Int64Array,
    log_odds: Float32Array,
    corner: Int64Array,
    bottom: int,
    top: int,
    largest: Float32Array,
    smallest: Float32Array,
    total: Float32Array,
    count: NDArray[np.int32],
) -> None:
    """Gather, per column, the extremes and the sum of the log odds of its voxels in a band, and their number.

    The band is `bottom` to before `top`, `corner` the key (x, y) of the cell (0, 0); `largest` must be
    filled with -inf, `smallest` with inf, the others with 0. Cubes may reach over the border of the cells.
    """
    rows, columns = largest.shape
    for k in range(log_odds.size):
        layers = min(keys[k, 2] + edges[k], top) - max(keys[k, 2], bottom)
        if layers <= 0:
            continue
        left, lower = keys[k, 0] - corner[0], keys[k, 1] - corner[1]
        for row in range(max(lower, 0), min(lower + edges[k], rows)):
            for column in range(max(left, 0), min(left + edges[k], columns)):
                largest[row, column] = max(largest[row, column], log_odds[k])
                smallest[row, column] = min(smallest[row, column], log_odds[k])
                total[row, column] += layers * log_odds[k]
                count[row, column] += layers


@kernel
def highest(keys: Int64Array, edges: Int64Array, corner: Int64Array, tops: Int64Array) -> None:
    """Raise `tops`, per column, to the key above the highest of some cubes, which all lie inside."""
    for k in range(edges.size):
        left, lower, upper = keys[k, 0] - corner[0], keys[k, 1] - corner[1], keys[k, 2] + edges[k]
        for row in range(lower, lower + edges[k]):
            for column in range(left, left + edges[k]):
                tops[row, column] = max(tops[row, column], upper)
