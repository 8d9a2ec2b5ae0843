"""Kernels of the octree: a pool of nodes in blocks of eight, addressed by Morton codes.

A voxel of the finest level has three keys of 16 bits; its code interleaves them, x lowest, so that the
three bits at each level choose one of eight children. Node 0 is the root. `first_child` holds the first of
a node's eight children, or `LEAF`; `log_odds` is NaN where nothing was observed, and that of an inner node is
the largest of its children. `pool` counts: nodes ever used, first free block (or `LEAF`), free blocks.
"""

import math
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from glassslam.accelerate import kernel
from glassslam.records import Float32Array

Int32Array: TypeAlias = NDArray[np.int32]
Int64Array: TypeAlias = NDArray[np.int64]

DEPTH = 16
LEAF = -1
USED, FREE, FREE_BLOCKS = 0, 1, 2
_ROOM = 8 * DEPTH
"""Nodes one new voxel can need at most."""


@kernel
def spread(key: int) -> int:
    """Bits of a 16 bit number moved to every third place."""
    bits = key & 0xFFFF
    bits = (bits | bits << 16) & 0x0000FF0000FF
    bits = (bits | bits << 8) & 0x00F00F00F00F
    bits = (bits | bits << 4) & 0x0C30C30C30C3
    return (bits | bits << 2) & 0x249249249249


@kernel
def gather(bits: int) -> int:
    """Every third bit of a 48 bit number moved together: undoes `spread`."""
    key = bits & 0x249249249249
    key = (key | key >> 2) & 0x0C30C30C30C3
    key = (key | key >> 4) & 0x00F00F00F00F
    key = (key | key >> 8) & 0x0000FF0000FF
    return (key | key >> 16) & 0xFFFF


@kernel
def encode(keys: Int64Array, codes: Int64Array) -> None:
    """Codes (n,) of keys (n, 3)."""
    for k in range(codes.size):
        codes[k] = spread(keys[k, 0]) | spread(keys[k, 1]) << 1 | spread(keys[k, 2]) << 2


@kernel
def decode(codes: Int64Array, keys: Int64Array) -> None:
    """Keys (n, 3) of codes (n,)."""
    for k in range(codes.size):
        keys[k, 0], keys[k, 1], keys[k, 2] = gather(codes[k]), gather(codes[k] >> 1), gather(codes[k] >> 2)


@kernel
def take_block(first_child: Int32Array, log_odds: Float32Array, pool: Int64Array, value: float) -> int:
    """First of eight fresh leaves that all have one value."""
    if pool[FREE] != LEAF:
        block = pool[FREE]
        pool[FREE] = first_child[block]
        pool[FREE_BLOCKS] -= 1
    else:
        block = pool[USED]
        pool[USED] += 8
    for node in range(block, block + 8):
        first_child[node] = LEAF
        log_odds[node] = value
    return int(block)


@kernel
def refresh(
    first_child: Int32Array, log_odds: Float32Array, pool: Int64Array, node: int, low: float, high: float
) -> None:
    """Value of an inner node from its children, which are merged when all are equal, stable leaves."""
    block = np.int64(first_child[node])
    value = log_odds[block]
    same = value <= low or value >= high
    for child in range(block, block + 8):
        same = same and first_child[child] == LEAF and log_odds[child] == log_odds[block]
        if not value >= log_odds[child] and not math.isnan(log_odds[child]):
            value = log_odds[child]
    log_odds[node] = value
    if same:
        first_child[node] = LEAF
        first_child[block] = pool[FREE]
        pool[FREE] = block
        pool[FREE_BLOCKS] += 1


@kernel
def shared_depth(a: int, b: int) -> int:
    """Depth of the deepest node that holds both voxels."""
    differing, depth = a ^ b, DEPTH
    while differing:
        differing >>= 3
        depth -= 1
    return depth


