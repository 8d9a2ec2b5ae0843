"""The structure kernels and the block factorisation against dense and naive twins."""

import networkx as nx
import numpy as np
import pytest
import scipy.linalg
from hypothesis import given, settings
from hypothesis import strategies as st
from pose_worlds import naive_cost, walk_graph

from glassslam.posegraph.ldl_kernels import invert_positive
from glassslam.posegraph.structure import analyse
from glassslam.posegraph.structure_kernels import components, elimination_tree
from glassslam.posegraph.system import Robust, System


def dense(system: System) -> np.ndarray:
    """The whole matrix the system holds as blocks."""
    n, s = system.size, system.structure
    out = np.zeros((3 * n, 3 * n))
    for k in range(n):
        out[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] = system.diagonal[k].reshape(3, 3)
        for p in range(s.column_start[k], s.column_start[k + 1]):
            i = s.row[p]
            out[3 * i : 3 * i + 3, 3 * k : 3 * k + 3] = system.upper[p].reshape(3, 3)
            out[3 * k : 3 * k + 3, 3 * i : 3 * i + 3] = system.upper[p].reshape(3, 3).T
    return out


HUBER = Robust("huber", 2.0)


def system_of(graph, robust=HUBER) -> System:
    fixed = np.zeros(len(graph.poses), dtype=bool)
    return System(analyse(graph.edges.ends, graph.edges.enabled, fixed), graph.edges, robust)


edges = st.integers(2, 12).flatmap(
    lambda n: st.tuples(
        st.just(n),
        st.lists(st.tuples(st.integers(0, n - 1), st.integers(0, n - 1)).filter(lambda e: e[0] != e[1])),
    )
)


def ends_of(pairs):
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)


@given(edges)
def test_components_are_named_by_their_lowest_vertex(drawn):
    n, pairs = drawn
    graph = nx.Graph()
    graph.add_nodes_from(range(n))
    graph.add_edges_from(pairs)
    expected = np.empty(n, dtype=np.int64)
    for members in nx.connected_components(graph):
        expected[list(members)] = min(members)
    np.testing.assert_array_equal(components(n, ends_of(pairs)), expected)


@given(edges)
def test_the_factor_has_room_for_exactly_the_fill(drawn):
    n, pairs = drawn
    structure = analyse(ends_of(pairs), np.ones(len(pairs), dtype=bool), np.zeros(n, dtype=bool))
    size = structure.vertex.size
    filled = np.zeros((size, size), dtype=bool)
    for k in range(size):
        filled[structure.row[structure.column_start[k] : structure.column_start[k + 1]], k] = True
    filled |= filled.T
    for k in range(size):
        below = np.flatnonzero(filled[k + 1 :, k]) + k + 1
        filled[np.ix_(below, below)] = True
        assert structure.parent[k] == (below[0] if below.size else -1)
        assert structure.factor_start[k + 1] - structure.factor_start[k] == below.size


@given(edges, st.data())
def test_every_edge_finds_its_block(drawn, data):
    n, pairs = drawn
    ends = ends_of(pairs)
    enabled = np.array(
        data.draw(st.lists(st.booleans(), min_size=len(pairs), max_size=len(pairs))), dtype=bool
    )
    fixed = np.array(data.draw(st.lists(st.booleans(), min_size=n, max_size=n)), dtype=bool)
    s = analyse(ends, enabled, fixed)
    np.testing.assert_array_equal(s.edges, np.flatnonzero(enabled))
    np.testing.assert_array_equal(s.variable[s.vertex], np.arange(s.vertex.size))
    assert (s.variable[fixed] == -1).all()
    column = np.repeat(np.arange(s.vertex.size), np.diff(s.column_start))
    assert (s.row < column).all()
    for (a, b), slot in zip(s.variable[ends[enabled]], s.slot, strict=True):
        if min(a, b) < 0:
            assert slot == -1
        else:
            assert (s.row[slot], column[slot]) == (min(a, b), max(a, b))
    held = set(np.flatnonzero(s.variable < 0)) - set(np.flatnonzero(fixed))
    anchored = set(s.component[fixed])
    assert held == set(s.component) - anchored, "the first vertex of every part without a fixed one"


