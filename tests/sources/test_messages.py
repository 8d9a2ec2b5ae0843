"""How messages become records, and which are refused."""

import math

import numpy as np
import pytest
from tiny_bags import OLD_TF, T0, imu, odom, scan, tf, write_ros1

from glassslam.records import Imu, LaserScan, Odometry
from glassslam.sources import SourceOptions, open_recording

UPSIDE_DOWN = (math.pi, 0.0, 0.0)


@pytest.fixture
def bag(tmp_path):
    """Opens a ROS1 bag with these messages."""

    def make(*messages, **options):
        return open_recording(write_ros1(tmp_path / "run.bag", messages), SourceOptions(**options))

    return make


def only(recording, kind):
    return [record for record in recording.records() if isinstance(record, kind)]


@pytest.mark.parametrize(
    ("fields", "ranges", "reason"),
    [
        ({}, [], "scan without beams"),
        ({"angle_increment": 0.0}, [1.0, 2.0], "scan with a zero or non-finite angle increment"),
        ({"angle_increment": math.nan}, [1.0, 2.0], "scan with a zero or non-finite angle increment"),
        ({"angle_min": math.inf}, [1.0, 2.0], "scan with a zero or non-finite angle increment"),
    ],
)
def test_unusable_scans_are_counted(bag, fields, ranges, reason):
    recording = bag(scan(0.0), scan(0.1, ranges, **fields), scan(0.2))
    assert len(only(recording, LaserScan)) == 2
    assert recording.dropped == {reason: 1}


def test_counts_start_anew_with_each_reading(bag):
    recording = bag(scan(0.0), scan(0.1, []))
    for _ in range(2):
        only(recording, LaserScan)
        assert recording.dropped == {"scan without beams": 1}


def test_strange_ranges_pass(bag):
    ranges = np.float32([math.nan, math.inf, -math.inf, 0.0, -1.0, 99.0])
    (record,) = only(bag(scan(0.0, ranges)), LaserScan)
    np.testing.assert_array_equal(record.ranges, ranges)


def test_signalling_nans_become_quiet(bag):
    ranges = np.full(4, 2.0, dtype=np.float32)
    ranges.view(np.uint32)[1] = 0x7FA00000
    (found,) = only(bag(scan(0.0, ranges)), LaserScan)
    assert np.isnan(found.ranges[1])
    # without a warning, which the suite takes for an error
    assert found.ranges.astype(np.float64)[[0, 2, 3]].tolist() == [2.0, 2.0, 2.0]


def test_flipped_increment_passes(bag):
    (record,) = only(bag(scan(0.0, angle_min=0.5, angle_increment=-0.5)), LaserScan)
    assert (record.angle_min, record.angle_increment) == (0.5, -0.5)


def test_beam_counts_may_change(bag):
    sizes = [
        record.ranges.size for record in only(bag(scan(0.0, [1.0] * 5), scan(0.1, [1.0] * 7)), LaserScan)
    ]
    assert sizes == [5, 7]


def test_backward_and_equal_stamps_pass(bag):
    stamps = [T0 + 1.0, T0 + 0.5, T0 + 0.5]
    recording = bag(*(scan(k / 10, stamp=stamp) for k, stamp in enumerate(stamps)))
    assert [record.stamp for record in only(recording, LaserScan)] == stamps


def test_an_empty_stamp_is_replaced_by_the_record_time(bag):
    (record,) = only(bag(scan(0.5, stamp=0.0)), LaserScan)
    assert record.stamp == record.record_stamp == T0 + 0.5


def test_intensities_of_wrong_length_are_ignored_with_a_warning(bag):
    recording = bag(scan(0.0, intensities=[1.0]), scan(0.1, intensities=[1.0, 2.0]))
    assert [record.intensities.size for record in only(recording, LaserScan)] == [0, 0]
    assert recording.warnings == ["intensities that do not belong to the beams one by one are ignored"]