@kernel
def enter(
    first_child: Int32Array,
    log_odds: Float32Array,
    pool: Int64Array,
    codes: Int64Array,
    depths: Int64Array,
    values: Float32Array,
    low: float,
    high: float,
    assign: bool,
) -> int:
    """Add to, or set, the log odds of nodes given in the order of their codes; how many were done.

    Neighbours in that order share their ancestors, which are brought up to date once, when the last of
    them is done. Fewer than all are done when the pool must grow first. Nodes above the finest level can
    only be set, in a part of the tree where nothing is known yet.
    """
    path = np.zeros(DEPTH + 1, dtype=np.int64)
    depth = done = 0
    for k in range(codes.size):
        if first_child.size - pool[USED] + 8 * pool[FREE_BLOCKS] < _ROOM:
            break
        done += 1
        if k > 0:
            common = shared_depth(codes[k - 1], codes[k])
            for level in range(depth - 1, common, -1):
                refresh(first_child, log_odds, pool, path[level], low, high)
            depth = min(depth, common)
        node, change = path[depth], values[k]
        while depth < depths[k]:
            if first_child[node] == LEAF:
                known = log_odds[node]
                if not assign and ((change >= 0 and known >= high) or (change <= 0 and known <= low)):
                    break
                first_child[node] = take_block(first_child, log_odds, pool, known)
            node = np.int64(first_child[node]) + (codes[k] >> 3 * (DEPTH - 1 - depth) & 7)
            depth += 1
            path[depth] = node
        if depth == depths[k]:
            known = np.float32(0.0) if assign or math.isnan(log_odds[node]) else log_odds[node]
            log_odds[node] = min(max(known + change, low), high)
    for level in range(depth - 1, -1, -1):
        refresh(first_child, log_odds, pool, path[level], low, high)
    return done


@kernel
def look_up(
    first_child: Int32Array, log_odds: Float32Array, codes: Int64Array, depth: int, out: Float32Array
) -> None:
    """Log odds of the nodes that hold some voxels, not deeper than `depth`; NaN where nothing is known."""
    for k in range(codes.size):
        node = np.int64(0)
        for level in range(depth):
            if first_child[node] == LEAF:
                break
            node = np.int64(first_child[node]) + (codes[k] >> 3 * (DEPTH - 1 - level) & 7)
        out[k] = log_odds[node]


@kernel
def list_leaves(
    first_child: Int32Array,
    log_odds: Float32Array,
    deepest: int,
    codes: Int64Array,
    depths: NDArray[np.uint8],
    values: Float32Array,
) -> int:
    """Write the known leaves of the tree cut at a depth, in order; how many (empty arrays: just that)."""
    nodes = np.zeros(8 * DEPTH + 1, dtype=np.int64)
    places = np.zeros(8 * DEPTH + 1, dtype=np.int64)
    levels = np.zeros(8 * DEPTH + 1, dtype=np.int64)
    waiting, count = 1, 0
    while waiting:
        waiting -= 1
        node, place, level = nodes[waiting], places[waiting], levels[waiting]
        if first_child[node] != LEAF and level < deepest:
            for child in range(7, -1, -1):
                nodes[waiting] = np.int64(first_child[node]) + child
                places[waiting] = place | child << 3 * (DEPTH - 1 - level)
                levels[waiting] = level + 1
                waiting += 1
        elif not math.isnan(log_odds[node]):
            if codes.size:
                codes[count], depths[count], values[count] = place, level, log_odds[node]
            count += 1
    return count


@kernel
def count_nodes(first_child: Int32Array, log_odds: Float32Array) -> tuple[int, int]:
    """Number of known nodes, inner ones included, and of those that are leaves."""
    waiting = np.zeros(8 * DEPTH + 1, dtype=np.int64)
    size, known, leaves = 1, 0, 0
    while size:
        size -= 1
        node = waiting[size]
        known += not math.isnan(log_odds[node])
        if first_child[node] == LEAF:
            leaves += not math.isnan(log_odds[node])
            continue
        for child in range(8):
            waiting[size] = np.int64(first_child[node]) + child
            size += 1
    return known, leaves
