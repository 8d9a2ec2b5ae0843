"""Which points of 3D sensors are used, where their sensor looks, and how high the laser is."""

import math

import numpy as np
import pytest
from tiny_bags import odom, scan, tf, write_ros1
from tiny_sonar import cloud, cloud2, echoes, only, range_array, sonar

from glassslam.errors import UsageError
from glassslam.records import PointSet, RangeRing
from glassslam.sources import SourceOptions, open_recording
from glassslam.sources.inspection import inspect_recording
from glassslam.sources.rings import load_ring

POINTS = [[1.0, 2.0, 0.5], [2.0, 0.0, 0.4], [1.5, 0.1, 0.3]]
DRIVE = (odom(0.0), scan(0.0))


def pings(make=cloud2, topic="/points", **more):
    return [make(0.1 * k, POINTS[: 1 + k % 3], topic=topic, **more) for k in range(6)]


def ring_clouds(topic="/sonar"):
    poses = load_ring("pioneer-3dx").poses
    random = np.random.default_rng(1)
    axes = np.stack([np.cos(poses[:, 2]), np.sin(poses[:, 2])], axis=1)
    sent = []
    for k in range(30):
        ends = poses[:, :2] + random.uniform(0.4, 4.0, (16, 1)) * axes
        sent.append(cloud(0.1 * k, np.column_stack((ends, np.full(16, 0.2))), topic=topic))
    return sent


def test_points_are_told_apart_from_a_ring(ros1):
    recording = ros1(*DRIVE, *ring_clouds(), *pings())
    assert recording.info.sonar_topics == ("/sonar", "/points")
    assert recording.info.points_topics == ("/points",)
    assert len(only(recording, PointSet)) == 6
    assert len(only(recording, RangeRing)) == 30


@pytest.mark.parametrize("wish", ["/right", "right", ("/right",)])
def test_named_points_are_the_only_ones(ros1, wish):
    recording = ros1(*DRIVE, *ring_clouds(), *pings(topic="/left"), *pings(topic="/right"), points_topic=wish)
    assert recording.info.points_topics == ("/right",)
    assert recording.info.sonar_ring is not None
    assert len(only(recording, PointSet)) == 6


def test_several_sensors_may_be_named(ros1):
    sent = (*DRIVE, *pings(topic="/left"), *pings(topic="/right"), *pings(topic="/back"))
    recording = ros1(*sent, points_topic=("/left", "/back"))
    assert recording.info.points_topics == ("/left", "/back")


def test_points_can_be_switched_off_alone(ros1):
    recording = ros1(*DRIVE, *ring_clouds(), *pings(), points_topic="none")
    assert recording.info.points_topics == ()
    assert recording.info.sonar_topics == ("/sonar",)
    assert only(recording, PointSet) == []


def test_the_ring_can_be_switched_off_alone(ros1):
    recording = ros1(*DRIVE, *ring_clouds(), *pings(), sonar_topic="none", points_topic="/points")
    assert (recording.info.sonar_ring, recording.info.sonar_topics) == (None, ("/points",))


def test_without_sonar_there_are_no_points_unless_they_are_named(ros1):
    assert ros1(*DRIVE, *pings(), sonar_topic="none").info.points_topics == ()


def test_named_points_may_be_dense_and_of_equal_number(ros1):
    random = np.random.default_rng(0)
    dense = [cloud2(0.1 * k, random.uniform(-3, 3, (100, 3))) for k in range(3)]
    assert ros1(*DRIVE, *dense).info.points_topics == ()
    assert ros1(*DRIVE, *dense, points_topic="/points").info.points_topics == ("/points",)
    # what would be a ring is points where the user says so
    assert ros1(*DRIVE, *ring_clouds("/clouds"), points_topic="/clouds").info.points_topics == ("/clouds",)


@pytest.mark.parametrize("topic", ["/cloud_radar_rawtarget", "/Lidar/clusters", "/camera/depth/corners"])
def test_points_named_after_another_sensor_must_be_named(ros1, topic):
    assert ros1(*DRIVE, *pings(topic=topic)).info.sonar_topics == ()
    assert ros1(*DRIVE, *pings(topic=f"{topic}/ultrasonic")).info.points_topics == (f"{topic}/ultrasonic",)
    assert ros1(*DRIVE, *pings(topic=topic), points_topic=topic).info.points_topics == (topic,)


@pytest.mark.parametrize(
    ("wish", "words"),
    [
        ("/nothing", "points topic /nothing is not in the recording; candidates: /points"),
        ("/scan", "points topic /scan is of type sensor_msgs/msg/LaserScan; candidates: /points"),
        ("/front", "points topic /front is of type sensor_msgs/msg/Range; candidates: /points"),
    ],
)
def test_a_wrong_name_is_refused(ros1, wish, words):
    with pytest.raises(UsageError, match=words):
        ros1(*DRIVE, *pings(), sonar(0.0, 1.0, topic="/front"), points_topic=wish)


def test_a_ring_that_cannot_be_used_costs_no_points(ros1):
    unknown = [range_array(0.1 * k, [1.0, 2.0]) for k in range(5)]
    recording = ros1(*DRIVE, *unknown, *pings())
    assert recording.info.points_topics == ("/points",)
    assert recording.warnings[-1].startswith(
        "sonar is not used: /sonar_array does not tell where its sonars sit"
    )
    assert len(only(recording, PointSet)) == 6


