"""Real recordings, where they are at hand."""

import itertools
import math

import numpy as np
import pytest

from glassslam.records import Imu, LaserScan, Odometry
from glassslam.sources import open_recording


def read(path):
    """Info, dropped messages, and the records by type."""
    recording = open_recording(path)
    records = {LaserScan: [], Odometry: [], Imu: []}
    for record in recording.records():
        records[type(record)].append(record)
    return recording, records[LaserScan], records[Odometry], records[Imu]


def backward(records):
    return sum(b.stamp < a.stamp for a, b in itertools.pairwise(records))


def path_length(odometry):
    positions = np.array([record.pose[:2] for record in odometry])
    return np.hypot(*np.diff(positions, axis=0).T).sum()


@pytest.mark.parametrize(
    ("log", "scans", "beams", "metres", "no_echo"),
    [
        ("intel", 13631, 180, 508, 81.83),
        ("aces", 7374, 180, 325, 50.0),
        ("mit-csail", 1988, 361, 374, 81.91),
        ("mit-killian", 17480, 180, 1911, 51.06),
    ],
)
def test_carmen_logs(data_dir, log, scans, beams, metres, no_echo):
    recording, laser, odometry, _ = read(data_dir / "freiburg" / f"{log}.clf.gz")
    assert len(laser) == len(odometry) == recording.info.scan_count == scans
    assert {scan.ranges.size for scan in laser} == {beams}
    assert [scan.stamp for scan in laser] == [pose.stamp for pose in odometry]
    assert path_length(odometry) == pytest.approx(metres, abs=1)
    assert recording.info.no_echo == pytest.approx(no_echo)
    assert recording.dropped == {}
    assert recording.warnings == []


@pytest.mark.parametrize("log", ["intel", "aces", "mit-csail", "mit-killian"])
def test_stamps_are_the_keys_of_the_relations(data_dir, log):
    _, laser, _, _ = read(data_dir / "freiburg" / f"{log}.clf.gz")
    keys = np.unique(np.loadtxt(data_dir / "freiburg" / f"{log}.relations")[:, :2])
    stamps = np.sort([scan.stamp for scan in laser])
    near = np.clip(np.searchsorted(stamps, keys), 1, stamps.size - 1)
    distance = np.minimum(np.abs(stamps[near] - keys), np.abs(stamps[near - 1] - keys))
    assert distance.max() < 1e-5


@pytest.mark.parametrize("form", ["bag", "clf.gz"])
def test_intel_is_read_in_the_order_of_the_file(data_dir, form):
    _, laser, odometry, _ = read(data_dir / "freiburg" / f"intel.{form}")
    assert backward(laser) == 631
    assert path_length(odometry) == pytest.approx(508.5, abs=1)


@pytest.mark.parametrize("log", ["intel", "aces"])
def test_bag_and_log_hold_the_same_scans(data_dir, log):
    _, from_bag, _, _ = read(data_dir / "freiburg" / f"{log}.bag")
    _, from_log, _, _ = read(data_dir / "freiburg" / f"{log}.clf.gz")
    np.testing.assert_allclose([s.stamp for s in from_bag], [s.stamp for s in from_log], atol=1e-6, rtol=0)
    for a, b in zip(from_bag[::50], from_log[::50], strict=True):
        np.testing.assert_allclose(a.ranges, b.ranges, atol=1e-6)


OTHERS = {
    "pimap/scene4.bag": ("/scan", "", "", 1264, math.inf),
    "museum/b0-2014-07-21-12-42-53-tiny.bag": ("horizontal_laser_2d", "", "imu", 222, 60.0),
    "glass_corridor/57068e0c49.bag": ("/scan", "/odom", "", 45, math.inf),
    "ust10lx/localization_bag1_2022-03-29-19-23-29.bag": ("/scan", "/vesc/odom", "", 281, 65.533),
    "ust10lx/rosbag2_2026_03_07-23_31_14_0.db3": ("/scan", "/vesc/odom", "", 404, 65.533),
    "urg04/before1.bag": ("/scan", "/odom", "", 770, None),
    "turtlebot3/rosbag2_2026_02_02-14_33_55_0.mcap": ("/scan", "/odom", "/imu", 549, None),
    "wall/lidar_calibration_1m__0.mcap": ("/scan", "", "", 303, None),
    "sick/20210301_lms511.bag": ("/scan", "", "", 136, None),
    "tiago/scan_lidar.bag": ("/scan", "", "", 274, math.inf),
}


@pytest.mark.parametrize("name", OTHERS)
def test_other_recordings(data_dir, name):
    scan_topic, odom_topic, imu_topic, count, no_echo = OTHERS[name]
    recording, laser, odometry, imus = read(data_dir / name)
    info = recording.info
    assert (info.scan_topic, info.odom_topic, info.imu_topic) == (scan_topic, odom_topic, imu_topic)
    assert len(laser) == info.scan_count == count
    assert (bool(odometry), bool(imus)) == (bool(odom_topic), bool(imu_topic))
    assert info.no_echo == (None if no_echo is None else pytest.approx(no_echo))
    assert recording.dropped == {}


def test_turtlebot_changes_its_number_of_beams(data_dir):
    _, laser, _, _ = read(data_dir / "turtlebot3" / "rosbag2_2026_02_02-14_33_55_0.mcap")
    assert {scan.ranges.size for scan in laser} == set(range(258, 264))


def test_mounts(data_dir):
    lidar = open_recording(data_dir / "turtlebot3" / "rosbag2_2026_02_02-14_33_55_0.mcap").info
    assert lidar.base_from_laser == pytest.approx((-0.032, 0.0, 0.0), abs=1e-6)
    car = open_recording(data_dir / "ust10lx" / "rosbag2_2026_03_07-23_31_14_0.db3").info
    assert car.base_from_laser == pytest.approx((0.04, 0.0, 0.0), abs=1e-6)
