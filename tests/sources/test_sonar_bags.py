"""Sonars in bags: single ranges, clouds, plain numbers, 3D points."""

import math

import numpy as np
import pytest
from tiny_bags import T0, odom, scan, tf
from tiny_sonar import echoes, only, range_array, ranges_of, sonar

from glassslam.errors import UsageError
from glassslam.records import LaserScan, Odometry, PointSet, RangeRing

LEFT = tf(0.0, "base_link", "sonar_2", (0.1, 0.2, 0.3), (0.0, 0.0, math.pi / 2), topic="/tf_static")
RIGHT = tf(0.0, "base_link", "sonar_10", (0.1, -0.2, 0.3), (0.0, 0.0, -math.pi / 2), topic="/tf_static")
RNG = np.random.default_rng(3)
NAN = math.nan


def test_ranges_in_frames_of_their_own(any_bag):
    recording = any_bag(
        LEFT,
        RIGHT,
        odom(0.0),
        scan(0.0),
        sonar(0.1, 1.5, topic="/b", frame="/sonar_2"),
        sonar(0.2, 2.5, topic="/a", frame="sonar_10"),
        sonar(0.3, 5.0, topic="/b", frame="sonar_2"),
        sonar(0.4, 0.01, topic="/a", frame="sonar_10"),
    )
    ring = recording.info.sonar_ring
    np.testing.assert_allclose(ring.poses, [[0.1, 0.2, math.pi / 2], [0.1, -0.2, -math.pi / 2]], atol=1e-9)
    assert (ring.field_of_view, ring.range_min, ring.range_max, ring.name) == (
        0.5,
        pytest.approx(0.1),
        5.0,
        "",
    )
    assert recording.info.sonar_topics == ("/b", "/a")
    np.testing.assert_array_equal(ranges_of(recording), [[1.5, NAN], [NAN, 2.5], [math.inf, NAN], [NAN, NAN]])
    first = only(recording, RangeRing)[0]
    assert first.stamp == first.record_stamp == pytest.approx(T0 + 0.1)
    assert recording.dropped == {}


def test_ranges_of_one_stamp_are_one_sweep(ros1):
    at = T0 + 0.5
    recording = ros1(
        LEFT,
        RIGHT,
        odom(0.0),
        sonar(0.10, 1.0, frame="sonar_2", stamp=at),
        sonar(0.11, 2.0, frame="sonar_10", stamp=at),
        scan(0.12),
        sonar(0.13, 3.0, frame="sonar_2", stamp=at + 1),
        sonar(0.14, 3.5, frame="sonar_2", stamp=at + 1.5),
        sonar(0.15, 4.0, frame="sonar_10", stamp=at + 1.5),
    )
    assert [type(r) for r in recording.records()] == [Odometry, RangeRing, LaserScan, RangeRing, RangeRing]
    np.testing.assert_array_equal(ranges_of(recording), [[1.0, 2.0], [3.0, NAN], [3.5, 4.0]])


def test_scans_and_odometry_come_as_without_sonar(any_bag):
    rest = [message for k in range(20) for message in (odom(k / 10), scan(k / 10 + 0.03))]
    ranges = [sonar(k / 7, 1.0 + k / 10, frame="sonar_2") for k in range(14)]
    everything = sorted([*rest, *ranges], key=lambda sent: sent.at)
    recording = any_bag(LEFT, *everything)
    scans = only(recording, LaserScan)
    assert [type(r) for r in recording.records() if not isinstance(r, RangeRing)] == [
        Odometry,
        LaserScan,
    ] * 20
    assert [s.record_stamp for s in scans] == pytest.approx([T0 + k / 10 + 0.03 for k in range(20)])
    times = [record.record_stamp for record in recording.records()]
    assert times == sorted(times)
    assert len(ranges_of(recording)) == 14


def test_infrared_is_no_sonar(ros1):
    messages = [LEFT, RIGHT, odom(0.0), scan(0.0), sonar(0.1, 1.0, frame="sonar_2")]
    cliff = sonar(0.2, 0.2, topic="/cliff", frame="sonar_10", radiation=1)
    assert len(ros1(*messages, cliff).info.sonar_ring.poses) == 1
    assert len(ros1(*messages, cliff, sonar_topic=("/sonar", "cliff")).info.sonar_ring.poses) == 2


def test_a_described_ring_takes_frames_in_their_natural_order(ros1):
    frames = [f"s{k}" for k in range(9)]
    messages = [
        sonar(0.1 + k / 100, 1.0 + k, frame=frames[k], limits=(0.1, 20.0))
        for k in (3, 8, 0, 1, 2, 4, 5, 6, 7)
    ]
    recording = ros1(odom(0.0), scan(0.0), *messages, sonar_ring="turtlebot-9")
    assert recording.info.sonar_ring.name == "turtlebot-9"
    readings = ranges_of(recording)
    assert [int(np.flatnonzero(~np.isnan(row))[0]) for row in readings[:3]] == [3, 8, 0]
    np.testing.assert_array_equal(readings[0, 3], math.inf)  # 4 m, of a ring that is cut at 3 m


def test_sonar_without_a_place_is_not_used_and_says_so(ros1):
    recording = ros1(odom(0.0), scan(0.0), sonar(0.1, 1.0))
    assert recording.info.sonar_ring is None
    assert recording.info.sonar_topics == ()
    assert only(recording, RangeRing) == []
    assert recording.warnings[-1] == (
        "sonar is not used: no transform from base_link to the sonars sonar_0"
        " (--sonar-ring NAME or FILE says where the sonars sit)"
    )