def test_an_empty_matrix_has_an_empty_tree():
    parent, starts = elimination_tree(np.zeros(1, dtype=np.int64), np.zeros(0, dtype=np.int64))
    assert parent.size == 0
    assert starts.tolist() == [0]


@settings(max_examples=25)
@given(st.integers(0, 10**6), st.integers(21, 45), st.integers(0, 40))
def test_the_solution_is_that_of_scipy(seed, count, loops):
    graph, _, _ = walk_graph(count, loops, outliers=loops // 5, seed=seed)
    system = system_of(graph)
    system.linearise(graph.poses)
    damping = np.random.default_rng(seed).uniform(0, 1, (system.size, 3))
    assert system.factorise(damping)
    right = np.random.default_rng(seed).normal(size=(system.size, 3))
    matrix = dense(system) + np.diag(damping.ravel())
    expected = scipy.linalg.solve(matrix, right.ravel(), assume_a="pos")
    np.testing.assert_allclose(system.solve(right).ravel(), expected, rtol=1e-6, atol=1e-9)


def test_a_matrix_that_is_not_positive_definite_is_refused():
    graph, _, _ = walk_graph()
    system = system_of(graph)
    system.linearise(graph.poses)
    assert not system.factorise(np.full((system.size, 3), -1e9))
    system.diagonal[3] = np.nan
    assert not system.factorise(np.zeros((system.size, 3)))


@given(st.lists(st.floats(-3, 3), min_size=9, max_size=9), st.floats(-1, 2))
def test_a_block_is_inverted_only_when_positive_definite(values, shift):
    root = np.array(values).reshape(3, 3)
    block = root @ root.T + shift * np.eye(3)
    lowest = np.linalg.eigvalsh(block)[0]
    if abs(lowest) < 1e-3:
        return
    out = np.empty(9)
    assert invert_positive(block.ravel(), out) == (lowest > 0)
    if lowest > 0:
        np.testing.assert_allclose(out.reshape(3, 3) @ block, np.eye(3), atol=1e-6)


@pytest.mark.parametrize("loss", ["none", "huber", "geman_mcclure"])
def test_gradient_and_cost_are_those_of_the_formula(loss):
    graph, _, _ = walk_graph(30, 12, outliers=3, seed=4)
    system = system_of(graph, Robust(loss, 2.0))
    constraints, poses = graph.constraints, graph.poses
    expected = naive_cost(poses, constraints, loss, 2.0)
    assert system.cost(poses) == pytest.approx(expected, rel=1e-12)
    assert system.linearise(poses) == pytest.approx(expected, rel=1e-12)
    h = 1e-6
    for variable in range(0, system.size, 5):
        for axis in range(3):
            step = np.zeros((system.size, 3))
            step[variable, axis] = h
            up = naive_cost(system.moved(poses, step), constraints, loss, 2.0)
            down = naive_cost(system.moved(poses, -step), constraints, loss, 2.0)
            slope = (up - down) / (2 * h)
            assert system.gradient[variable, axis] == pytest.approx(slope, rel=1e-4, abs=1e-3)


def test_the_matrix_is_that_of_the_jacobians():
    graph, _, _ = walk_graph(25, 10, seed=1)
    system = system_of(graph, Robust("none", 1.0))
    poses = graph.poses
    system.linearise(poses)
    h, columns = 1e-6, []
    for k in range(3 * system.size):
        step = np.zeros(3 * system.size)
        step[k] = h
        graph.set_poses(0, system.moved(poses, step.reshape(-1, 3)))
        up = graph.residuals().ravel()
        graph.set_poses(0, system.moved(poses, -step.reshape(-1, 3)))
        columns.append((up - graph.residuals().ravel()) / (2 * h))
        graph.set_poses(0, poses)
    jacobian = np.array(columns).T
    np.testing.assert_allclose(dense(system), jacobian.T @ jacobian, atol=1e-4 * np.abs(dense(system)).max())
