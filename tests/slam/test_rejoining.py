"""Wide closures: which are believed, which wait, and which contradict the rest or the building."""

import math
from dataclasses import replace

import numpy as np
import pytest
from slam_worlds import ROOM, Lidar, drive, range_data

from glassslam.config import LoopClosureConfig
from glassslam.geometry import between, compose, inverse, transform_points
from glassslam.grid.probability_grid import ProbabilityGrid
from glassslam.grid.submap import Submap
from glassslam.posegraph import PoseGraph
from glassslam.slam.closure import Candidate, Closure
from glassslam.slam.node import Node
from glassslam.slam.rejoin import Rejoining

CONFIG = LoopClosureConfig()
FIRST = drive((1.2, 0.8), (5.5, 0.8), (5.5, 4.2), step=0.2)
SECOND = drive((4.6, 4.3), (1.2, 4.3), (1.2, 1.0), step=0.2)
CARRIED = np.array([3.0, 1.0, 1.3])
"""Frame of the second stretch in that of the first."""
ELSEWHERE = np.array([-2.0, 4.0, -0.6])


def scan(k, pose):
    return range_data(Lidar(ROOM, seed=k).look(0.0, pose)).returns.astype(np.float32)


def nodes_of(first, second, carried=CARRIED):
    local = [*first, *compose(inverse(carried), second)]
    seen = [scan(k, pose) for k, pose in enumerate([*first, *second])]
    none = np.empty((0, 2), dtype=np.float32)
    return [
        Node(k, k, float(k), pose, np.zeros(2), points, none, 0.3, begins=k == len(first))
        for k, (pose, points) in enumerate(zip(local, seen, strict=True))
    ]


def submap_of(nodes, first, last, index=0):
    grid = ProbabilityGrid(0.05)
    for node in nodes[first:last] * 3:
        at = node.pose_in_local
        grid.insert(at[:2], transform_points(at, node.returns.astype(float)), np.empty((0, 2)))
    grid.finish()
    return Submap(index, nodes[first].pose_in_local, grid, list(range(first, last)), finished=True)


class World:
    """A run through the room in two stretches, and what is asked about it."""

    def __init__(self, first=FIRST, second=SECOND):
        self.nodes = nodes_of(first, second)
        self.begin = len(first)
        self.submaps = [submap_of(self.nodes, 0, self.begin)]
        self.graph = PoseGraph()
        self.graph.add_poses(np.array([node.pose_in_local for node in self.nodes]))
        steps = between(self.graph.poses[:-1], self.graph.poses[1:])
        lengths = np.hypot(steps[:, 0], steps[:, 1])
        lengths[self.begin - 1] = 9.0
        self.travel = np.concatenate(([0.0], np.cumsum(lengths)))
        self.rejoining = Rejoining(CONFIG)

    def find(self, later, moved=CARRIED, *, wide=True, rejected=""):
        """A closure of the k-th node of the second stretch that puts its frame to `moved`."""
        node, anchor = self.begin + later, later
        at = self.graph.poses[anchor]
        place = between(at, compose(np.asarray(moved), self.graph.poses[node]))
        searched = Candidate(node, anchor, 0, at, np.zeros(3), 9.0, math.pi if wide else 0.1, np.eye(3))
        return Closure(searched, rejected, place, 0.01 * np.eye(3))

    def settle(self, *closures):
        decided = self.rejoining.settle(closures, self.graph, self.nodes, self.travel, self.submaps)
        return sorted((c.candidate.node - self.begin, c.rejected) for c in decided)


@pytest.fixture(scope="module")
def room():
    return World()


@pytest.fixture
def world(room):
    room.rejoining = Rejoining(CONFIG)
    return room


def test_three_that_agree_and_fit_the_building_are_believed(world):
    near = CARRIED + np.array([0.05, -0.05, 0.01])
    assert world.settle(world.find(2), world.find(8, near), world.find(14)) == [(2, ""), (8, ""), (14, "")]
    assert world.rejoining.waiting == []


def test_two_wait_for_a_third_of_a_later_round(world):
    assert world.settle(world.find(2), world.find(8)) == []
    assert world.settle() == []
    assert world.settle(world.find(14)) == [(2, ""), (8, ""), (14, "")]


def test_three_of_one_node_wait(world):
    assert world.settle(world.find(8), world.find(8), world.find(8)) == []


def test_the_few_that_contradict_are_rejected(world):
    right = [world.find(k) for k in (2, 5, 8)]
    assert world.settle(*right, world.find(11, ELSEWHERE)) == [
        (2, ""),
        (5, ""),
        (8, ""),
        (11, "inconsistent"),
    ]


def test_half_as_many_that_contradict_leave_it_open(world):
    right = [world.find(k) for k in (2, 5, 8, 11)]
    wrong = [world.find(k, ELSEWHERE) for k in (6, 9)]
    assert world.settle(*right, *wrong) == []
    assert len(world.rejoining.waiting) == 6


@pytest.mark.parametrize("moved", [(3.8, 2.0, 1.3), (3.0, 1.0, 1.3 + math.pi / 2), (3.0, 0.2, 1.3)])
def test_agreement_alone_does_not_put_walls_into_free_space(world, moved):
    assert world.settle(*(world.find(k, moved) for k in (2, 5, 8, 11, 14))) == []


def test_the_other_way_round_walls_must_not_stand_in_free_space_either():
    """The first stretch is laid upon submaps of the second as well."""
    blank = World()
    later = submap_of(blank.nodes, blank.begin, len(blank.nodes), index=1)
    blank.submaps = [*blank.submaps, later]
    right = [blank.find(k) for k in (2, 8, 14)]
    assert blank.settle(*right) == [(2, ""), (8, ""), (14, "")]
    blank.rejoining = Rejoining(CONFIG)
    aside = [
        replace(n, pose_in_local=compose(np.array([0.8, 0.8, 0.0]), n.pose_in_local)) for n in blank.nodes
    ]
    shifted = submap_of(aside, blank.begin, len(aside), index=1)
    blank.submaps = [blank.submaps[0], shifted]
    assert blank.settle(*right) == []


def test_ground_that_is_not_known_proves_nothing(world):
    apart = np.array([60.0, 0.0, 0.0])
    assert world.settle(*(world.find(k, apart) for k in (2, 8, 14))) == []


def test_a_robot_that_stands_still_is_not_joined():
    still = World(second=SECOND[:12] * np.array([0.02, 0.02, 1.0]) + np.array([4.5, 4.2, 0.0]))
    assert np.ptp(still.travel[still.begin :]) < 1.0
    assert still.settle(still.find(2), still.find(5), still.find(8)) == []


def test_narrow_and_rejected_closures_are_left_alone(world):
    narrow = world.find(4, ELSEWHERE, wide=False)
    failed = world.find(6, rejected="low score")
    assert world.settle(narrow, failed) == [(4, ""), (6, "low score")]


def test_once_joined_wide_closures_must_fit_the_graph():
    world = World()
    poses = world.graph.poses
    world.graph.set_poses(world.begin, compose(CARRIED, poses[world.begin :]))
    joint = between(world.graph.poses[3], world.graph.poses[world.begin + 3])
    world.graph.add_constraints([3], [world.begin + 3], joint[None], np.eye(3), "loop")
    here = np.zeros(3)
    assert world.settle(world.find(5, here), world.find(9, ELSEWHERE)) == [(5, ""), (9, "inconsistent")]


def test_what_still_waits_at_the_end_is_unconfirmed(world):
    world.settle(world.find(2))
    assert [closure.rejected for closure in world.rejoining.give_up()] == ["unconfirmed"]
    assert world.rejoining.waiting == []