@pytest.mark.parametrize(
    ("announced", "expected"), [(5.0, 5.0), (math.inf, math.inf), (0.0, math.inf), (math.nan, math.inf)]
)
def test_range_max_without_a_no_echo_value(bag, announced, expected):
    (record,) = only(bag(scan(0.0, range_max=announced)), LaserScan)
    assert record.range_max == expected


@pytest.mark.parametrize("announced", [math.nan, -1.0, math.inf])
def test_senseless_limits_become_harmless(bag, announced):
    (record,) = only(bag(scan(0.0, range_min=announced, time_increment=math.nan)), LaserScan)
    assert (record.range_min, record.time_increment) == (0.0, 0.0)


@pytest.mark.parametrize(("announced", "expected"), [(100.0, 50.0), (30.0, 30.0), (math.inf, 50.0)])
def test_range_max_does_not_exceed_the_no_echo_value(bag, announced, expected):
    silent = [50.0, 1.0, 50.0, 2.0, 50.0]
    recording = bag(*(scan(k / 10, silent, range_max=announced) for k in range(80)))
    assert recording.info.no_echo == 50.0
    assert {record.range_max for record in only(recording, LaserScan)} == {expected}


def test_odometry_without_orientation_is_dropped(bag):
    recording = bag(scan(0.0), odom(0.1), odom(0.2, upright=False), odom(0.3, math.nan))
    assert len(only(recording, Odometry)) == 1
    assert recording.dropped == {"odometry that is not finite or has no orientation": 2}


def test_mount_from_tf(bag):
    recording = bag(
        tf(0.0, "/base_link", "/plate", (0.25, 0.5, 0.1), (0.0, 0.0, math.pi / 2), topic="/tf_static"),
        tf(0.0, "plate", "laser", (1.0, 0.0, 0.0), topic="/tf_static"),
        odom(0.0, child="/base_link"),
        scan(0.0, frame="/laser"),
    )
    assert recording.info.base_from_laser == pytest.approx((0.25, 1.5, math.pi / 2))


def test_mount_published_again_and_again_on_tf(bag):
    moving = [tf(k / 10, "odom", "base_link", (k / 10, 0, 0), msgtype=OLD_TF) for k in range(5)]
    mount = [tf(k / 10, "base_link", "laser", (0.5, 0, 0), topic="/tf", msgtype=OLD_TF) for k in range(5)]
    recording = bag(*(m for pair in zip(moving, mount, strict=True) for m in pair), scan(0.6))
    assert recording.info.base_from_laser == pytest.approx((0.5, 0.0, 0.0))
    assert recording.warnings == []


def test_upside_down_laser_is_mirrored_without_losing_the_order_of_beams(bag):
    recording = bag(
        tf(0.0, "base_link", "laser", (0.1, 0.0, 0.2), UPSIDE_DOWN, topic="/tf_static"),
        odom(0.0),
        scan(0.0, [1.0, 2.0, 3.0], angle_min=-0.5, angle_increment=0.25, time_increment=0.01),
    )
    (record,) = only(recording, LaserScan)
    assert (record.angle_min, record.angle_increment, record.time_increment) == pytest.approx(
        (0.5, -0.25, 0.01)
    )
    assert record.ranges.tolist() == [1.0, 2.0, 3.0]
    assert recording.info.base_from_laser == pytest.approx((0.1, 0.0, 0.0))


