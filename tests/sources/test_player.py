"""Logs of the Player robot server: lasers, odometry and sonars of all versions."""

import gzip
import math

import numpy as np
import pytest

from glassslam.errors import NoScansError, RecordingError, UsageError
from glassslam.records import LaserScan, Odometry, RangeRing
from glassslam.sources import SourceOptions, open_recording
from glassslam.sources.inspection import inspect_recording

NEW_HEAD = """## Player version 2.1.1
## File version 0.3.0
## Format:
## - Messages are newline-separated
"""
HALF = math.pi / 2


def new(time, device, kind, payload):
    """A line of Player 2 and 3; `kind` is type and subtype."""
    interface, index = device.split(":")
    return f"{time:014.3f} 16777343 6665 {interface} {int(index):02d} {kind[0]:03d} {kind[1]:03d} {payload}"


def old(time, device, payload, data_time=None):
    """A line of Player 1."""
    interface, index = device.split(":")
    stamp = time if data_time is None else data_time
    return f"{time:014.3f} fly 6665 {interface} {int(index):02d} {stamp:014.3f} {payload}"


def beams(ranges, strength=3):
    return " ".join(f"{r:.3f} {strength:2d}" for r in ranges)


def laser(time, ranges=(1.0, 2.0, 3.0), device="laser:0"):
    step = math.pi / (len(ranges) - 1)
    head = f"0007 {-HALF:+07.4f} {HALF:+07.4f} {step:+.8f} +08.0000 {len(ranges):04d}"
    return new(time, device, (1, 1), f"{head} {beams(ranges)}")


def position(time, x=0.0, y=0.0, yaw=0.0, device="position2d:0"):
    return new(time, device, (1, 1), f"{x:+07.3f} {y:+07.3f} {yaw:+04.3f} +00.100 +00.000 -00.010 0")


def sonar(time, ranges, device="sonar:0"):
    return new(time, device, (1, 1), f"{len(ranges)} {' '.join(f'{r:.3f}' for r in ranges)}")


RING = new(0.0, "sonar:0", (4, 1), "2 +00.100 +00.200 +1.5708 +00.100 -00.200 -1.5708")


@pytest.fixture
def log(tmp_path):
    """Opens a log with these lines."""

    def make(*lines, head=NEW_HEAD, **options):
        path = tmp_path / "run.log"
        path.write_text(head + "\n".join(lines) + "\n")
        return open_recording(path, SourceOptions(**options))

    return make


def only(recording, kind):
    return [record for record in recording.records() if isinstance(record, kind)]


def test_laser_odometry_and_sonar(log):
    recording = log(
        RING,
        new(0.0, "laser:0", (4, 1), "+0.030 -0.010 0.500 0.140 0.140"),
        position(10.0, 1.0, -2.0, 0.5),
        laser(10.1),
        sonar(10.15, [1.5, 5.0]),
        position(10.2, 1.1, -2.0, 0.5),
        laser(10.3, [4.0, 5.0, 6.0]),
        sonar(10.35, [1.4, 2.5]),
    )
    kinds = [Odometry, LaserScan, RangeRing, Odometry, LaserScan, RangeRing]
    records = list(recording.records())
    assert [type(record) for record in records] == kinds
    assert records[0] == Odometry(10.0, (1.0, -2.0, 0.5), 10.0)
    scan = records[1]
    assert (scan.stamp, scan.angle_min, scan.range_max) == (10.1, pytest.approx(-HALF, abs=1e-4), 8.0)
    assert scan.angle_increment == pytest.approx(HALF)
    assert (scan.ranges.tolist(), scan.intensities.tolist()) == ([1.0, 2.0, 3.0], [3.0, 3.0, 3.0])
    np.testing.assert_array_equal(records[5].ranges, np.float32([1.4, 2.5]))
    info = recording.info
    assert (info.format, info.scan_topic, info.odom_topic) == ("player", "laser:0", "position2d:0")
    assert (info.scan_count, info.base_from_laser) == (2, (0.03, -0.01, 0.5))
    assert info.sonar_topics == ("sonar:0",)
    np.testing.assert_allclose(info.sonar_ring.poses, [[0.1, 0.2, HALF], [0.1, -0.2, -HALF]], atol=1e-4)
    assert (recording.dropped, recording.warnings) == ({}, [])


