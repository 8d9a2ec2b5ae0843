"""Stretches of a run: which are joined, and how one comes to its place."""

import math

import numpy as np
import pytest

from glassslam.config import LoopClosureConfig
from glassslam.geometry import between, compose
from glassslam.posegraph import PoseGraph
from glassslam.slam.closure import Candidate, Closure
from glassslam.slam.node import Node
from glassslam.slam.rejoin import beginnings, joined, move_stretches

CONFIG = LoopClosureConfig()
NONE = np.empty((0, 2), dtype=np.float32)
CARRIED = np.array([4.0, -2.0, 2.5])
"""Where the second stretch really begins, seen from where it was thought to."""


def run(count, *begins):
    """Nodes a metre apart along x."""
    return [
        Node(k, k, float(k), np.array([float(k), 0, 0]), np.zeros(2), NONE, NONE, 0.3, begins=k in begins)
        for k in range(count)
    ]


def closure(nodes, anchor, node, moved, *, wide=True):
    """A closure that says the frame of the node's stretch is moved."""
    at = nodes[anchor].pose_in_local
    place = compose(moved, nodes[node].pose_in_local)
    candidate = Candidate(
        node, anchor, 0, at, between(at, nodes[node].pose_in_local), 9.0, math.pi if wide else 0.1, np.eye(3)
    )
    return Closure(candidate, "", between(at, place), 0.01 * np.eye(3))


def test_beginnings_are_those_of_later_stretches():
    assert beginnings(run(9, 3, 7)) == [3, 7]


@pytest.mark.parametrize(
    ("ends", "labels"),
    [
        ([], [0, 1, 2]),
        ([[3, 12]], [0, 0, 2]),
        ([[12, 25]], [0, 1, 1]),
        ([[25, 3]], [0, 1, 0]),
        ([[12, 25], [4, 13]], [0, 0, 0]),
        ([[3, 4], [21, 22]], [0, 1, 2]),
    ],
)
def test_stretches_joined_by_closures(ends, labels):
    assert joined([10, 20], np.array(ends, dtype=np.int64).reshape(-1, 2)).tolist() == labels


def test_without_breaks_all_is_one():
    assert joined([], np.array([[1, 5]])).tolist() == [0]


class TestMoving:
    def graph(self, nodes):
        graph = PoseGraph()
        graph.add_poses(np.array([node.pose_in_local for node in nodes]))
        return graph

    def test_a_stretch_goes_as_a_whole_to_where_closures_put_it(self):
        nodes = run(20, 10)
        graph = self.graph(nodes)
        before = graph.poses
        move_stretches(graph, [closure(nodes, 2, 12, CARRIED)], nodes, CONFIG)
        np.testing.assert_array_equal(graph.poses[:10], before[:10])
        np.testing.assert_allclose(graph.poses[10:], compose(CARRIED, before[10:]), atol=1e-12)

    def test_stretches_joined_before_go_along(self):
        nodes = run(30, 10, 20)
        graph = self.graph(nodes)
        before = graph.poses
        graph.add_constraints([12], [22], between(before[12], before[22])[None], np.eye(3), "loop")
        move_stretches(graph, [closure(nodes, 2, 22, CARRIED)], nodes, CONFIG)
        np.testing.assert_allclose(graph.poses[10:], compose(CARRIED, before[10:]), atol=1e-12)

    def test_the_beginning_of_the_run_stays_where_it_is(self):
        nodes = run(30, 10, 20)
        graph = self.graph(nodes)
        before = graph.poses
        graph.add_constraints([2], [22], between(before[2], before[22])[None], np.eye(3), "loop")
        move_stretches(graph, [closure(nodes, 12, 22, CARRIED)], nodes, CONFIG)
        np.testing.assert_array_equal(graph.poses[:10], before[:10])
        np.testing.assert_array_equal(graph.poses[20:], before[20:])
        np.testing.assert_allclose(compose(CARRIED, graph.poses[10:20]), before[10:20], atol=1e-12)

    def test_what_is_joined_already_stays(self):
        nodes = run(20, 10)
        graph = self.graph(nodes)
        before = graph.poses
        graph.add_constraints([3], [13], between(before[3], before[13])[None], np.eye(3), "loop")
        move_stretches(graph, [closure(nodes, 2, 12, CARRIED)], nodes, CONFIG)
        np.testing.assert_array_equal(graph.poses, before)

    def test_narrow_closures_move_nothing(self):
        nodes = run(20, 10)
        graph = self.graph(nodes)
        move_stretches(graph, [closure(nodes, 2, 12, CARRIED, wide=False)], nodes, CONFIG)
        np.testing.assert_array_equal(graph.poses[:, 1], 0.0)
