"""Kernels of branch and bound: discretised scans and the search itself (Hess et al. 2016, section V)."""

import math

import numpy as np
from numpy.typing import NDArray

from glassslam.accelerate import kernel
from glassslam.matching.pyramid_kernels import Bytes
from glassslam.records import FloatArray

Int32s = NDArray[np.int32]
Integers = NDArray[np.int64]


@kernel
def discretise(
    points: FloatArray,
    x: float,
    y: float,
    first_angle: float,
    angle_step: float,
    count: int,
    inverse_cell: float,
    rows: int,
    columns: int,
    pad: int,
    reach: int,
    index: Int32s,
    lengths: Integers,
) -> None:
    """Flat indices into a padded grid of the scan turned by each candidate angle.

    Points that no offset of the search brings into the grid are left out. `lengths[a]` is the
    number of points kept in row a of `index`; (x, y) is the scan position from the grid's corner, m.
    """
    stride = columns + 2 * pad
    for a in range(count):
        angle = first_angle + a * angle_step
        cosine, sine = math.cos(angle), math.sin(angle)
        n = 0
        for k in range(points.shape[0]):
            px, py = points[k, 0], points[k, 1]
            c = math.floor((cosine * px - sine * py + x) * inverse_cell)
            r = math.floor((sine * px + cosine * py + y) * inverse_cell)
            if -reach <= c < columns + reach and -reach <= r < rows + reach:
                index[a, n] = (r + pad) * stride + c + pad
                n += 1
        lengths[a] = n


@kernel
def _score(level: Bytes, index: Int32s, a: int, n: int, offset: int) -> int:
    total = np.int64(0)
    for k in range(n):
        total += np.int64(level[index[a, k] + offset])
    return int(total)


@kernel
def _coarse_scores(
    level: Bytes,
    stride: int,
    index: Int32s,
    lengths: Integers,
    window: int,
    step: int,
    scores: NDArray[np.int32],
) -> None:
    """Upper bounds of all coarse candidates, shape (angles, offsets_y, offsets_x)."""
    for a in range(index.shape[0]):
        for iy in range(scores.shape[1]):
            for ix in range(scores.shape[2]):
                offset = (iy * step - window) * stride + ix * step - window
                scores[a, iy, ix] = _score(level, index, a, lengths[a], offset)


@kernel
def _better_children(
    level: Bytes,
    stride: int,
    index: Int32s,
    lengths: Integers,
    window: int,
    half: int,
    parent: tuple[int, int, int],
    best: int,
    child: Integers,
) -> int:
    """Write the quarters (score, dx, dy) of a candidate that beat `best`, rising by score; their number."""
    a, x, y = parent
    count = 0
    for quarter in range(4):
        nx, ny = x + (quarter & 1) * half, y + (quarter >> 1) * half
        if nx > window or ny > window:
            continue
        score = _score(level, index, a, lengths[a], ny * stride + nx)
        if score <= best:
            continue
        at = count
        while at > 0 and child[at - 1, 0] > score:
            child[at] = child[at - 1]
            at -= 1
        child[at, 0], child[at, 1], child[at, 2] = score, nx, ny
        count += 1
    return count


@kernel
def _descend(
    levels: Bytes,
    stride: int,
    index: Int32s,
    lengths: Integers,
    window: int,
    start_level: int,
    candidate: tuple[int, int, int, int],
    best: int,
    found: Integers,
    stack: Integers,
) -> int:
    """Depth-first search below one coarse candidate (angle, dx, dy, bound) better than `best`.

    The best leaf goes into `found`, its score is returned.
    """
    top = 0
    a = candidate[0]
    stack[0, 0], stack[0, 1], stack[0, 2], stack[0, 3] = start_level, candidate[1], candidate[2], candidate[3]
    child = np.empty((4, 3), dtype=np.int64)
    while top >= 0:
        level, x, y, bound = stack[top, 0], stack[top, 1], stack[top, 2], stack[top, 3]
        top -= 1
        if bound <= best:
            continue
        if level == 0:
            best = bound
            found[0], found[1], found[2] = a, x, y
            continue
        count = _better_children(
            levels[level - 1], stride, index, lengths, window, 1 << (level - 1), (a, x, y), best, child
        )
        for c in range(count):
            top += 1
            stack[top, 0], stack[top, 1], stack[top, 2], stack[top, 3] = (
                level - 1, child[c, 1], child[c, 2], child[c, 0],
            )  # fmt: skip
    return best


@kernel
def branch_and_bound(
    levels: Bytes,
    stride: int,
    index: Int32s,
    lengths: Integers,
    window: int,
    start_level: int,
    threshold: int,
    found: Integers,
) -> int:
    """Best (angle, dx, dy) with a score sum above `threshold`; returns the score, or `threshold` when none.

    `levels` has shape (depth, cells of the padded grid): level h holds maxima over windows of edge 2^h.
    """
    step = 1 << start_level
    offsets = (2 * window) // step + 1
    scores = np.empty((index.shape[0], offsets, offsets), dtype=np.int32)
    _coarse_scores(levels[start_level], stride, index, lengths, window, step, scores)
    flat = scores.ravel()
    order = np.argsort(-flat, kind="mergesort")
    stack = np.empty((4 * (start_level + 2), 4), dtype=np.int64)
    best = threshold
    for k in order:
        if flat[k] <= best:
            break
        a = k // (offsets * offsets)
        dy = (k // offsets) % offsets * step - window
        dx = k % offsets * step - window
        candidate = (a, dx, dy, int(flat[k]))
        best = _descend(levels, stride, index, lengths, window, start_level, candidate, best, found, stack)
    return best
