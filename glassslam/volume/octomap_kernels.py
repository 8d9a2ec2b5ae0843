"""Kernels of OctoMap's binary tree: two bytes per inner node, two bits per child, parents first."""

import math

import numpy as np
from numpy.typing import NDArray

from glassslam.accelerate import kernel
from glassslam.records import Float32Array
from glassslam.volume.octree_kernels import DEPTH, LEAF, Int32Array, Int64Array

FREE, OCCUPIED, INNER = 1, 2, 3
TOO_SHORT, TOO_DEEP = -1, -2


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


@kernel
def read_nodes(
    data: NDArray[np.uint8], codes: Int64Array, depths: NDArray[np.uint8], occupied: NDArray[np.bool_]
) -> tuple[int, int]:
    """Write the leaves a binary tree holds, in its own order; bytes read (or what is wrong) and leaves."""
    places = np.zeros(8 * DEPTH + 1, dtype=np.int64)
    levels = np.zeros(8 * DEPTH + 1, dtype=np.int64)
    size, read, count = 1, 0, 0
    while size:
        size -= 1
        place, level = places[size], levels[size]
        if level == DEPTH:
            return TOO_DEEP, count
        if read + 2 > data.size:
            return TOO_SHORT, count
        bits = np.int64(data[read]) | np.int64(data[read + 1]) << 8
        read += 2
        for child in range(7, -1, -1):
            state = bits >> 2 * child & 3
            here = place | child << 3 * (DEPTH - 1 - level)
            if state == INNER:
                places[size], levels[size] = here, level + 1
                size += 1
            elif state:
                codes[count], depths[count], occupied[count] = here, level + 1, state == OCCUPIED
                count += 1
    return read, count