def test_lines_of_the_first_version(log):
    recording = log(
        old(1000.0, "position:0", "+01.000 +02.000 +0.500 +00.000 +00.000 +00.000 0", 400.0),
        old(1000.1, "laser:0", f"-1.5708 +1.5708 +1.57079633 0003 {beams([1.0, 2.0, 3.0])}", 400.1),
        old(1000.2, "sonar:0", "2 +00.100 +00.200 +1.5708 +00.100 -00.200 -1.5708 2 1.500 5.000 ", 400.2),
        old(1000.3, "sync:0", ""),
        head="## Player version 1.5 \n## File version 0.1.0 \n",
    )
    odometry, scan, sweep = recording.records()
    assert (odometry.stamp, odometry.record_stamp, odometry.pose) == (400.0, 1000.0, (1.0, 2.0, 0.5))
    assert (scan.stamp, scan.record_stamp, scan.range_max) == (400.1, 1000.1, math.inf)
    assert scan.ranges.tolist() == [1.0, 2.0, 3.0]
    assert (sweep.stamp, sweep.ranges[0]) == (400.2, 1.5)
    assert recording.info.odom_topic == "position:0"
    np.testing.assert_allclose(recording.info.sonar_ring.poses[1], [0.1, -0.2, -HALF], atol=1e-4)


def test_without_a_head_lines_tell_what_they_are(log):
    assert log(laser(1.0), head="").info.format == "player"


@pytest.mark.parametrize(
    "head",
    [
        "-1.5708 +1.5708 +1.57079633 0003",
        "-1.5708 +1.5708 +1.57079633 +8.0000 0003",
        "0012 -1.5708 +1.5708 +1.57079633 +8.0000 0003",
        "-1.5708 +1.5708 +0.00000000 0003",
    ],
)
def test_geometry_of_all_versions(log, head):
    (scan,) = only(log(new(1.0, "laser:0", (1, 1), f"{head} {beams([1.0, 2.0, 3.0])}")), LaserScan)
    assert (scan.angle_min, scan.angle_increment) == pytest.approx((-HALF, HALF), abs=1e-4)
    assert scan.ranges.tolist() == [1.0, 2.0, 3.0]


def test_scans_with_the_pose_of_the_robot(log):
    head = "0001 +01.000 +02.000 +00.500 -1.5708 +1.5708 +1.57079633 +8.0000 0003"
    recording = log(new(1.0, "laser:0", (1, 2), f"{head} {beams([1.0, 2.0, 3.0])}"))
    odometry, scan = recording.records()
    assert (odometry.pose, odometry.stamp) == ((1.0, 2.0, 0.5), 1.0)
    assert scan.ranges.tolist() == [1.0, 2.0, 3.0]
    assert recording.info.odom_topic == "laser:0"


def test_the_ranger_of_version_3_is_laser_or_sonar(log):
    config = new(0.0, "ranger:0", (4, 5), "-1.570796 1.570796 0.031416 0.020 5.600 0.001 10.0")
    mount = new(0.0, "ranger:0", (4, 1), "+00.100 0 0 0 0 0 0.1 0.1 0.1 0000 0000")
    ring = new(
        0.0,
        "ranger:1",
        (4, 1),
        "+00.000 +00.000 0 0 0 +1.5708 0.1 0.1 0.1 0002 +00.200 0 0 0 0 +0.5 +00.300 0 0 0 0 -0.5 0000",
    )
    ranges = " ".join(f"{1 + k / 100:.3f}" for k in range(101))
    recording = log(
        *(config, mount, ring),
        new(1.0, "ranger:0", (1, 1), f"0101 {ranges}"),
        new(1.1, "ranger:1", (1, 1), "0002 1.500 2.500"),
    )
    scan, sweep = recording.records()
    assert (scan.ranges.size, scan.range_max) == (101, pytest.approx(5.6))
    assert scan.angle_increment == pytest.approx(math.pi / 100, abs=1e-5)
    assert recording.info.base_from_laser == (0.1, 0.0, 0.0)
    np.testing.assert_allclose(
        recording.info.sonar_ring.poses, [[0.0, 0.2, HALF + 0.5], [0.0, 0.3, HALF - 0.5]], atol=1e-4
    )
    assert sweep.ranges[0] == 1.5


