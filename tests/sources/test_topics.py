"""Topics are picked when there is one choice, otherwise the user is asked."""

import pytest
from tiny_bags import imu, odom, scan, tf, write_ros1

from glassslam.errors import NoScansError, UsageError
from glassslam.sources import SourceOptions, open_recording


@pytest.fixture
def bag(tmp_path):
    def make(*messages, **options):
        return open_recording(write_ros1(tmp_path / "run.bag", messages), SourceOptions(**options))

    return make


TWO_LASERS = [scan(k / 10, topic=topic) for k in range(11) for topic in ("/front", "/rear")]
TWO_ODOMETRIES = [scan(0.0), odom(0.0), odom(0.5, topic="/wheel"), odom(1.0, topic="/wheel")]


def test_two_scan_topics_ask(bag):
    with pytest.raises(UsageError) as caught:
        bag(*TWO_LASERS)
    assert caught.value.exit_code == 2
    assert caught.value.message == (
        "several scan topics: /front (sensor_msgs/msg/LaserScan, 11 messages, 11.0 Hz),"
        " /rear (sensor_msgs/msg/LaserScan, 11 messages, 11.0 Hz)"
    )
    assert caught.value.hint == "choose one with --scan-topic"


@pytest.mark.parametrize("name", ["/rear", "rear"])
def test_a_named_topic_is_used_with_or_without_slash(bag, name):
    recording = bag(*TWO_LASERS, scan_topic=name)
    assert recording.info.scan_topic == "/rear"
    assert len(list(recording.records())) == 11


def test_two_odometries_ask(bag):
    with pytest.raises(UsageError, match=r"several odom topics: /odom .*1 messages.*, /wheel .*2 messages"):
        bag(*TWO_ODOMETRIES)


def test_a_named_odometry_is_used(tmp_path):
    path = write_ros1(tmp_path / "run.bag", TWO_ODOMETRIES)
    assert open_recording(path, SourceOptions(odom_topic="wheel")).info.odom_topic == "/wheel"


def test_two_imus_ask(bag):
    with pytest.raises(UsageError, match=r"several imu topics: /imu .*, /raw ") as caught:
        bag(scan(0.0), imu(0.0, (0, 0, 1.0)), imu(0.0, (0, 0, 1.0), topic="/raw"))
    assert caught.value.hint == "choose one with --imu-topic"


def test_a_missing_topic_names_the_candidates(bag):
    with pytest.raises(UsageError, match=r"scan topic /lidar is not in the recording; candidates: /scan \("):
        bag(scan(0.0), scan_topic="/lidar")


def test_a_topic_of_another_type_names_the_candidates(bag):
    with pytest.raises(
        UsageError, match=r"scan topic /odom is of type nav_msgs/msg/Odometry; candidates: /scan \("
    ):
        bag(scan(0.0), odom(0.0), scan_topic="/odom")


def test_a_missing_odometry_without_candidates(bag):
    with pytest.raises(UsageError, match="odom topic /odom is not in the recording; candidates: none"):
        bag(scan(0.0), odom_topic="/odom")


def test_no_scan_topic_lists_what_there_is(bag):
    with pytest.raises(NoScansError, match="no laser scan in ") as caught:
        bag(odom(0.0), odom(1.0))
    assert caught.value.exit_code == 1
    assert caught.value.hint == "recorded: /odom (nav_msgs/msg/Odometry, 2 messages, 2.0 Hz)"


def test_a_topic_is_preferred_to_tf(bag):
    drive = [tf(k / 10, "odom", "base_link", (k, 0, 0)) for k in range(3)]
    assert bag(scan(0.0), odom(0.0), *drive).info.odom_topic == "/odom"


def test_tf_by_name(bag):
    drive = [tf(k / 10, "odom", "base_link", (k, 0, 0)) for k in range(3)]
    assert bag(scan(0.0), odom(0.0), *drive, odom_topic="tf").info.odom_topic == "tf:odom->base_link"


def test_any_transform_by_name(bag):
    drive = [tf(k / 10, "map", "base_link", (k, 0, 0)) for k in range(3)]
    recording = bag(scan(0.0), *drive, odom_topic="tf:map->base_link")
    assert recording.info.odom_topic == "tf:map->base_link"
    assert len(list(recording.records())) == 4


def test_a_map_frame_is_no_odometry_of_itself(bag):
    assert bag(scan(0.0), tf(0.0, "map", "base_link")).info.odom_topic == ""


def test_two_odometry_frames_ask(bag):
    with pytest.raises(UsageError) as caught:
        bag(scan(0.0), tf(0.0, "odom", "base_link"), tf(0.1, "robot/visual_odom", "camera"))
    assert caught.value.message == (
        "several transforms may be odometry: tf:odom->base_link (/tf, tf),"
        " tf:robot/visual_odom->camera (/tf, tf)"
    )


def test_a_missing_transform_names_the_candidates(bag):
    with pytest.raises(UsageError, match=r"no transform a->b for odometry; candidates: tf:map->base_link"):
        bag(scan(0.0), tf(0.0, "map", "base_link"), odom_topic="tf:a->b")


def test_no_odometry_frame(bag):
    with pytest.raises(
        UsageError, match=r"no transform from an odometry frame; candidates: tf:map->base_link"
    ):
        bag(scan(0.0), tf(0.0, "map", "base_link"), odom_topic="tf")


def test_odometry_switched_off(bag):
    recording = bag(scan(0.0), odom(0.0), tf(0.0, "odom", "base_link"), odom_topic="none")
    assert recording.info.odom_topic == ""
    assert len(list(recording.records())) == 1


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"start": -1.0}, "^--start must be a time of 0 s or more, not -1"),
        ({"start": float("nan")}, "start must be a time of 0 s or more, not nan"),
        ({"duration": 0.0}, "^--duration must be a time above 0 s, not 0"),
        ({"every": 0}, "^--every must be 1 or more, not 0"),
        ({"echo": "best"}, "^--echo: unknown echo 'best'"),
        ({"laser_pose": (1.0, float("inf"), 0.0)}, "laser pose must be three finite numbers"),
        ({"scan_topic": "none"}, "a map needs scans: the scan topic cannot be 'none'"),
    ],
)
def test_options_out_of_their_domain(options, message):
    with pytest.raises(UsageError, match=message):
        SourceOptions(**options)
