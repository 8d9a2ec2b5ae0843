"""Kernels for covariances from the sparse factor, without any inverse."""

import numpy as np

from glassslam.accelerate import kernel
from glassslam.posegraph.ldl_kernels import subtract_column
from glassslam.posegraph.linearise_kernels import residual_and_jacobians
from glassslam.posegraph.structure_kernels import Integers
from glassslam.records import FloatArray


@kernel
def _add_weighted_square(y: FloatArray, i: int, inverse: FloatArray, out: FloatArray) -> None:
    """Add Y_i^T D_i^-1 Y_i to `out`, shape (3, 3)."""
    for r in range(3):
        u, v, w = y[i, r], y[i, 3 + r], y[i, 6 + r]
        p = u * inverse[i, 0] + v * inverse[i, 3] + w * inverse[i, 6]
        q = u * inverse[i, 1] + v * inverse[i, 4] + w * inverse[i, 7]
        s = u * inverse[i, 2] + v * inverse[i, 5] + w * inverse[i, 8]
        for c in range(3):
            out[r, c] += p * y[i, c] + q * y[i, 3 + c] + s * y[i, 6 + c]


@kernel
def _add_square_on_paths(
    a: int,
    b: int,
    parent: Integers,
    factor_start: Integers,
    factor_row: Integers,
    factor: FloatArray,
    inverse: FloatArray,
    y: FloatArray,
    out: FloatArray,
) -> None:
    """Solve L Y = right-hand side along the ways from a and b to the root, and add Y^T D^-1 Y."""
    while a >= 0 or b >= 0:
        # the lower column first: parents have higher numbers; the ways may meet and go on as one
        i = a if b < 0 or 0 <= a <= b else b
        if a == i:
            a = parent[i]
        if b == i:
            b = parent[i]
        subtract_column(factor, factor_row, factor_start[i], factor_start[i + 1], y, i)
        _add_weighted_square(y, i, inverse, out)
        for c in range(9):
            y[i, c] = 0.0


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
    """J Sigma J^T of the pose of b in the frame of a for each pair, added to `out` (k, 3, 3).

    With the information matrix L D L^T this is Y^T D^-1 Y, Y = L^-1 J^T: only the columns on the
    way from a and b to the root of the elimination tree take part.
    """
    y, zero, identity = np.zeros((parent.size, 9)), np.zeros(3), np.eye(3)
    for k in range(pairs.shape[0]):
        a, b = variable[pairs[k, 0]], variable[pairs[k, 1]]
        full = residual_and_jacobians(poses[pairs[k, 0]], poses[pairs[k, 1]], zero, identity)
        if pairs[k, 0] != pairs[k, 1]:
            for c in range(9):
                # column by column J is row by row J^T
                if a >= 0:
                    y[a, c] = full[3 + c]
                if b >= 0:
                    y[b, c] = full[12 + c]
        _add_square_on_paths(a, b, parent, factor_start, factor_row, factor, inverse, y, out[k])