def test_points_of_a_second_file(ros1, tmp_path):
    second = write_ros1(tmp_path / "points.bag", pings())
    recording = ros1(*DRIVE, scan(0.5), sonar=second)
    assert recording.info.points_topics == ("/points",)
    assert len(only(recording, PointSet)) == 6


@pytest.mark.parametrize(
    ("rotation", "axis"),
    [
        ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),
        ((0.0, 0.0, math.pi), (-1.0, 0.0, 0.0)),
        ((0.0, -math.pi / 2, 0.0), (0.0, 0.0, 1.0)),
    ],
)
def test_the_sensor_looks_where_its_frame_looks(ros1, rotation, axis):
    mount = tf(0.0, "base_link", "ear", (0.1, 0.0, 0.4), rotation, topic="/tf_static")
    recording = ros1(mount, *DRIVE, *pings(frame="ear"))
    np.testing.assert_allclose(only(recording, PointSet)[0].axis, axis, atol=1e-9)


@pytest.mark.parametrize("far", [1e30, 1e300])
def test_a_sensor_out_of_all_bounds_is_read_without_a_word(ros1, far):
    mount = tf(0.0, "base_link", "ear", (far, 0.0, 0.4), topic="/tf_static")
    recording = ros1(mount, *DRIVE, *pings(frame="ear"), *ring_clouds())
    found = only(recording, PointSet)
    assert [len(record.points) for record in found] == [1, 2, 3, 1, 2, 3]
    assert found[0].origin[0] == far


def test_echoes_that_are_not_finite_are_left_out_without_a_word(ros1):
    odd = [[math.inf, 0.0, 0.0], [1.0, 0.0, 0.5], [0.0, -math.inf, math.nan]]
    recording = ros1(*DRIVE, cloud2(0.1, odd), cloud2(0.2, odd[:2]))
    assert [record.points.tolist() for record in only(recording, PointSet)] == [[[1.0, 0.0, 0.5]]] * 2


def test_without_a_transform_the_sensor_looks_ahead(ros1):
    recording = ros1(*DRIVE, *pings(echoes, "/ts_scans"))
    assert {record.axis for record in only(recording, PointSet)} == {(1.0, 0.0, 0.0)}


def test_the_height_of_the_laser_is_that_of_its_transform(any_bag):
    mount = tf(0.0, "base_link", "laser", (0.2, 0.0, 0.31), topic="/tf_static")
    assert any_bag(mount, *DRIVE).info.laser_height == pytest.approx(0.31)


def test_the_height_is_known_even_where_the_user_says_the_pose(ros1):
    mount = tf(0.0, "base_link", "laser", (0.2, 0.0, 0.31), topic="/tf_static")
    info = ros1(mount, *DRIVE, laser_pose=(0.5, 0.0, 0.0)).info
    assert (info.base_from_laser, info.laser_height) == ((0.5, 0.0, 0.0), pytest.approx(0.31))


def test_without_a_transform_the_height_is_not_known(ros1):
    assert ros1(*DRIVE).info.laser_height is None
    # scans in the frame of the base say nothing of a mount
    assert ros1(odom(0.0), scan(0.0, frame="base_link")).info.laser_height is None
    assert ros1(scan(0.0)).info.laser_height is None


def test_inspection_tells_the_points_and_the_height(tmp_path):
    mount = tf(0.0, "base_link", "laser", (0.2, 0.0, 0.31), topic="/tf_static")
    path = write_ros1(tmp_path / "run.bag", [mount, *DRIVE, *ring_clouds(), *pings()])
    report = inspect_recording(path)
    ring, points = report.sonars
    assert (ring.topics, ring.sonars, ring.stamps.count) == (("/sonar",), 16, 30)
    assert (points.topics, points.sonars, points.stamps.count) == (("/points",), 0, 6)
    assert points.points_per_message == 2.0
    assert (report.plan.points_topics, report.plan.laser_height) == (("/points",), pytest.approx(0.31))
    without = inspect_recording(path, SourceOptions(points_topic="none"))
    assert [found.topics for found in without.sonars] == [("/sonar",)]
    assert without.plan.points_topics == ()


FLASER = "FLASER 3 1.0 1.0 1.0 0 0 0 0 0 0 {0}.0 host {0}.0\n"
LASER = (
    "{0:014.3f} 16777343 6665 laser 00 001 001 0007 -01.5708 +01.5708 +1.57079633 +08.0000 0003"
    " 1.000  3 2.000  3 3.000  3\n"
)


@pytest.mark.parametrize(
    ("head", "line", "words"),
    [
        ("", FLASER, "a CARMEN log holds no 3D points"),
        ("## Player version 2.1.1\n## File version 0.3.0\n", LASER, "a Player log holds no 3D points"),
    ],
)
def test_logs_without_points_say_so(tmp_path, head, line, words):
    path = tmp_path / "run.log"
    path.write_text(head + "".join(line.format(k) for k in range(1, 5)), encoding="utf-8")
    assert open_recording(path).info.points_topics == ()
    with pytest.raises(UsageError, match=words) as error:
        open_recording(path, SourceOptions(points_topic="/points"))
    assert error.value.hint == "leave out --points-topic"


def test_a_text_log_beside_a_recording_has_no_topics(ros1, data_dir):
    text = data_dir / "pimap" / "scene4_sonar.txt"
    if not text.is_file():
        pytest.skip(f"{text} is absent")
    with pytest.raises(UsageError, match="has no topics") as error:
        ros1(*DRIVE, sonar=text, points_topic="/points")
    assert error.value.hint == "leave out --points-topic"
