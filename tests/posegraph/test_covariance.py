"""Relative covariances against the dense inverse of the information matrix."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pose_worlds import STEP_SIGMA, WEIGHT, naive_error, walk_graph

from glassslam.errors import GraphError
from glassslam.posegraph import Constraint, PoseGraph


def numeric_jacobian(graph, a, b):
    """Derivative (3, 3 n) of the pose of b in the frame of a by all poses."""
    poses, h = graph.poses, 1e-6
    out = np.zeros((3, poses.size))
    for vertex in (a, b):
        for axis in range(3):
            up, down = poses.copy(), poses.copy()
            up[vertex, axis] += h
            down[vertex, axis] -= h
            slope = naive_error(up[a], up[b], np.zeros(3)) - naive_error(down[a], down[b], np.zeros(3))
            out[:, 3 * vertex + axis] = slope / (2 * h)
    return out


def dense_covariance(graph, a, b):
    """The same by the full information matrix with the first vertex held."""
    information = np.zeros((graph.poses.size, graph.poses.size))
    for c in graph.constraints:
        j = c.sqrt_information @ numeric_jacobian(graph, c.a, c.b)
        information += j.T @ j
    covariance = np.zeros_like(information)
    covariance[3:, 3:] = np.linalg.inv(information[3:, 3:])
    j = numeric_jacobian(graph, a, b)
    return j @ covariance @ j.T


@settings(max_examples=8)
@given(st.integers(0, 10**6), st.integers(0, 23), st.integers(0, 23))
def test_it_is_that_of_the_dense_inverse(seed, a, b):
    graph, _, _ = walk_graph(24, 8, seed=seed)
    graph.optimize(loss="none")
    expected = dense_covariance(graph, a, b) if a != b else np.zeros((3, 3))
    np.testing.assert_allclose(graph.relative_covariance(a, b), expected, rtol=1e-5, atol=1e-9)


def test_of_neighbours_without_closures_it_is_that_of_the_step():
    graph, _, _ = walk_graph(10, 0, side=2)
    for a in range(9):
        covariance = graph.relative_covariance(a, a + 1)
        np.testing.assert_allclose(covariance, np.diag(STEP_SIGMA**2), rtol=1e-9, atol=1e-15)


def test_many_pairs_are_each_pair():
    graph, _, _ = walk_graph(40, 20)
    graph.optimize()
    pairs = np.random.default_rng(0).integers(0, 40, (30, 2))
    single = [graph.relative_covariance(int(a), int(b)) for a, b in pairs]
    np.testing.assert_array_equal(graph.relative_covariances(pairs), single)


def test_a_closure_makes_it_smaller_once_it_is_added():
    graph, _, _ = walk_graph(41, 0)
    before = graph.relative_covariance(0, 40)
    graph.add_constraint(Constraint(0, 40, np.zeros(3), WEIGHT, "odometry"))
    after = graph.relative_covariance(0, 40)
    assert (np.diag(after) < 0.5 * np.diag(before)).all()
    assert (np.diag(after) <= STEP_SIGMA**2).all()


def test_a_doubted_closure_counts_less():
    graph, _, wrong = walk_graph(41, 6, outliers=1)
    ends = graph.edges.ends[wrong[0]]
    graph.optimize(loss="none")
    trusted = graph.relative_covariance(*ends)
    graph.optimize(loss="geman_mcclure", huber_scale=2.0)
    assert np.trace(graph.relative_covariance(*ends)) > np.trace(trusted)


def test_it_does_not_depend_on_who_is_held():
    graph, _, _ = walk_graph(30, 10)
    graph.optimize()
    reference = graph.relative_covariance(3, 17)
    graph.set_fixed(12)
    np.testing.assert_allclose(graph.relative_covariance(3, 17), reference, rtol=1e-6, atol=1e-12)


def test_without_a_connection_it_is_infinite():
    graph, _, _ = walk_graph(10, 0, side=2)
    alone = graph.add_pose((0, 0, 0))
    covariance = graph.relative_covariance(2, alone)
    assert np.isinf(np.diag(covariance)).all()


def test_an_open_direction_is_told():
    graph = PoseGraph()
    graph.add_poses(np.zeros((2, 3)))
    graph.add_constraint(Constraint(0, 1, np.zeros(3), np.diag([1.0, 1.0, 0.0]), "odometry"))
    with pytest.raises(GraphError, match=r"^the constraints do not determine all poses$"):
        graph.relative_covariance(0, 1)


def test_an_unknown_vertex_is_told():
    graph, _, _ = walk_graph(10, 0, side=2)
    with pytest.raises(GraphError, match=r"^no vertex 10: the graph has 10$"):
        graph.relative_covariances([(0, 1), (3, 10)])
