"""Scans and points along a trajectory become one volume."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glassslam.config import Config
from glassslam.errors import GridError
from glassslam.records import LaserScan, Odometry, PointSet, Trajectory
from glassslam.volume.mapper import VolumeMapper, build_volume
from glassslam.volume.odds import Clamp
from glassslam.volume.options import VolumeOptions, volume_options
from glassslam.volume.sensors import InverseModel
from glassslam.volume.track import Track

STANDING = Trajectory(np.zeros(1), np.zeros((1, 3)))
DRIVING = Trajectory(np.array([0.0, 2.0]), np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]]))
HIT, MISS = math.log(0.7 / 0.3), math.log(0.4 / 0.6)


def scan(stamp=0.0, ahead=1.01):
    """Three beams: left, ahead, right; only the one ahead has a return."""
    ranges = np.array([np.nan, ahead, np.nan], dtype=np.float32)
    return LaserScan(stamp, ranges, -math.pi / 2, math.pi / 2, 0.05, 20.0)


def points(*xyz, stamp=0.0, origin=(0.0, 0.0, 0.2)):
    return PointSet(stamp, np.array(xyz, dtype=np.float32).reshape(-1, 3), np.array(origin))


def value(tree, *place):
    return float(tree.log_odds_at(np.array([place], dtype=np.float64))[0])


def test_a_scan_is_entered_at_the_height_of_the_lidar():
    volume = build_volume([scan()], STANDING, VolumeOptions(lidar_height=0.32))
    assert volume.lidar.centres(volume.lidar.occupied()).tolist() == [pytest.approx([1.025, 0.025, 0.325])]
    assert value(volume.lidar, 0.5, 0.01, 0.32) == pytest.approx(MISS)
    assert math.isnan(value(volume.lidar, 1.2, 0.01, 0.32))
    assert volume.counts == {"scans": 1, "point_sets": 0, "points": 0, "pairs": 0}


def test_the_laser_is_where_it_is_mounted():
    volume = build_volume([scan()], STANDING, None, (0.5, 0.0, math.pi / 2))
    assert volume.lidar.centres(volume.lidar.occupied())[0] == pytest.approx([0.5, 1.0, 0.2], abs=0.05)


def test_records_are_placed_along_the_trajectory():
    volume = build_volume([scan(1.0), points([1.01, 0.01, 0.51], stamp=1.5)], DRIVING)
    assert volume.lidar.centres(volume.lidar.occupied())[0] == pytest.approx([2.0, 0.0, 0.2], abs=0.05)
    found = volume.ultrasonic.centres(volume.ultrasonic.occupied())[0]
    assert found == pytest.approx([2.5, 0.0, 0.5], abs=0.05)


def test_two_sensors_that_agree_in_one_moment_are_0_845_sure_of_it():
    volume = build_volume([scan(), points([1.01, 0.01, 0.21], stamp=0.02)], STANDING)
    assert value(volume.fused, 1.01, 0.01, 0.21) == pytest.approx(2 * HIT)
    assert value(volume.fused, 0.5, 0.01, 0.21) == pytest.approx(2 * MISS)
    assert volume.counts["pairs"] == 1


def test_a_sensor_that_hears_what_the_other_looks_through_makes_even_odds():
    volume = build_volume([scan(ahead=3.0), points([1.01, 0.01, 0.21])], STANDING)
    assert value(volume.fused, 1.01, 0.01, 0.21) == pytest.approx(HIT + MISS)


@pytest.mark.parametrize(
    ("pool", "expected"), [("bayes", HIT), ("iop", HIT), ("lop", math.log(0.6 / 0.4)), ("liop", HIT / 2)]
)
def test_where_the_lidar_says_nothing_the_pools_differ(pool, expected):
    volume = build_volume([scan(), points([1.0, 0.0, 0.8])], STANDING, VolumeOptions(pool=pool))
    assert value(volume.fused, 1.0, 0.0, 0.8) == pytest.approx(expected, abs=1e-5)


def test_each_sensor_keeps_a_volume_of_its_own():
    volume = build_volume([scan(), points([1.0, 0.0, 0.8])], STANDING)
    assert math.isnan(value(volume.lidar, 1.0, 0.0, 0.8))
    assert math.isnan(value(volume.ultrasonic, 0.5, 0.01, 0.01))


def test_measurements_far_apart_in_time_are_not_paired():
    volume = build_volume([scan(), points([1.0, 0.0, 0.8], stamp=0.3)], STANDING)
    assert volume.counts["pairs"] == 0
    assert value(volume.fused, 1.0, 0.0, 0.8) == pytest.approx(HIT)


@given(st.integers(1, 12))
def test_evidence_adds_up_to_the_bound(times):
    volume = build_volume([points([1.0, 0.0, 0.8], stamp=0.1 * k) for k in range(times)], STANDING)
    bound = volume.fused.clamp.high
    assert value(volume.fused, 1.0, 0.0, 0.8) == pytest.approx(min(times * HIT, bound), abs=1e-5)


def test_points_outside_of_the_field_of_view_or_without_numbers_are_counted():
    record = points([1.0, 0.0, 0.5], [-1.0, 0.0, 0.5], [np.nan, 0.0, 0.0])
    volume = build_volume([record], STANDING)
    assert volume.counts["points"] == 1
    assert volume.dropped == {"point that is not finite": 1, "point outside of the field of view": 1}


def test_a_sensor_that_looks_back_sees_what_is_behind():
    back = replace(points([-1.0, 0.0, 0.5], [1.0, 0.0, 0.5]), axis=(-1.0, 0.0, 0.0))
    volume = build_volume([back], STANDING)
    assert volume.counts["points"] == 1
    assert volume.dropped == {"point outside of the field of view": 1}
    assert value(volume.ultrasonic, -1.0, 0.0, 0.5) == pytest.approx(HIT)


@pytest.mark.parametrize("yaw", [0.4, 1.3, 2.9])
def test_points_on_the_border_of_the_field_of_view_are_inside(yaw):
    side = 3.9 * np.array([[-math.sin(yaw), math.cos(yaw), 0.0], [0.0, 0.0, 1.0]]) + 1.0
    border = PointSet(0.0, side.astype(np.float32), np.ones(3), axis=(math.cos(yaw), math.sin(yaw), 0.0))
    assert build_volume([border], STANDING).counts["points"] == 2


def test_an_echo_beyond_four_metres_is_free_space():
    volume = build_volume([points([4.5, 0.0, 0.2])], STANDING)
    assert len(volume.ultrasonic.occupied()) == 0
    assert value(volume.ultrasonic, 3.9, 0.0, 0.2) == pytest.approx(MISS)


def test_records_outside_of_the_trajectory_are_dropped_and_counted():
    records = [scan(-1.0), scan(2.4), scan(2.6), points([1.0, 0.0, 0.5], stamp=9.0)]
    volume = build_volume(records, DRIVING)
    assert volume.counts["scans"] == 1
    assert volume.dropped == {"scan outside of the trajectory": 2, "point set outside of the trajectory": 1}


def test_defective_scans_and_other_records_are_left_out():
    empty = LaserScan(0.0, np.empty(0, np.float32), 0.0, 0.1, 0.0, 10.0)
    volume = build_volume([empty, Odometry(0.0, (0.0, 0.0, 0.0)), scan()], STANDING)
    assert (volume.counts["scans"], volume.dropped) == (1, {"no beams": 1})


def test_a_ping_without_echo_is_a_ping():
    volume = build_volume([points()], STANDING)
    assert (volume.counts["point_sets"], volume.counts["points"]) == (1, 0)
    assert volume.fused.count() == (0, 0)


def test_a_turning_sweep_is_straightened():
    turning = Trajectory(np.array([-1.0, 1.0]), np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]]))
    ranges = np.full(3, 2.0, dtype=np.float32)
    # one beam every 0.1 s while the robot turns with 1 rad/s: all leave in the same direction
    sweep = LaserScan(0.0, ranges, 0.0, -0.1, 0.05, 20.0, time_increment=0.1)
    volume = build_volume([sweep], turning)
    assert volume.lidar.centres(volume.lidar.occupied()).tolist() == [pytest.approx([2.025, 0.025, 0.225])]


def test_measurements_that_may_leave_the_tree_are_dropped_and_counted():
    far = Trajectory(np.zeros(1), np.array([[1630.0, 0.0, 0.0]]))
    volume = build_volume([scan(), points([1.0, 0.0, 0.5])], far)
    assert volume.counts["scans"] == 0
    assert volume.counts["point_sets"] == 1
    assert volume.dropped == {"scan too far from the origin of the volume": 1}
    lost = build_volume([points([1.0, 0.0, 0.5])], Trajectory(np.zeros(1), np.array([[0.0, 1e9, 0.0]])))
    assert lost.dropped == {"point set too far from the origin of the volume": 1}


def test_without_separate_volumes_the_joint_one_is_the_same():
    records = [scan(), points([1.01, 0.01, 0.21], stamp=0.02)]
    both, alone = (build_volume(records, STANDING, VolumeOptions(separate=flag)) for flag in (True, False))
    assert np.array_equal(both.fused.leaves().log_odds, alone.fused.leaves().log_odds)
    assert (alone.lidar.count(), alone.ultrasonic.count()) == ((0, 0), (0, 0))


def test_the_defaults_of_the_configuration_are_those_of_the_options():
    usual = volume_options(Config().volume)
    assert usual == VolumeOptions(separate=False)


def test_the_configuration_says_how_a_volume_is_made():
    changes = {
        "resolution": 0.1, "lidar_height": 0.5, "pool": "lop", "lidar_weight": 2.0, "ultrasonic_weight": 1.0,
        "max_pairing_time": 0.2, "lidar_free": 0.3, "lidar_occupied": 0.8, "lidar_max_range": 9.0,
        "ultrasonic_free": 0.45, "ultrasonic_occupied": 0.6, "ultrasonic_max_range": 3.0,
        "ultrasonic_half_angle_deg": 45.0, "min_probability": 0.2, "max_probability": 0.9,
        "occupied_threshold": 0.6,
    }  # fmt: skip
    config = Config.from_mapping({"volume": changes, "sensor": {"max_range": 7.0}})
    assert volume_options(config.volume, config.sensor, laser_height=0.3) == VolumeOptions(
        resolution=0.1,
        clamp=Clamp(0.2, 0.9, 0.6),
        lidar=InverseModel(0.3, 0.8, 9.0),
        ultrasonic=InverseModel(0.45, 0.6, 3.0, math.pi / 4),
        lidar_height=0.5,
        slop=0.2,
        pool="lop",
        weights=(2.0, 1.0),
        ranges=config.sensor,
        separate=False,
    )


def test_a_trajectory_needs_a_pose():
    with pytest.raises(GridError, match="the trajectory has no pose"):
        VolumeMapper(Trajectory(np.empty(0), np.empty((0, 3))))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"pool": "mean"}, "there is no pool 'mean'"),
        ({"weights": (0.0, 0.0)}, "weights"),
        ({"slop": -1.0}, "messages cannot differ by -1.0 s"),
        ({"lidar_height": math.nan}, "a lidar cannot be nan m high"),
    ],
)
def test_senseless_options_are_refused(change, words):
    with pytest.raises(GridError, match=words):
        VolumeOptions(**change)


def test_a_track_turns_the_short_way_and_ignores_the_order_of_its_poses():
    poses = np.array([[1.0, 0.0, -3.1], [0.0, 0.0, 3.1]])
    track = Track(Trajectory(np.array([1.0, 0.0]), poses))
    assert track.at(0.5)[:2] == pytest.approx([0.5, 0.0])
    assert abs(track.at(0.5)[2]) == pytest.approx(math.pi)
    assert track.at(1.4) == pytest.approx(poses[0])
    assert track.at(1.6) is None
    assert track.twist_at(0.5) == pytest.approx([-1.0, 0.0, 0.083], abs=0.05)
    assert track.twist_at(1.5).tolist() == [0.0, 0.0, 0.0]


def test_equal_stamps_are_no_division_by_zero():
    track = Track(Trajectory(np.zeros(2), np.array([[1.0, 0.0, 0.0], [2.0, 0.0, 0.0]])))
    assert np.isfinite(track.at(0.0)).all()


def test_nothing_is_known_within_a_long_gap_in_which_the_robot_moved():
    track = Track(Trajectory(np.array([0.0, 10.0]), np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 0.0]])))
    assert track.at(0.4) == pytest.approx([0.0, 0.0, 0.0])
    assert track.at(9.6) == pytest.approx([3.0, 0.0, 0.0])
    assert [track.at(stamp) for stamp in (0.6, 5.0, 9.4)] == [None, None, None]


def test_a_robot_that_stands_is_where_it_was_however_long():
    track = Track(Trajectory(np.array([0.0, 100.0]), np.array([[1.0, 2.0, 0.3], [1.02, 2.0, 0.31]])))
    assert track.at(50.0) == pytest.approx([1.01, 2.0, 0.305])
    turned = Track(Trajectory(np.array([0.0, 100.0]), np.array([[1.0, 2.0, 0.3], [1.02, 2.0, 0.51]])))
    assert turned.at(50.0) is None
