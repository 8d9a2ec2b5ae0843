"""Which vertices move, in which order they are eliminated, and where every edge enters the matrix."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glassslam.posegraph.structure_kernels import Integers, components, elimination_tree


@dataclass(frozen=True, slots=True)
class Structure:
    """The symbolic analysis of a graph; valid while its edges and fixed vertices stay the same.

    A variable is the pose of a vertex that moves; variables are numbered in elimination order.

    Attributes
    ----------
    edges : ndarray of int64, shape (e,)
        Indices of the edges that take part.
    variable : ndarray of int64, shape (v,)
        Variable of every vertex, -1 where it is held.
    vertex : ndarray of int64, shape (n,)
        Vertex of every variable.
    component : ndarray of int64, shape (v,)
        Lowest vertex of the connected component of every vertex.
    slot : ndarray of int64, shape (e,)
        Block of the strictly upper part an edge adds to, -1 when one of its ends is held.
    column_start, row : ndarray of int64
        The strictly upper part in compressed columns of 3x3 blocks.
    parent, factor_start : ndarray of int64
        Elimination tree and column starts of the factor.
    """

    edges: Integers
    variable: Integers
    vertex: Integers
    component: Integers
    slot: Integers
    column_start: Integers
    row: Integers
    parent: Integers
    factor_start: Integers


def analyse(ends: Integers, enabled: NDArray[np.bool_], fixed: NDArray[np.bool_]) -> Structure:
    """Symbolic analysis of a graph.

    In a connected component without a fixed vertex the first vertex is held: the edges say nothing
    on where the component lies, so it stays where it is.

    Parameters
    ----------
    ends : ndarray of int64, shape (m, 2)
        Vertices of every edge.
    enabled : ndarray of bool, shape (m,)
        Whether an edge takes part.
    fixed : ndarray of bool, shape (v,)
        Vertices held by the caller.
    """
    edges = np.flatnonzero(enabled)
    component = components(fixed.size, ends[edges])
    held = _held(component, fixed)
    free = np.flatnonzero(~held)
    number = np.full(fixed.size, -1, dtype=np.int64)
    number[free] = np.arange(free.size)
    pairs, slot = _distinct_pairs(free.size, number[ends[edges]])
    order = _elimination_order(free.size, pairs)
    rank = np.argsort(order)
    ranked = rank[pairs]
    column_start, row, entry = _columns(free.size, ranked.min(axis=1), ranked.max(axis=1))
    slot[slot >= 0] = np.argsort(entry)[slot[slot >= 0]]
    variable = np.where(held, -1, rank[number]) if free.size else number
    parent, factor_start = elimination_tree(column_start, row)
    return Structure(edges, variable, free[order], component, slot, column_start, row, parent, factor_start)


def _held(component: Integers, fixed: NDArray[np.bool_]) -> NDArray[np.bool_]:
    anchored = np.zeros(fixed.size, dtype=np.bool_)
    anchored[component[fixed]] = True
    first = np.arange(fixed.size) == component
    return np.asarray(fixed | (first & ~anchored))


def _distinct_pairs(count: int, ends: Integers) -> tuple[Integers, Integers]:
    """Distinct pairs of variables (k, 2), low before high, and the pair of every edge (-1: held)."""
    of_edge = np.full(len(ends), -1, dtype=np.int64)
    both = np.flatnonzero((ends >= 0).all(axis=1))
    codes = ends[both].max(axis=1) * count + ends[both].min(axis=1)
    order = np.argsort(codes, kind="stable")
    codes = codes[order]
    fresh = np.append(True, codes[1:] != codes[:-1])[: codes.size]
    of_edge[both[order]] = np.cumsum(fresh) - 1
    return np.stack((codes[fresh] % max(count, 1), codes[fresh] // max(count, 1)), axis=1), of_edge


def _columns(count: int, rows: Integers, columns: Integers) -> tuple[Integers, Integers, Integers]:
    """Column starts and rows in compressed columns, and the order that sorts the entries so."""
    order = np.argsort(columns * count + rows, kind="stable")
    starts = np.zeros(count + 1, dtype=np.int64)
    np.cumsum(np.bincount(columns, minlength=count), out=starts[1:])
    return starts, rows[order], order


def _elimination_order(count: int, pairs: Integers) -> Integers:
    """Variables in an order of little fill-in (approximate minimum degree)."""
    if count == 0:
        return np.zeros(0, dtype=np.int64)
    import casadi as ca  # noqa: PLC0415  (0.16 s)

    low, high, diagonal = pairs[:, 0], pairs[:, 1], np.arange(count)
    # without its diagonal entries CasADi's ordering writes outside of its memory
    rows, columns = np.concatenate((low, high, diagonal)), np.concatenate((high, low, diagonal))
    starts, row, _ = _columns(count, rows, columns)
    # lists: CasADi converts arrays of integers forty times slower
    pattern = ca.Sparsity(count, count, starts.tolist(), row.tolist())
    return np.asarray(pattern.amd(), dtype=np.int64)