@pytest.mark.parametrize(
    "rotation", [(math.pi, 0.0, 0.7), (0.0, math.pi, 0.3), (math.pi, 0.0, 0.0), (0, 0, 1.0)]
)
def test_mirrored_beams_point_where_the_full_transform_says(bag, rotation):
    recording = bag(
        tf(0.0, "base_link", "laser", (0.0, 0.0, 0.0), rotation, topic="/tf_static"),
        odom(0.0),
        scan(0.0, angle_min=0.3),
    )
    (record,) = only(recording, LaserScan)
    roll, pitch, yaw = rotation
    direction = np.array([math.cos(0.3), math.sin(0.3), 0.0])
    rx = np.array([[1, 0, 0], [0, math.cos(roll), -math.sin(roll)], [0, math.sin(roll), math.cos(roll)]])
    ry = np.array([[math.cos(pitch), 0, math.sin(pitch)], [0, 1, 0], [-math.sin(pitch), 0, math.cos(pitch)]])
    rz = np.array([[math.cos(yaw), -math.sin(yaw), 0], [math.sin(yaw), math.cos(yaw), 0], [0, 0, 1]])
    expected = rz @ ry @ rx @ direction
    angle = recording.info.base_from_laser[2] + record.angle_min
    assert (math.cos(angle), math.sin(angle)) == pytest.approx(tuple(expected[:2]), abs=1e-6)


def test_tilted_laser_is_noted(bag):
    mount = tf(0.0, "base_link", "laser", rotation=(0.0, math.radians(30), 0.0), topic="/tf_static")
    assert bag(mount, odom(0.0), scan(0.0)).warnings == ["the laser is tilted by 30 deg: ranges are slant"]


def test_unknown_mount_is_noted(bag):
    (warning,) = bag(odom(0.0), scan(0.0)).warnings
    assert warning.startswith("no transform from base_link to laser: the laser is taken to sit at the base")


def test_named_laser_pose_wins(bag):
    mount = tf(0.0, "base_link", "laser", (9.0, 9.0, 0.0), topic="/tf_static")
    recording = bag(mount, odom(0.0), scan(0.0), laser_pose=(0.1, 0.2, 0.3))
    assert recording.info.base_from_laser == (0.1, 0.2, 0.3)


def test_odometry_of_the_laser_itself_needs_no_mount(bag):
    recording = bag(odom(0.0, child="laser"), scan(0.0))
    assert recording.info.base_from_laser == (0.0, 0.0, 0.0)
    assert recording.warnings == []


def test_without_odometry_the_base_has_a_customary_name(bag):
    mount = tf(0.0, "base_link", "laser", (0.5, 0.0, 0.0), topic="/tf_static")
    assert bag(mount, scan(0.0)).info.base_from_laser == pytest.approx((0.5, 0.0, 0.0))


def test_odometry_from_tf(bag):
    drive = [tf(k / 10, "/odom", "/base_link", (k * 1.0, 0, 0), (0, 0, k / 10)) for k in range(3)]
    recording = bag(*drive, scan(0.15))
    assert recording.info.odom_topic == "tf:odom->base_link"
    assert [record.pose for record in only(recording, Odometry)] == [
        pytest.approx((k * 1.0, 0.0, k / 10)) for k in range(3)
    ]


def test_yaw_rate_is_that_of_the_base(bag):
    hanging = tf(0.0, "base_link", "imu", rotation=UPSIDE_DOWN, topic="/tf_static")
    records = only(bag(hanging, odom(0.0), scan(0.0), imu(0.0, (0.5, 0.25, 1.0))), Imu)
    assert [record.yaw_rate for record in records] == pytest.approx([-1.0])


def test_imu_without_gyroscope_is_dropped(bag):
    recording = bag(scan(0.0), imu(0.0, (0, 0, 1.0)), imu(0.1, (0, 0, 1.0), without_gyroscope=True))
    assert len(only(recording, Imu)) == 1
    assert recording.dropped == {"imu without a finite angular velocity": 1}


def test_imu_that_is_always_zero_is_not_used(bag):
    recording = bag(scan(0.0), *(imu(k / 10, (0.0, 0.0, 0.0)) for k in range(5)))
    assert recording.info.imu_topic == ""
    assert recording.warnings == ["/imu is not used: its angular velocity is always zero"]
    assert only(recording, Imu) == []
