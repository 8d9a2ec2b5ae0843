"""Sparse L D L^T of symmetric matrices of 3x3 blocks: one pose is one row of blocks.

Row by row (T. A. Davis, Algorithm 849, 2005), with blocks in the place of scalars: the index work is
done once for nine numbers, and the inner product of blocks stays in registers.
"""

from glassslam.accelerate import kernel
from glassslam.posegraph.structure_kernels import Integers
from glassslam.records import FloatArray


@kernel
def invert_positive(a: FloatArray, out: FloatArray) -> bool:
    """Invert a symmetric 3x3 block (9 numbers); False when it is not positive definite."""
    c00, c01, c02 = a[4] * a[8] - a[5] * a[7], a[5] * a[6] - a[3] * a[8], a[3] * a[7] - a[4] * a[6]
    minor = a[0] * a[4] - a[1] * a[3]
    determinant = a[0] * c00 + a[1] * c01 + a[2] * c02
    if not (a[0] > 0.0 and minor > 0.0 and determinant > 0.0):
        return False
    d = 1.0 / determinant
    out[0], out[1], out[2] = c00 * d, c01 * d, c02 * d
    out[3], out[4], out[5] = out[1], (a[0] * a[8] - a[2] * a[6]) * d, (a[2] * a[3] - a[0] * a[5]) * d
    out[6], out[7], out[8] = out[2], out[5], minor * d
    return True


@kernel
def subtract_column(
    factor: FloatArray, factor_row: Integers, start: int, end: int, x: FloatArray, i: int
) -> None:
    """Subtract L_ji X_i from X_j for the entries `start` to `end` of column i; row-major blocks."""
    x0, x1, x2 = x[i, 0], x[i, 1], x[i, 2]
    x3, x4, x5 = x[i, 3], x[i, 4], x[i, 5]
    x6, x7, x8 = x[i, 6], x[i, 7], x[i, 8]
    for p in range(start, end):
        j = factor_row[p]
        for r in range(0, 9, 3):
            a, b, c = factor[p, r], factor[p, r + 1], factor[p, r + 2]
            x[j, r] -= a * x0 + b * x3 + c * x6
            x[j, r + 1] -= a * x1 + b * x4 + c * x7
            x[j, r + 2] -= a * x2 + b * x5 + c * x8


@kernel
def _eliminate(
    x: FloatArray, i: int, inverse: FloatArray, factor: FloatArray, entry: int, pivot: FloatArray
) -> None:
    """L_ki = X_i^T D_i^-1 into the factor, and its share L_ki X_i off the pivot of row k."""
    for r in range(3):
        u, v, w = x[i, r], x[i, 3 + r], x[i, 6 + r]
        for c in range(3):
            factor[entry, 3 * r + c] = u * inverse[i, c] + v * inverse[i, 3 + c] + w * inverse[i, 6 + c]
        for c in range(3):
            pivot[3 * r + c] -= (
                factor[entry, 3 * r] * x[i, c]
                + factor[entry, 3 * r + 1] * x[i, 3 + c]
                + factor[entry, 3 * r + 2] * x[i, 6 + c]
            )


@kernel
def _row_pattern(
    k: int,
    column_start: Integers,
    row: Integers,
    parent: Integers,
    seen_by: Integers,
    pattern: Integers,
) -> int:
    """Columns of L with an entry in row k, in elimination order in `pattern[top:]`; returns top."""
    top = parent.size
    seen_by[k] = k
    for p in range(column_start[k], column_start[k + 1]):
        i = row[p]
        length = 0
        while seen_by[i] != k:
            pattern[length] = i
            length += 1
            seen_by[i] = k
            i = parent[i]
        while length > 0:
            top -= 1
            length -= 1
            pattern[top] = pattern[length]
    return top


@kernel
def factorise(
    column_start: Integers,
    row: Integers,
    upper: FloatArray,
    diagonal: FloatArray,
    damping: FloatArray,
    parent: Integers,
    factor_start: Integers,
    factor_row: Integers,
    factor: FloatArray,
    inverse: FloatArray,
    work: FloatArray,
    index_work: Integers,
) -> bool:
    """Factorise; False at the first pivot that is not positive definite.

    Parameters
    ----------
    column_start, row, upper : ndarray
        Strictly upper part: compressed columns and its blocks, shape (m, 9).
    diagonal : ndarray of float64, shape (n, 9)
        Diagonal blocks.
    damping : ndarray of float64, shape (n, 3)
        Added to the diagonal.
    parent, factor_start : ndarray of int64
        See `elimination_tree`.
    factor_row, factor, inverse : ndarray
        Results: rows (l,) and blocks (l, 9) of the unit lower factor, inverses (n, 9) of D.
    work, index_work : ndarray
        Scratch of shapes (n + 1, 9) and (3, n).
    """
    n = parent.size
    seen_by, pattern, filled = index_work[0], index_work[1], index_work[2]
    # loops, because numba takes seconds to compile assignments of whole arrays
    for k in range(n):
        seen_by[k], filled[k] = -1, factor_start[k]
        for c in range(9):
            work[k, c] = 0.0
    pivot = work[n]
    for k in range(n):
        top = _row_pattern(k, column_start, row, parent, seen_by, pattern)
        for p in range(column_start[k], column_start[k + 1]):
            for c in range(9):
                work[row[p], c] = upper[p, c]
        for c in range(9):
            pivot[c] = diagonal[k, c]
        for c in range(3):
            pivot[4 * c] += damping[k, c]
        for t in range(top, n):
            i = pattern[t]
            end = filled[i]
            subtract_column(factor, factor_row, factor_start[i], end, work, i)
            _eliminate(work, i, inverse, factor, end, pivot)
            for c in range(9):
                work[i, c] = 0.0
            factor_row[end] = k
            filled[i] += 1
        if not invert_positive(pivot, inverse[k]):
            return False
    return True


@kernel
def solve(
    factor_start: Integers, factor_row: Integers, factor: FloatArray, inverse: FloatArray, x: FloatArray
) -> None:
    """Solve with a factorisation; `x` (n, 3) holds the right-hand side, then the solution."""
    n = x.shape[0]
    for i in range(n):
        x0, x1, x2 = x[i, 0], x[i, 1], x[i, 2]
        for p in range(factor_start[i], factor_start[i + 1]):
            j = factor_row[p]
            for r in range(3):
                x[j, r] -= factor[p, 3 * r] * x0 + factor[p, 3 * r + 1] * x1 + factor[p, 3 * r + 2] * x2
    for i in range(n - 1, -1, -1):
        x0, x1, x2 = x[i, 0], x[i, 1], x[i, 2]
        for r in range(3):
            x[i, r] = inverse[i, 3 * r] * x0 + inverse[i, 3 * r + 1] * x1 + inverse[i, 3 * r + 2] * x2
        for p in range(factor_start[i], factor_start[i + 1]):
            j = factor_row[p]
            for r in range(3):
                x[i, r] -= factor[p, r] * x[j, 0] + factor[p, 3 + r] * x[j, 1] + factor[p, 6 + r] * x[j, 2]
