"""Kernels of OctoMap's binary tree: two bytes per inner node, two bits per child, parents first."""

import math

import numpy as np
from numpy.typing import NDArray

from glassslam.accelerate import kernel
from glassslam.records import Float32Array
from glassslam.volume.octree_kernels import DEPTH, LEAF, Int32Array

FREE, OCCUPIED, INNER = 1, 2, 3


@kernel
def write_nodes(
    first_child: Int32Array, log_odds: Float32Array, threshold: float, out: NDArray[np.uint8]
) -> int:
    """Write all inner nodes below and with the root, which must be one; the number of bytes."""
    waiting = np.zeros(8 * DEPTH + 1, dtype=np.int64)
    size, written = 1, 0
    while size:
        size -= 1
        block, bits = np.int64(first_child[waiting[size]]), 0
        for child in range(7, -1, -1):
            node = block + child
            if first_child[node] != LEAF:
                bits |= INNER << 2 * child
                waiting[size] = node
                size += 1
            elif not math.isnan(log_odds[node]):
                bits |= (OCCUPIED if log_odds[node] >= threshold else FREE) << 2 * child
        out[written], out[written + 1] = bits & 0xFF, bits >> 8
        written += 2
    return written
