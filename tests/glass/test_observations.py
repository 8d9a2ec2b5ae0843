"""Glass observations follow the nodes they were made from."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from glassslam.geometry import compose, wrap_angle
from glassslam.glass.observations import GlassObservations

metres = st.floats(-50.0, 50.0)
angles = st.floats(-math.pi, 3.0)
poses = arrays(np.float64, (3, 3), elements=angles)
rows = st.lists(st.tuples(st.integers(0, 2), metres, metres, angles), min_size=1, max_size=8)


def observations(entries):
    table = np.array(entries, dtype=np.float64).reshape(-1, 4)
    one, sensor = np.ones(len(table)), np.zeros((len(table), 2))
    node = table[:, 0].astype(np.int64)
    return GlassObservations(node, table[:, 1:3], table[:, 3], sensor, one, one, one, one, one, one)


def close_angles(a, b):
    return np.abs(wrap_angle(np.asarray(a) - np.asarray(b))).max() < 1e-9


@given(rows, poses)
def test_every_observation_is_where_its_node_puts_it(entries, node_poses):
    seen = observations(entries)
    positions, normals = seen.at(node_poses)
    for k, (node, x, y, normal) in enumerate(entries):
        expected = compose(node_poses[node], np.array([x, y, normal]))
        assert positions[k] == pytest.approx(expected[:2], abs=1e-9)
        assert close_angles(normals[k], expected[2])


@given(rows, poses, arrays(np.float64, 3, elements=angles))
def test_moving_all_nodes_moves_all_observations(entries, node_poses, motion):
    seen = observations(entries)
    before = np.column_stack(seen.at(node_poses))
    after = np.column_stack(seen.at(compose(motion[None], node_poses)))
    expected = compose(motion[None], before)
    assert after[:, :2] == pytest.approx(expected[:, :2], abs=1e-8)
    assert close_angles(after[:, 2], expected[:, 2])


def test_only_the_observations_of_a_moved_node_move():
    seen = observations([(0, 1.0, 0.0, 0.0), (1, 1.0, 0.0, 0.0)])
    positions, normals = seen.at(np.array([[0.0, 0.0, 0.0], [5.0, 2.0, 0.5 * math.pi]]))
    assert positions == pytest.approx(np.array([[1.0, 0.0], [5.0, 3.0]]))
    assert normals == pytest.approx(np.array([0.0, 0.5 * math.pi]))


def test_no_observations_are_nowhere():
    none = GlassObservations.empty()
    positions, normals = none.at(np.zeros((0, 3)))
    assert len(none) == 0
    assert positions.shape == (0, 2)
    assert normals.shape == (0,)