def test_several_devices_ask(log):
    lines = [laser(1.0), laser(1.0, device="laser:1"), laser(2.0), laser(2.0, device="laser:1")]
    with pytest.raises(UsageError, match=r"several scan topics: laser:0 .* laser:1"):
        log(*lines)
    assert log(*lines, scan_topic="laser:1").info.scan_topic == "laser:1"
    lines = [laser(1.0), position(1.0), position(1.0, device="position2d:1"), laser(2.0)]
    with pytest.raises(UsageError, match="several odom topics"):
        log(*lines)
    assert log(*lines, odom_topic="none").info.odom_topic == ""


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"odom_topic": "position:7"}, "odom topic position:7 is not in the recording"),
        ({"imu_topic": "imu:0"}, "imu topic imu:0 is not in the log"),
        ({"sonar_topic": "sonar:3"}, "sonar topic sonar:3 is not in the recording"),
        ({"sonar_ring": "pioneer-3dx"}, "the ring pioneer-3dx has 16 sonars, sonar:0 sends 2 ranges"),
        ({"start": 99.0}, r"start 99 s lies beyond the end of the recording \(1\.0 s\)"),
    ],
)
def test_wishes_that_do_not_fit(log, options, message):
    with pytest.raises(UsageError, match=message):
        log(RING, laser(1.0), position(1.5), sonar(1.6, [1.0, 2.0]), laser(2.0), **options)


def test_a_ring_for_a_log_without_sonar(log):
    with pytest.raises(UsageError, match="there is no sonar in the log"):
        log(laser(1.0), sonar_ring="pioneer-3dx")


def test_sonar_without_geometry(log):
    lines = [laser(1.0), sonar(1.1, [1.0] * 16), laser(2.0)]
    recording = log(*lines)
    assert recording.warnings == [
        "sonar is not used: the log does not tell where the sonars of sonar:0 sit"
        " (--sonar-ring NAME or FILE says where the sonars sit)"
    ]
    assert only(recording, RangeRing) == []
    described = log(*lines, sonar_ring="pioneer-3dx")
    assert described.info.sonar_ring.name == "pioneer-3dx"
    assert len(only(described, RangeRing)) == 1
    assert log(*lines, sonar_topic="none").warnings == []


def test_a_ring_that_repeats_itself(log):
    """P2OS: messages at 10 Hz, every sonar fires each 0.4 s; the cycle is read off the log."""
    rng = np.random.default_rng(5)
    values = rng.uniform(0.5, 4.5, (120, 2)).round(3)
    lines = [sonar(10.0 + k / 10, values[k // 4]) for k in range(480)]
    readings = np.array(
        [record.ranges for record in only(log(RING, laser(10.0), *lines, laser(60.0)), RangeRing)]
    )
    new_ones = np.flatnonzero(~np.isnan(readings[:, 0]))
    assert new_ones.tolist() == list(range(0, 480, 4))
    np.testing.assert_array_equal(readings[new_ones], values.astype(np.float32))


def test_silent_sonars_and_beams(log):
    far = [2.0 + k / 7 for k in range(40)]
    lines = [laser(k / 10, [8.0, far[k % 30], 8.0, 1.0, 8.0]) for k in range(40)]
    lines += [sonar(k / 10 + 0.01, [5.0, 1.0 + k / 50][:: 1 - 2 * (k % 2)]) for k in range(40)]
    recording = log(RING, *lines)
    assert recording.info.no_echo == 8.0
    assert recording.info.sonar_ring.range_max == 5.0
    assert all(np.isposinf(record.ranges).sum() == 1 for record in only(recording, RangeRing))


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        (laser(1.5)[:-4], "unreadable line"),
        (new(1.5, "laser:0", (1, 1), "1 -1.5 1.5 0.1 8.0 0000"), "scan without beams"),
        (
            new(1.5, "laser:0", (1, 1), "1 nan 1.5 0.1 8.0 0001 1.0 0"),
            "scan with a zero or non-finite angle increment",
        ),
        (sonar(1.5, [1.0, 2.0, 3.0]), "sonar message with another number of readings than the ring has"),
        (new(1.5, "sonar:0", (1, 1), "9 1.0"), "unreadable line"),
        (position(1.5)[:60], "unreadable line"),
        ("0000000001.500 16777343 6665 laser xx 001 001 1 2", "unreadable line"),
        (
            new(1.5, "position2d:0", (1, 1), "nan 0 0 0 0 0 0"),
            "odometry that is not finite or has no orientation",
        ),
    ],
)
def test_bad_lines_are_counted(log, line, reason):
    drive = [position(1.0), sonar(1.1, [1.0, 2.0]), sonar(1.2, [1.1, 2.0])]
    recording = log(RING, laser(1.0), *drive, line, laser(2.0))
    assert len(only(recording, LaserScan)) == 2
    assert recording.dropped == {reason: 1}


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ({"start": 1.0}, [2.0, 3.0, 4.0]),
        ({"duration": 1.5}, [1.0, 2.0]),
        ({"every": 2}, [1.0, 3.0]),
        ({"start": 1.0, "every": 2}, [2.0, 4.0]),
    ],
)
def test_part_of_a_log(log, options, expected):
    recording = log(*map(laser, [1.0, 2.0, 3.0, 4.0]), **options)
    assert [record.stamp for record in only(recording, LaserScan)] == expected
    assert recording.info.scan_count == pytest.approx(len(expected), abs=1)


