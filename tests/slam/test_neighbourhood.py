"""What a node and its neighbours see together."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glassslam.geometry import inverse, transform_points
from glassslam.slam.neighbourhood import neighbourhood, neighbours
from glassslam.slam.node import Node


def node(index, pose, points, residual=0.3):
    """A node that sees points of the local frame."""
    pose = np.array(pose, dtype=np.float64)
    seen = transform_points(inverse(pose), np.array(points, dtype=np.float64)).astype(np.float32)
    return Node(index, index, float(index), pose, np.zeros(2), seen, np.empty((0, 2), np.float32), residual)


class TestNeighbours:
    def test_those_within_reach_of_travel(self):
        assert neighbours(np.arange(20.0), 10, 3.0) == [7, 8, 9, 10, 11, 12, 13]

    def test_travel_counts_not_the_number(self):
        travel = np.array([0.0, 5.0, 5.1, 5.2, 9.9, 10.0])
        assert neighbours(travel, 2, 1.0) == [1, 2, 3]

    def test_at_the_ends_there_are_fewer(self):
        assert neighbours(np.arange(20.0), 0, 2.0) == [0, 1, 2]
        assert neighbours(np.arange(20.0), 19, 2.0) == [17, 18, 19]
        assert neighbours(np.zeros(1), 0, 4.0) == [0]

    @given(
        st.lists(st.floats(0.0, 2.0), min_size=1, max_size=200),
        st.integers(0, 199),
        st.floats(0.0, 50.0),
    )
    def test_few_near_and_the_node_itself(self, steps, index, reach):
        travel = np.cumsum(steps)
        index = min(index, len(steps) - 1)
        chosen = neighbours(travel, index, reach)
        assert index in chosen
        assert chosen == sorted(set(chosen))
        assert len(chosen) <= 10
        assert all(abs(travel[k] - travel[index]) <= reach + 1e-9 for k in chosen)

    def test_a_robot_that_stood_for_long_does_not_reach_back_for_ever(self):
        assert min(neighbours(np.zeros(1000), 500, 4.0)) == 460


class TestNeighbourhood:
    WALL = np.stack((np.linspace(0, 6, 400), np.full(400, 2.0)), axis=1)

    def test_scans_are_joined_in_the_frame_of_the_node(self):
        near = node(0, (0, 0, 0), self.WALL[:200])
        far = node(1, (2.0, 1.0, np.pi / 2), self.WALL[200:])
        scene = neighbourhood([near, far], [0, 1], 1)
        seen = transform_points(far.pose_in_local, scene.fine)
        np.testing.assert_allclose(seen[:, 1], 2.0, atol=1e-5)
        assert seen[:, 0].min() == pytest.approx(0.0, abs=0.1)
        assert seen[:, 0].max() == pytest.approx(6.0, abs=0.1)

    def test_what_is_seen_twice_counts_once(self):
        nodes = [node(k, (0.1 * k, 0, 0), self.WALL) for k in range(5)]
        alone = neighbourhood(nodes, [0], 0)
        together = neighbourhood(nodes, [0, 1, 2, 3, 4], 0)
        assert len(alone.fine) <= len(together.fine) <= len(alone.fine) + 2

    def test_points_are_limited_for_the_match_and_for_the_search(self):
        crowd = np.random.default_rng(0).uniform(-20, 20, (5000, 2))
        scene = neighbourhood([node(0, (0, 0, 0), crowd)], [0], 0)
        assert len(scene.fine) == 600
        assert len(scene.coarse) == 250

    def test_the_residual_is_the_mean_of_the_scans(self):
        nodes = [node(0, (0, 0, 0), self.WALL, 0.2), node(1, (0, 0, 0), self.WALL, 0.4)]
        assert neighbourhood(nodes, [0, 1], 0).residual == pytest.approx(0.3)

    def test_scans_without_returns_are_no_error(self):
        scene = neighbourhood([node(0, (0, 0, 0), np.empty((0, 2)))], [0], 0)
        assert scene.fine.shape == scene.coarse.shape == (0, 2)