def test_named_sonar_without_a_place_is_an_error(ros1):
    with pytest.raises(UsageError, match="no transform from base_link to the sonars sonar_0") as caught:
        ros1(odom(0.0), scan(0.0), sonar(0.1, 1.0), sonar_topic="/sonar")
    assert caught.value.hint == "--sonar-ring NAME or FILE says where the sonars sit"
    assert caught.value.exit_code == 2


def test_sonar_switched_off(ros1):
    recording = ros1(LEFT, odom(0.0), scan(0.0), sonar(0.1, 1.0, frame="sonar_2"), sonar_topic="none")
    assert (recording.info.sonar_ring, recording.info.sonar_topics) == (None, ())
    assert not any("sonar" in warning for warning in recording.warnings)
    assert only(recording, RangeRing) == []


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"sonar_topic": "/echo"},
            r"sonar topic /echo is not in the recording; candidates: /sonar \(sensor_msgs/msg/Range, 1",
        ),
        (
            {"sonar_topic": "/scan"},
            "sonar topic /scan is of type sensor_msgs/msg/LaserScan; candidates: /sonar",
        ),
        ({"sonar_ring": "pioneer-3dx"}, "the ring pioneer-3dx has 16 sonars, the recording 1"),
        ({"sonar_ring": "pioneer"}, "unknown sonar ring 'pioneer'"),
    ],
)
def test_wishes_that_do_not_fit(ros1, options, message):
    with pytest.raises(UsageError, match=message):
        ros1(LEFT, odom(0.0), scan(0.0), sonar(0.1, 1.0, frame="sonar_2"), **options)


def test_a_ring_for_a_recording_without_sonar(ros1):
    with pytest.raises(UsageError, match="a sonar ring was named, but there is no sonar in the recording"):
        ros1(odom(0.0), scan(0.0), sonar_ring="pioneer-3dx")


def test_a_sonar_that_turns_up_late_is_counted(ros1):
    known = [sonar(0.1 + k / 1000, 1.0 + k / 1000, frame="sonar_2") for k in range(900)]
    late = sonar(0.9999, 1.0, frame="sonar_10")
    recording = ros1(LEFT, RIGHT, odom(0.0), scan(0.0), *known, late, scan(9.0))
    assert len(ranges_of(recording)) == 900
    assert recording.dropped == {"range of a sonar that is not in the ring": 1}


def test_plain_numbers_need_a_ring(any_bag):
    rows = RNG.uniform(0.3, 2.9, (30, 9)).astype(np.float32)
    messages = [odom(0.0), scan(0.0), *(range_array(k / 10, row) for k, row in enumerate(rows))]
    recording = any_bag(*messages, sonar_ring="turtlebot-9")
    np.testing.assert_array_equal(ranges_of(recording), rows)
    assert only(recording, RangeRing)[2].stamp == pytest.approx(T0 + 0.2)


def test_plain_numbers_without_a_ring(ros1):
    messages = [odom(0.0), scan(0.0), range_array(0.1, [1.0, 2.0])]
    (warning,) = ros1(*messages).warnings[1:]
    assert warning.startswith(
        "sonar is not used: /sonar_array does not tell where its sonars sit (--sonar-ring"
    )
    with pytest.raises(UsageError, match="the ring turtlebot-9 has 9 sonars, /sonar_array sends 2 ranges"):
        ros1(*messages, sonar_ring="turtlebot-9")


def test_plain_numbers_of_another_meaning_are_left_alone(ros1):
    recording = ros1(odom(0.0), scan(0.0), range_array(0.1, [1.0, 2.0], topic="/wheels"))
    assert (recording.info.sonar_topics, recording.warnings[1:]) == ((), [])


def test_a_driver_that_repeats_itself(ros1):
    """Sweeps at 20 Hz of a ring that fires at 5 Hz."""
    ranges = RNG.uniform(0.5, 2.9, (40, 9)).astype(np.float32)
    messages = [range_array(k / 20, ranges[k // 4]) for k in range(160)]
    readings = ranges_of(ros1(odom(0.0), scan(0.0), *messages, sonar_ring="turtlebot-9"))
    new = ~np.isnan(readings).all(axis=1)
    assert np.flatnonzero(new).tolist() == list(range(0, 160, 4))
    np.testing.assert_array_equal(readings[new], ranges)


def test_a_ring_and_a_3d_sensor_at_once(ros1):
    recording = ros1(
        LEFT, odom(0.0), scan(0.0), sonar(0.1, 1.0, frame="sonar_2"), echoes(0.2, [[1.0, 0.0, 0.0]])
    )
    assert recording.info.sonar_topics == ("/sonar", "/ts_scans")
    assert [type(r) for r in recording.records()][2:] == [RangeRing, PointSet]


def test_a_part_of_the_recording(ros1):
    messages = [
        message for k in range(20) for message in (scan(k / 10), sonar(k / 10, 1 + k / 10, frame="sonar_2"))
    ]
    recording = ros1(LEFT, odom(0.0), *messages, start=0.5, duration=0.5)
    assert np.nanmin(ranges_of(recording)) == pytest.approx(1.5)
    assert len(ranges_of(recording)) == len(only(recording, LaserScan)) == 5