def test_compressed_and_in_pieces(tmp_path):
    paths = []
    for number in range(2):
        path = tmp_path / f"part{number}.log.gz"
        with gzip.open(path, "wt") as file:
            file.write(NEW_HEAD + "\n".join(laser(10.0 * number + k) for k in range(3)) + "\n")
        paths.append(path)
    assert [scan.stamp for scan in only(open_recording(paths), LaserScan)] == [
        0.0,
        1.0,
        2.0,
        10.0,
        11.0,
        12.0,
    ]
    paths[1].write_bytes(paths[1].read_bytes()[:-12])
    cut = open_recording(paths)
    assert [scan.stamp for scan in only(cut, LaserScan)][:5] == [0.0, 1.0, 2.0, 10.0, 11.0]
    assert cut.damage[0].file == str(paths[1])
    with pytest.raises(RecordingError, match="the file is cut off here"):
        open_recording(paths, SourceOptions(strict=True))


def test_a_log_without_a_laser(log):
    with pytest.raises(NoScansError, match="no usable laser line in") as caught:
        log(RING, position(1.0), sonar(1.1, [1.0, 2.0]))
    assert "sonar:0 (Player sonar, 1 messages" in caught.value.hint


def test_inspection(tmp_path):
    path = tmp_path / "run.log"
    lines = [RING]
    for k in range(30):
        lines += [
            position(k / 10, k / 10),
            laser(k / 10),
            sonar(k / 10 + 0.05, [5.0, 1.0 + k / 50][:: 1 - 2 * (k % 2)]),
        ]
    path.write_text(NEW_HEAD + "\n".join([*lines, laser(9.0)[:-4]]) + "\n")
    report = inspect_recording(path)
    assert [(t.name, t.count) for t in report.topics] == [
        ("position2d:0", 30),
        ("laser:0", 30),
        ("sonar:0", 30),
    ]
    assert report.odometry[0].path_length == pytest.approx(2.9)
    assert report.scans[0].beams == (3, 3)
    assert report.dropped == {"laser:0: unreadable line": 1}
    (ring,) = report.sonars
    assert (ring.sonars, ring.ring, ring.stamps.count) == (2, "as recorded", 30)
    assert ring.shares == {"echo": 0.5, "no_echo": 0.5, "not_new": 0.0}
    assert report.plan.sonar_topics == ("sonar:0",)


def test_inspection_of_nothing(tmp_path):
    path = tmp_path / "run.log"
    path.write_text(NEW_HEAD)
    with pytest.raises(NoScansError, match="no usable line in"):
        inspect_recording(path)
