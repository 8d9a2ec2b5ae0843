"""Global SLAM: loops are closed, and time has no say in it."""

import threading
from concurrent.futures import Executor, Future
from dataclasses import replace

import numpy as np
import pytest
from slam_worlds import RING, Lidar, in_first_frame, odometry, range_data, round_trip

from glassslam.config import Config
from glassslam.errors import GridError
from glassslam.geometry import between, transform_points
from glassslam.grid.probability_grid import OddsModel
from glassslam.grid.submap import ActiveSubmaps
from glassslam.slam import global_slam
from glassslam.slam.closure import Closure
from glassslam.slam.global_slam import GlobalSlam
from glassslam.slam.loop_closing import LoopSearcher
from glassslam.slam.node import Node
from glassslam.slam.stopwatch import Stages

CONFIG = Config.from_mapping(
    {
        "optimization": {
            "optimize_every_n_nodes": 60,
            "odometry_translation_noise": 0.03,
            "odometry_rotation_noise": 0.006,
        },
        "loop_closure": {"min_node_gap": 80, "sampling_stride": 4},
        "submap": {"num_range_data": 30},
    }
)


@pytest.fixture(scope="module")
def truth():
    """A node every 0.2 m, once around the corridor and a piece further."""
    return round_trip(1.2)[::4]


@pytest.fixture(scope="module")
def run(truth):
    """Nodes and finished submaps as local SLAM with a drift of 1.5 deg per 10 m hands them over."""
    lidar = Lidar(RING)
    local = odometry(truth, drift=np.radians(0.15))
    submaps = ActiveSubmaps(0.05, OddsModel(), CONFIG.submap.num_range_data)
    steps = []
    for k, (pose, seen_from) in enumerate(zip(local, truth, strict=True)):
        returns = range_data(lidar.look(0.1 * k, seen_from)).returns
        nothing = np.empty((0, 2))
        node = Node(k, k, 0.1 * k, pose, np.zeros(2), returns.astype(np.float32), nothing, 0.35)
        _, finished = submaps.insert(k, pose, pose[:2], transform_points(pose, returns), nothing)
        steps.append((node, finished))
    return steps, submaps.finish()


def feed(world, run):
    steps, rest = run
    for node, finished in steps:
        if finished is not None:
            world.add_submap(finished)
        world.add_node(node)
    for submap in rest:
        world.add_submap(submap)


def close_loops(run, config=CONFIG, pool=None):
    world = GlobalSlam(config, Stages())
    if pool is not None:
        world._pool = pool
    feed(world, run)
    world.finish()
    return world


def errors(world, truth):
    off = between(in_first_frame(truth), world.poses)
    return np.hypot(off[:, 0], off[:, 1]), np.abs(off[:, 2])


def bytes_of(world):
    edges = world.graph.edges
    return [
        array.tobytes() for array in (world.poses, edges.ends, edges.measured, edges.weights, edges.enabled)
    ]


class Eager(Executor):
    """Searches are done before anything else goes on."""

    def submit(self, function, /, *arguments):
        future = Future()
        future.set_result(function(*arguments))
        return future


class Late(Executor):
    """Searches are done when nothing can go on without them."""

    def submit(self, function, /, *arguments):
        class WhenAsked(Future):
            def result(self, timeout=None):
                return function(*arguments)

        return WhenAsked()


def test_a_loop_with_drift_is_closed(run, truth):
    before, _ = errors(close_loops(run, CONFIG.model_copy(update={"loop_closure": disabled()})), truth)
    world = close_loops(run)
    distance, turn = errors(world, truth)
    assert before[-1] > 0.5
    assert distance[-1] < 0.15
    assert distance.mean() < 0.3 * before.mean()
    assert turn[-1] < np.radians(2.0)
    used, taken_out = world.closures()
    assert used >= 3
    assert used + taken_out + sum(world.rejected.values()) == world.searches
    residuals = world.residuals()
    assert residuals["loop_translation_rms"] < 0.1
    assert residuals["loop_rotation_rms"] < 0.02


def disabled():
    return CONFIG.loop_closure.model_copy(update={"enabled": False})


def test_without_loop_closing_the_poses_are_those_of_local_slam(run):
    world = close_loops(run, CONFIG.model_copy(update={"loop_closure": disabled()}))
    local = np.array([node.pose_in_local for node, _ in run[0]])
    np.testing.assert_allclose(world.poses, local, atol=1e-9)
    assert world.searches == 0
    assert world.closures() == (0, 0)
    assert world.residuals() == {}


@pytest.mark.parametrize("pool", [Eager(), Late()], ids=["eager", "late"])
def test_the_result_does_not_depend_on_when_searches_are_done(run, pool):
    assert bytes_of(close_loops(run, pool=pool)) == bytes_of(close_loops(run))


def test_a_search_held_up_until_it_is_waited_for_changes_nothing(run, monkeypatch):
    expected = bytes_of(close_loops(run))
    gate, held = threading.Event(), []

    class Held(LoopSearcher):
        def search(self, *arguments):
            assert gate.wait(60)
            held.append(threading.current_thread().name)
            return super().search(*arguments)

    class Opening(Future):
        def result(self, timeout=None):
            gate.set()
            try:
                return super().result(timeout)
            finally:
                gate.clear()

    monkeypatch.setattr(global_slam, "LoopSearcher", Held)
    monkeypatch.setattr("concurrent.futures.thread._base.Future", Opening)
    assert bytes_of(close_loops(run)) == expected
    assert held
    assert all(name.startswith("loop-closing") for name in held)


def test_nodes_after_a_doubtful_step_are_held_less_firmly(run):
    steps, _ = run
    doubtful = [(replace(node, doubtful=node.index == 5), None) for node, _ in steps[:10]]
    world = GlobalSlam(CONFIG, Stages())
    feed(world, (doubtful, []))
    weights = world.graph.edges.weights
    np.testing.assert_allclose(weights[3], np.diag(1 / np.array([0.03, 0.03, 0.006])))
    assert (np.diag(weights[4]) < np.diag(weights[3])).all()
    world.abandon()


def test_a_wrong_closure_is_taken_out_and_counted(run, truth):
    """A searcher that lies now and then must not bend the map."""

    class Lying(LoopSearcher):
        def search(self, *arguments):
            closures = super().search(*arguments)
            return [self.bent(closure) if k == 0 else closure for k, closure in enumerate(closures)]

        def bent(self, closure):
            wrong = closure.anchor_from_node + np.array([3.0, 0.0, 0.5])
            return Closure(closure.candidate, "", wrong, np.diag([0.05**2, 0.05**2, 0.01**2]))

    world = GlobalSlam(CONFIG, Stages())
    world._searcher = Lying(CONFIG.loop_closure)
    feed(world, run)
    world.finish()
    assert world.closures()[1] >= 1
    assert errors(world, truth)[0][-1] < 0.15


def test_what_fails_in_the_background_fails_in_front(run, monkeypatch):
    class Failing(LoopSearcher):
        def search(self, *arguments):
            raise GridError("nonsense")

    monkeypatch.setattr(global_slam, "LoopSearcher", Failing)
    with pytest.raises(GridError, match="nonsense"):
        close_loops(run)


def test_seconds_of_the_background_are_counted(run):
    stages = Stages()
    world = GlobalSlam(CONFIG, stages)
    feed(world, run)
    world.finish()
    assert stages.times["loop closing"].cpu > 0
    assert stages.times["optimisation"].cpu > 0
