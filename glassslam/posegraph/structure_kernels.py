"""Kernels on the graph behind the matrix: connected components and the elimination tree."""

import numpy as np
from numpy.typing import NDArray

from glassslam.accelerate import kernel

Integers = NDArray[np.int64]


@kernel
def components(vertex_count: int, ends: Integers) -> Integers:
    """Lowest vertex of the connected component of every vertex, shape (vertex_count,)."""
    root = np.arange(vertex_count)
    for e in range(ends.shape[0]):
        a, b = ends[e, 0], ends[e, 1]
        while root[a] != a:
            root[a] = root[root[a]]
            a = root[a]
        while root[b] != b:
            root[b] = root[root[b]]
            b = root[b]
        root[max(a, b)] = min(a, b)
    for v in range(vertex_count):
        # the root of a vertex has a lower index, so it is final already
        root[v] = root[root[v]]
    return root


@kernel
def elimination_tree(column_start: Integers, row: Integers) -> tuple[Integers, Integers]:
    """Parent of every column (-1 for a root) and start of every column of L, diagonal left out.

    The matrix is symmetric, given by the strictly upper part in compressed columns.
    """
    n = column_start.size - 1
    parent = np.full(n, -1, dtype=np.int64)
    seen_by = np.full(n, -1, dtype=np.int64)
    factor_start = np.zeros(n + 1, dtype=np.int64)
    for k in range(n):
        seen_by[k] = k
        for p in range(column_start[k], column_start[k + 1]):
            i = row[p]
            while seen_by[i] != k:
                if parent[i] == -1:
                    parent[i] = k
                factor_start[i + 1] += 1
                seen_by[i] = k
                i = parent[i]
    for k in range(n):
        factor_start[k + 1] += factor_start[k]
    return parent, factor_start
