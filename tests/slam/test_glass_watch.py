"""Glass on its way from a scan to a node: where it is, to whom it belongs, and what waits for a decision."""

import math

import numpy as np
import pytest
from glass_scans import COARSE, FINE, before_a_pane, scan, walls
from hypothesis import given
from hypothesis import strategies as st

from glassslam.config import GlassConfig, SensorConfig
from glassslam.records import LaserScan, Trajectory
from glassslam.slam.glass_watch import GlassWatch
from glassslam.slam.local import LocalResult, Match
from glassslam.slam.node import Node
from glassslam.slam.range_data import base_motion, prepare
from glassslam.slam.trajectory import PoseTracks

STILL = np.zeros(3)
PEAK = GlassConfig(detector="intensity_peak", thresh=5000.0, grad=500.0, width=5)
NONE = np.empty((0, 2), dtype=np.float32)


def shining(beam, distance=2.0, count=101, **changes):
    """A scan of faint returns with one bright beam."""
    echoes = np.random.default_rng(3).uniform(900.0, 1100.0, count)
    echoes[beam] = 9000.0
    return scan(np.full(count, distance), echoes, FINE, **changes)


def side_wall_with_a_lone_return():
    """A wall to the right, and one return 1.2 m to the left with nothing around it."""
    bearings = np.radians(np.arange(-180.0, 180.0))
    with np.errstate(divide="ignore"):
        ranges = np.where(np.abs(bearings + np.pi / 2) < 1.0, 1.0 / np.abs(np.sin(bearings)), np.inf)
    ranges[270] = 1.2
    return LaserScan(0.0, ranges.astype(np.float32), -np.pi, COARSE, 0.05, 30.0)


def placed(pose, node=None):
    """What local SLAM says of a scan that became node number `node`, or none."""
    pose = np.array(pose, dtype=np.float64)
    made = None if node is None else Node(node, node, 0.0, pose, np.zeros(2), NONE, NONE, 0.1)
    return LocalResult(Match(pose, 0.1), made, [], [])


def tracks(count):
    """A run of nodes that never moved."""
    track = Trajectory(0.1 * np.arange(count), np.zeros((count, 3)))
    return PoseTracks(track, track, track, track)


def watched(*steps, config=PEAK, laser=(0.0, 0.0, 0.0), twist=STILL):
    watch = GlassWatch(config, np.array(laser))
    for one, place in steps:
        watch.add(watch.look(one, twist), place)
    watch.settle()
    return watch


def test_glass_stands_where_the_laser_sees_it():
    seen = watched((shining(50), placed(STILL, 0)), laser=(0.3, 0.1, math.pi / 2)).observations()
    assert seen.position[0] == pytest.approx([0.3, 2.1])
    assert seen.normal[0] == pytest.approx(math.pi / 2)
    assert seen.sensor[0] == pytest.approx([0.3, 0.1])


def test_the_motion_within_the_sweep_is_undone():
    one = shining(50, time_increment=0.01)
    moving = watched((one, placed(STILL, 0)), twist=np.array([1.0, 0.0, 0.0])).observations()
    assert moving.position[0] == pytest.approx([2.5, 0.0])
    turning = watched((one, placed(STILL, 0)), twist=np.array([0.0, 0.0, 0.2])).observations()
    assert turning.position[0] == pytest.approx([2.0 * math.cos(0.1), 2.0 * math.sin(0.1)])
    assert turning.normal[0] == pytest.approx(0.1)


@given(
    st.lists(st.floats(-2.0, 2.0), min_size=3, max_size=3),
    st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3),
    st.integers(0, 100),
)
def test_beams_of_glass_move_as_all_beams_do(twist, laser, beam):
    """The same pose that `prepare` takes the beam from."""
    twist, laser = np.array(twist), np.array(laser)
    one = shining(beam, time_increment=0.003)
    returns = prepare(one, laser, twist, SensorConfig()).returns
    moved = base_motion(twist, np.array([0.003 * beam]))[0]
    c, s = math.cos(moved[2] + laser[2]), math.sin(moved[2] + laser[2])
    bearing = one.angle_min + beam * one.angle_increment
    x, y = 2.0 * math.cos(bearing), 2.0 * math.sin(bearing)
    lx = moved[0] + math.cos(moved[2]) * laser[0] - math.sin(moved[2]) * laser[1]
    ly = moved[1] + math.sin(moved[2]) * laser[0] + math.cos(moved[2]) * laser[1]
    assert returns[beam] == pytest.approx([lx + c * x - s * y, ly + s * x + c * y], abs=1e-6)


def test_glass_follows_the_node_that_saw_it():
    seen = watched((shining(50), placed((1.0, 0.0, 0.0), 0))).observations()
    assert seen.node.tolist() == [0]
    moved, normals = seen.at(np.array([[0.0, 5.0, math.pi / 2]]))
    assert moved == pytest.approx(np.array([[0.0, 7.0]]))
    assert normals == pytest.approx([math.pi / 2])


def test_only_nodes_are_looked_at_by_intensity():
    watch = watched((shining(50), placed((1.0, 0.0, 0.0), 0)), (shining(50), placed((1.5, 0.0, 0.0))))
    assert watch.observations().node.tolist() == [0]


def test_every_scan_is_searched_for_narrow_returns_which_belong_to_the_node_before():
    config = GlassConfig(detector="narrow_return")
    room = [side_wall_with_a_lone_return(), side_wall_with_a_lone_return()]
    steps = [(room[0], placed((1.0, 0.0, 0.0), 0)), (room[1], placed((1.5, 0.0, 0.0)))]
    seen = watched(*steps, config=config).observations()
    assert seen.node.tolist() == [0, 0]
    assert seen.position == pytest.approx(np.array([[0.0, 1.2], [0.5, 1.2]]), abs=1e-6)


def test_a_scan_is_looked_at_once():
    watch = GlassWatch(PEAK, STILL)
    calls = []
    look = watch.look(shining(50), STILL)
    detect = watch.choice.detect
    watch.choice.detect = lambda one: calls.append(one) or detect(one)
    look.points()
    watch.add(look, placed(STILL, 0))
    assert len(calls) == 1


def test_scans_that_came_before_the_decision_are_looked_at_after_it():
    scans = walls(FINE, count=12)
    watch = GlassWatch(GlassConfig(), STILL)
    for k, one in enumerate(scans):
        look = watch.look(one, STILL)
        assert look.sighting() is None
        watch.add(look, placed((0.1 * k, 0.0, 0.0), k))
    watch.settle()
    assert watch.findings().beams.stamps.tolist() == [one.stamp for one in scans]


def test_whether_a_scan_waited_for_the_decision_makes_no_difference():
    scans = before_a_pane(FINE, count=70)
    run = [(one, placed((0.0, 0.1 * k, 0.0), k)) for k, one in enumerate(scans)]
    waited = watched(*run, config=GlassConfig(detector="auto"))
    learnt = waited.choice.calibration.to_dict()
    at_once = watched(*run, config=GlassConfig(detector="calibrated_peak", calibration=learnt))
    assert len(waited.observations()) > 0
    assert np.array_equal(waited.observations().position, at_once.observations().position)
    assert np.array_equal(waited.observations().node, at_once.observations().node)


def test_without_a_detector_there_are_no_findings():
    watch = watched((shining(50), placed(STILL, 0)), config=GlassConfig(detector="off"))
    assert watch.findings() is None
