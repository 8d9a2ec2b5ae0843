"""Which loop closures are searched for, and where."""

import math
from dataclasses import replace

import numpy as np
import pytest
from slam_worlds import round_trip

from glassslam.config import LoopClosureConfig
from glassslam.geometry import between
from glassslam.grid.probability_grid import ProbabilityGrid
from glassslam.grid.submap import Submap
from glassslam.posegraph import PoseGraph
from glassslam.slam.closure import is_wide
from glassslam.slam.loop_closing import LoopSearcher, select
from glassslam.slam.node import Node
from glassslam.slam.rejoin import WEAK_STEP

CONFIG = LoopClosureConfig(min_node_gap=40, sampling_stride=5, max_searches_per_submap=4)


def chain(poses, noise=(0.02, 0.02, 0.002)):
    """A pose graph of odometry alone."""
    graph = PoseGraph()
    graph.add_poses(poses)
    numbers = np.arange(len(poses))
    steps = between(poses[:-1], poses[1:])
    graph.add_constraints(numbers[:-1], numbers[1:], steps, np.diag(1.0 / np.array(noise)), "odometry")
    return graph


def nodes_at(poses):
    nothing = np.empty((0, 2), dtype=np.float32)
    return [Node(k, k, float(k), pose, np.zeros(2), nothing, nothing, 0.3) for k, pose in enumerate(poses)]


def submap(index, members, poses):
    return Submap(index, poses[members[0]], ProbabilityGrid(0.05), list(members), finished=True)


@pytest.fixture(scope="module")
def loop():
    """A node every half metre, once around the corridor and a little further."""
    poses = round_trip(1.2)[::10]
    return poses, chain(poses), nodes_at(poses)


def chosen(loop, submaps, first=0, last=None, config=CONFIG):
    _, graph, nodes = loop
    return select(graph, nodes, submaps, first, len(nodes) if last is None else last, config)


def test_a_node_that_comes_back_is_searched_in_the_old_submap(loop):
    poses, graph, _ = loop
    found = chosen(loop, [submap(0, range(12), poses)])
    assert found
    for candidate in found:
        assert candidate.submap == 0
        assert candidate.node > 11 + CONFIG.min_node_gap
        distances = np.hypot(*(poses[:12, :2] - poses[candidate.node, :2]).T)
        assert candidate.anchor == distances.argmin()
        np.testing.assert_allclose(
            candidate.anchor_from_node, between(poses[candidate.anchor], poses[candidate.node]), atol=1e-9
        )
        np.testing.assert_array_equal(candidate.anchor_in_local, poses[candidate.anchor])
        np.testing.assert_allclose(
            candidate.covariance, graph.relative_covariance(candidate.anchor, candidate.node)
        )


def test_recent_submaps_and_far_ones_are_not_searched(loop):
    poses, _, nodes = loop
    last = len(nodes)
    assert chosen(loop, [submap(0, range(last - 30, last - 20), poses)]) == []
    opposite = range(40, 50)
    assert chosen(loop, [submap(0, opposite, poses)], last=last) == []
    assert chosen(loop, []) == []


def test_only_the_nodes_asked_for_are_searched(loop):
    poses, _, nodes = loop
    first, last = len(nodes) - 8, len(nodes) - 2
    found = chosen(loop, [submap(0, range(12), poses)], first, last)
    assert found
    assert all(first <= candidate.node < last for candidate in found)
    assert chosen(loop, [submap(0, range(12), poses)], last, last) == []


def test_searches_in_one_submap_are_limited_and_spread(loop):
    poses, _, _ = loop
    submaps = [submap(0, range(12), poses), submap(1, range(6, 18), poses)]
    found = chosen(loop, submaps)
    for index in (0, 1):
        searched = [candidate.node for candidate in found if candidate.submap == index]
        assert 1 <= len(searched) <= CONFIG.max_searches_per_submap
        assert np.diff(np.sort(searched)).min(initial=99) >= CONFIG.sampling_stride
    one = CONFIG.model_copy(update={"max_searches_per_submap": 1})
    assert len(chosen(loop, submaps, config=one)) == 2
    every = CONFIG.model_copy(update={"sampling_stride": 1, "max_searches_per_submap": 20})
    assert len(chosen(loop, submaps, config=every)) > len(found)


def test_the_nearest_nodes_come_first(loop):
    poses, _, _ = loop
    one = CONFIG.model_copy(update={"max_searches_per_submap": 1})
    (candidate,) = chosen(loop, [submap(0, range(12), poses)], config=one)
    gaps = np.hypot(*(poses[12 + CONFIG.min_node_gap :, None, :2] - poses[None, :12, :2]).transpose(2, 0, 1))
    nearest = gaps.min()
    assert np.hypot(*candidate.anchor_from_node[:2]) == pytest.approx(nearest)


