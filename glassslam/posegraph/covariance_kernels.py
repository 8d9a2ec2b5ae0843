"""Kernels for covariances from the sparse factor, without any inverse."""

import numpy as np

from glassslam.accelerate import kernel
from glassslam.posegraph.ldl_kernels import subtract_column
from glassslam.posegraph.linearise_kernels import residual_and_jacobians
from glassslam.posegraph.structure_kernels import Integers
from glassslam.records import FloatArray


@kernel
def _paths(a: int, b: int, parent: Integers, seen_by: Integers, mark: int, path: Integers) -> int:
    """Columns from a and from b to the root of the elimination tree, ascending in `path`; their number."""
    length = 0
    for start in (a, b):
        i = start
        while i >= 0 and seen_by[i] != mark:
            seen_by[i] = mark
            path[length] = i
            length += 1
            i = parent[i]
    path[:length].sort()
    return length


@kernel
def _add_weighted_square(y: FloatArray, inverse: FloatArray, out: FloatArray) -> None:
    """Add Y^T D^-1 Y to `out`, shape (3, 3)."""
    for r in range(3):
        u, v, w = y[r], y[3 + r], y[6 + r]
        p = u * inverse[0] + v * inverse[3] + w * inverse[6]
        q = u * inverse[1] + v * inverse[4] + w * inverse[7]
        s = u * inverse[2] + v * inverse[5] + w * inverse[8]
        for c in range(3):
            out[r, c] += p * y[c] + q * y[3 + c] + s * y[6 + c]


@kernel
def relative_covariances(
    poses: FloatArray,
    pairs: Integers,
    variable: Integers,
    parent: Integers,
    factor_start: Integers,
    factor_row: Integers,
    factor: FloatArray,
    inverse: FloatArray,
    out: FloatArray,
) -> None:
    """J Sigma J^T of the pose of b in the frame of a for each pair, into `out` (k, 3, 3).

    With the information matrix L D L^T this is Y^T D^-1 Y, Y = L^-1 J^T: only the columns on the
    way from a and b to the root of the elimination tree take part.
    """
    n = parent.size
    y, seen_by, path = np.zeros((n, 9)), np.full(n, -1, dtype=np.int64), np.empty(n, dtype=np.int64)
    zero, identity = np.zeros(3), np.eye(3)
    out[:] = 0.0
    for k in range(pairs.shape[0]):
        a, b = variable[pairs[k, 0]], variable[pairs[k, 1]]
        full = residual_and_jacobians(poses[pairs[k, 0]], poses[pairs[k, 1]], zero, identity)
        if a != b:
            for c in range(9):
                # column by column J is row by row J^T
                if a >= 0:
                    y[a, c] = full[3 + c]
                if b >= 0:
                    y[b, c] = full[12 + c]
        for t in range(_paths(a, b, parent, seen_by, k, path)):
            i = path[t]
            subtract_column(factor, factor_row, factor_start[i], factor_start[i + 1], y, i)
            _add_weighted_square(y[i], inverse[i], out[k])
            y[i] = 0.0
