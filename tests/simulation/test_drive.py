import numpy as np
import pytest
from tiny_scene import scene

from glassslam.errors import ConfigError
from glassslam.simulation import Scene, find_scene
from glassslam.simulation.drive import drive_path
from glassslam.simulation.scene import Drive


def drive(*points, **limits):
    waypoints = [p if isinstance(p, dict) else {"at": p} for p in points]
    return Drive.model_validate({"waypoints": waypoints} | limits)


PATHS = {
    "straight": drive([0, 0], [5, 0]),
    "corner": drive([0, 0], [3, 0], [3, 3]),
    "there and back": drive([0, 0], [3, 0], [0, 0.1]),
    "with a stop": drive([0, 0], {"at": [2, 0], "stop": 1.0}, [2, 3]),
    "office": Scene.load(find_scene("office")).drive,
}


@pytest.mark.parametrize("name", PATHS)
def test_the_robot_keeps_within_what_its_motors_allow(name):
    limits = PATHS[name]
    motion = drive_path(limits)
    step = motion.times[1] - motion.times[0]
    fastest = max(waypoint.speed for waypoint in limits.waypoints)
    assert motion.speeds.min() >= 0.0
    assert motion.speeds.max() <= fastest + 1e-9
    assert np.abs(motion.yaw_rates).max() <= limits.yaw_rate + 1e-9
    assert np.abs(np.diff(motion.speeds)).max() <= limits.acceleration * step + 1e-9
    assert np.abs(np.diff(motion.yaw_rates)).max() <= limits.yaw_acceleration * step + 1e-9


@pytest.mark.parametrize("name", PATHS)
def test_the_poses_are_the_integral_of_the_twist(name):
    motion = drive_path(PATHS[name])
    step = motion.times[1] - motion.times[0]
    moved = np.hypot(*np.diff(motion.poses[:, :2], axis=0).T)
    assert moved == pytest.approx(0.5 * (motion.speeds[1:] + motion.speeds[:-1]) * step, abs=1e-9)
    turned = np.diff(motion.poses[:, 2])
    assert turned == pytest.approx(0.5 * (motion.yaw_rates[1:] + motion.yaw_rates[:-1]) * step, abs=1e-9)


@pytest.mark.parametrize("name", PATHS)
def test_the_robot_passes_near_every_way_point_and_ends_at_the_last(name):
    limits = PATHS[name]
    motion = drive_path(limits)
    for waypoint in limits.waypoints:
        distance = np.hypot(*(motion.poses[:, :2] - np.array(waypoint.at)).T)
        assert distance.min() < 0.8 * limits.look_ahead
        if waypoint.stop is not None:
            assert distance.min() < 0.05
    assert np.hypot(*(motion.poses[-1, :2] - np.array(limits.waypoints[-1].at))) < 0.05
    assert (motion.speeds[-1], motion.yaw_rates[-1]) == (0.0, 0.0)


def test_the_robot_stands_where_it_is_told_to():
    motion = drive_path(PATHS["with a stop"])
    standing = motion.speeds == 0.0
    assert motion.times[-1] > 5.0
    assert standing[1:-1].sum() * 0.005 >= 1.0


def test_poses_at_any_time_lie_between_the_samples():
    motion = drive_path(PATHS["straight"])
    middle = 0.5 * (motion.times[200] + motion.times[201])
    assert motion.at(np.array([middle]))[0] == pytest.approx(motion.poses[200:202].mean(axis=0))
    assert motion.at(np.array([-1.0, 1e6])).tolist() == [motion.poses[0].tolist(), motion.poses[-1].tolist()]


def test_two_equal_way_points_are_refused():
    with pytest.raises(ConfigError, match="drive: two equal way points in a row"):
        drive_path(drive([0, 0], [0, 0], [1, 0]))


def test_the_room_of_these_tests_is_crossed_in_a_straight_line():
    motion = drive_path(scene().drive)
    assert motion.poses[:, 1] == pytest.approx(np.full(len(motion.times), 3.0))