def test_the_window_is_three_deviations_and_a_margin(loop):
    poses, graph, _ = loop
    for candidate in chosen(loop, [submap(0, range(12), poses)]):
        covariance = graph.relative_covariance(candidate.anchor, candidate.node)
        spread = 3 * math.sqrt(max(covariance[0, 0], covariance[1, 1]))
        assert candidate.linear_window == pytest.approx(spread + 0.1)
        assert candidate.angular_window == pytest.approx(3 * math.sqrt(covariance[2, 2]) + 0.03)


def test_windows_have_their_limits(loop):
    poses, _, nodes = loop
    lost = (poses, chain(poses, noise=(1.0, 1.0, 0.5)), nodes)
    for candidate in chosen(lost, [submap(0, range(12), poses)]):
        assert candidate.linear_window == CONFIG.max_linear_window
        assert candidate.angular_window == pytest.approx(math.radians(CONFIG.max_angular_window_deg))


def test_doubt_widens_what_is_searched(loop):
    """Six metres away is out of sight for a graph that is sure, and possible for one that is not."""
    poses, _, nodes = loop
    aside = poses.copy()
    aside[60:, 1] += 6.0
    members = [submap(0, range(12), aside)]
    sure = chosen((aside, chain(aside, noise=(0.001, 0.001, 0.0001)), nodes), members)
    unsure = chosen((aside, chain(aside, noise=(0.2, 0.2, 0.02)), nodes), members)
    assert len(unsure) > len(sure)


class TestSearcher:
    def test_grids_for_the_search_are_kept_within_a_budget(self, monkeypatch):
        searcher = LoopSearcher(CONFIG)
        submaps = [submap(k, [k], np.zeros((9, 3))) for k in range(5)]
        first = searcher._matcher(submaps[0], 2.0)
        assert searcher._matcher(submaps[0], 3.0) is first
        monkeypatch.setattr("glassslam.slam.loop_closing._CACHED_BYTES", 2 * first.nbytes)
        for wanted in submaps[1:]:
            searcher._matcher(wanted, 2.0)
        assert list(searcher._matchers) == [3, 4]

    def test_a_wider_window_gets_a_wider_grid(self):
        searcher = LoopSearcher(CONFIG)
        wanted = submap(0, [0], np.zeros((1, 3)))
        narrow = searcher._matcher(wanted, 2.0)
        wide = searcher._matcher(wanted, 10.0)
        assert wide is not narrow
        assert wide.max_linear_window >= 10.0
        assert wide.max_linear_window <= CONFIG.max_linear_window + 0.11


@pytest.fixture
def broken():
    """A loop whose last third begins a new stretch, hardly held to what was before."""
    poses = round_trip(1.2)[::10]
    begin = len(poses) * 2 // 3
    graph = PoseGraph()
    graph.add_poses(poses)
    steps = between(poses[:-1], poses[1:])
    for k, step in enumerate(steps):
        noise = WEAK_STEP if k + 1 == begin else (0.02, 0.02, 0.002)
        graph.add_constraints([k], [k + 1], step[None], np.diag(1.0 / np.array(noise)), "odometry")
    nodes = [replace(node, begins=node.index == begin) for node in nodes_at(poses)]
    return (poses, graph, nodes), begin


class TestAcrossABreak:
    """Where the robot may have been carried and turned."""

    def test_searches_begin_at_once_and_look_all_around(self, broken):
        loop, begin = broken
        found = chosen(loop, [submap(0, range(begin - 12, begin), loop[0])])
        assert min(candidate.node for candidate in found) == begin
        assert all(candidate.angular_window == math.pi for candidate in found)
        assert all(candidate.linear_window == CONFIG.max_linear_window for candidate in found)
        assert all(is_wide(candidate, CONFIG) for candidate in found)

    def test_within_a_stretch_all_is_as_usual(self, broken):
        loop, begin = broken
        found = chosen(loop, [submap(0, range(4), loop[0])], last=begin)
        assert not any(is_wide(candidate, CONFIG) for candidate in found)

    def test_a_stretch_that_is_joined_is_searched_for_as_usual(self, broken):
        (poses, graph, nodes), begin = broken
        one = chosen((poses, graph, nodes), [submap(0, range(begin - 12, begin), poses)])[0]
        joined = PoseGraph()
        joined.add_poses(poses)
        edges = graph.edges
        joined.add_constraints(edges.ends[:, 0], edges.ends[:, 1], edges.measured, edges.weights, "odometry")
        step = between(poses[one.anchor], poses[one.node])
        joined.add_constraints([one.anchor], [one.node], step[None], 50.0 * np.eye(3), "loop")
        found = chosen((poses, joined, nodes), [submap(0, range(begin - 12, begin), poses)])
        assert found
        assert not any(is_wide(candidate, CONFIG) for candidate in found)

    def test_wide_searches_are_few_and_spread_over_the_submaps(self, broken):
        loop, begin = broken
        submaps = [submap(k, range(begin - 12, begin), loop[0]) for k in range(20)]
        found = chosen(loop, submaps)
        assert len(found) == 24
        assert {candidate.submap for candidate in found} == set(range(20))
