"""The same little drive comes out of every bag format."""

import numpy as np
import pytest
from tiny_bags import T0, imu, lone_file, odom, scan, tf, write_ros1, write_ros2

from glassslam.records import Imu, LaserScan, Odometry
from glassslam.sources import SourceOptions, open_recording

DRIVE = [
    tf(0.0, "base_link", "laser", (0.2, 0.0, 0.3), (0.0, 0.0, 0.5), topic="/tf_static"),
    odom(0.0, 1.0, 2.0, 0.25),
    imu(0.05, (0.0, 0.0, 0.125)),
    scan(0.1, [1.0, np.inf, 3.5], intensities=[10, 0, 30]),
    odom(0.2, 1.5, 2.0, 0.5),
    scan(0.3, [1.25, 2.0]),
]


def ros1(compression):
    return lambda folder: write_ros1(folder / "run.bag", DRIVE, compression)


def ros2(storage, packing="none"):
    return lambda folder: write_ros2(folder / "run", DRIVE, storage, packing)


def alone(storage):
    return lambda folder: lone_file(write_ros2(folder / "run", DRIVE, storage))


FORMATS = {
    "ROS1 plain": (ros1("none"), "rosbag1"),
    "ROS1 bz2": (ros1("bz2"), "rosbag1"),
    "ROS1 lz4": (ros1("lz4"), "rosbag1"),
    "sqlite3 directory": (ros2("sqlite3"), "rosbag2-sqlite3"),
    "sqlite3 file": (alone("sqlite3"), "rosbag2-sqlite3"),
    "mcap directory": (ros2("mcap"), "rosbag2-mcap"),
    "mcap file": (alone("mcap"), "rosbag2-mcap"),
    "sqlite3 with zstd messages": (ros2("sqlite3", "message"), "rosbag2-sqlite3"),
    "sqlite3 with zstd file": (ros2("sqlite3", "file"), "rosbag2-sqlite3"),
}


@pytest.fixture(params=FORMATS, scope="module")
def recording(request, tmp_path_factory):
    write, name = FORMATS[request.param]
    opened = open_recording([write(tmp_path_factory.mktemp("bags"))])
    assert opened.info.format == name
    return opened


def test_info(recording):
    info = recording.info
    assert (info.scan_topic, info.odom_topic, info.imu_topic) == ("/scan", "/odom", "/imu")
    assert info.scan_count == 2
    assert info.duration == pytest.approx(0.3)
    assert info.base_from_laser == pytest.approx((0.2, 0.0, 0.5))
    assert info.no_echo == np.inf
    assert recording.warnings == []


def test_records_in_order(recording):
    records = list(recording.records())
    assert [type(record) for record in records] == [Odometry, Imu, LaserScan, Odometry, LaserScan]
    assert [record.stamp - T0 for record in records] == pytest.approx([0.0, 0.05, 0.1, 0.2, 0.3], abs=1e-6)
    assert [record.record_stamp for record in records] == [record.stamp for record in records]
    assert recording.dropped == {}


def test_values(recording):
    odometry, imu_record, first, _, second = recording.records()
    assert odometry.pose == pytest.approx((1.0, 2.0, 0.25))
    assert imu_record.yaw_rate == 0.125
    np.testing.assert_array_equal(first.ranges, np.float32([1.0, np.inf, 3.5]))
    np.testing.assert_array_equal(first.intensities, np.float32([10, 0, 30]))
    assert (first.angle_min, first.angle_increment) == (-0.5, 0.5)
    assert (first.range_max, first.frame_id) == (30.0, "laser")
    assert first.range_min == pytest.approx(0.1)
    assert first.ranges.dtype == first.intensities.dtype == np.float32
    assert (second.ranges.size, second.intensities.size) == (2, 0)


def test_can_be_read_again(recording):
    assert len(list(recording.records())) == len(list(recording.records())) == 5


def test_format_is_told_by_content_not_by_name(tmp_path):
    file = lone_file(write_ros2(tmp_path / "run", DRIVE, "mcap")).rename(tmp_path / "run.data")
    assert open_recording(file).info.format == "rosbag2-mcap"


def test_names_with_characters_of_a_uri(tmp_path):
    file = lone_file(write_ros2(tmp_path / "run", DRIVE, "sqlite3")).rename(tmp_path / "a#b %41?.db3")
    assert len(list(open_recording(file).records())) == 5


def test_directory_without_metadata_is_read_in_natural_order(tmp_path):
    folder = tmp_path / "split"
    folder.mkdir()
    for number, at in ((10, 2.0), (9, 1.0)):
        lone_file(write_ros2(tmp_path / f"part{number}", [scan(at)])).rename(folder / f"run_{number}.db3")
    stamps = [record.stamp - T0 for record in open_recording(folder).records()]
    assert stamps == [1.0, 2.0]


def test_pieces_follow_each_other(tmp_path):
    first = write_ros1(tmp_path / "a.bag", [odom(0.0), scan(0.1)])
    second = write_ros1(tmp_path / "b.bag", [odom(1.0), scan(1.1)])
    recording = open_recording([first, second])
    assert [record.stamp - T0 for record in recording.records()] == pytest.approx([0, 0.1, 1, 1.1], abs=1e-6)
    assert recording.info.paths == (str(first), str(second))
    assert recording.info.duration == pytest.approx(1.1)
    swapped = open_recording([second, first])
    assert swapped.warnings[0] == f"{first} begins before {second} ends: pieces are read as ordered"


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (SourceOptions(start=0.15), [0.2, 0.3]),
        (SourceOptions(duration=0.15), [0.0, 0.05, 0.1]),
        (SourceOptions(start=0.05, duration=0.2), [0.05, 0.1, 0.2]),
        (SourceOptions(every=2), [0.0, 0.05, 0.1, 0.2]),
        (SourceOptions(odom_topic="none", imu_topic="none"), [0.1, 0.3]),
    ],
)
def test_part_of_a_recording(tmp_path, options, expected):
    recording = open_recording(write_ros1(tmp_path / "run.bag", DRIVE), options)
    assert [record.stamp - T0 for record in recording.records()] == pytest.approx(expected, abs=1e-6)


def test_scan_count_shrinks_with_the_part(tmp_path):
    path = write_ros1(tmp_path / "run.bag", [scan(k / 10) for k in range(101)])
    assert open_recording(path, SourceOptions(every=4)).info.scan_count == 26
    half = open_recording(path, SourceOptions(start=5.0)).info
    assert half.scan_count == pytest.approx(51, abs=1)
    assert half.duration == pytest.approx(5.0)
