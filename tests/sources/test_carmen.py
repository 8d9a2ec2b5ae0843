"""CARMEN logs: laser lines carry their odometry, ODOM lines stand in where they do not."""

import gzip
import math

import numpy as np
import pytest

from glassslam.errors import NoScansError, UsageError
from glassslam.records import LaserScan, Odometry
from glassslam.sources import SourceOptions, open_recording
from glassslam.sources.carmenlines import flaser_geometry


def flaser(stamp, ranges=(1.0, 2.0, 3.0), robot=(0.0, 0.0, 0.0), laser=None, logged=None):
    pose = [*(robot if laser is None else laser), *robot]
    logged = stamp if logged is None else logged
    return f"FLASER {len(ranges)} {_text(ranges)} {_text(pose)} {stamp!r} nohost {logged!r}"


def odom(stamp, pose=(0.0, 0.0, 0.0)):
    return f"ODOM {_text(pose)} 0.0 0.0 0 {stamp!r} nohost {stamp!r}"


def robotlaser(stamp, ranges, *, remissions=(), resolution=0.5, laser=(0.0, 0.0, 0.0), robot=(0.0, 0.0, 0.0)):
    head = f"ROBOTLASER1 0 -0.5 1.0 {resolution} 20.0 0.01 0 {len(ranges)} {_text(ranges)}"
    tail = f"{len(remissions)} {_text(remissions)} {_text(laser)} {_text(robot)} 0.1 0.2 0.3 0.4 0.5"
    return f"{head} {tail} {stamp!r} nohost {stamp!r}"


def _text(numbers):
    return " ".join(repr(float(number)) for number in numbers)


@pytest.fixture
def log(tmp_path):
    """Opens a log with these lines."""

    def make(*lines, **options):
        path = tmp_path / "run.log"
        path.write_text("# a comment\nPARAM robot_length 0.5\n" + "\n".join(lines) + "\n")
        return open_recording(path, SourceOptions(**options))

    return make


def test_the_pose_of_a_laser_line_comes_right_before_its_scan(log):
    recording = log(
        odom(0.9), flaser(1.0, robot=(0.1, 0.2, 0.3)), odom(1.5), flaser(2.0, robot=(1.1, 0.2, 0.3))
    )
    records = list(recording.records())
    assert [type(record) for record in records] == [Odometry, LaserScan, Odometry, LaserScan]
    assert [record.stamp for record in records] == [1.0, 1.0, 2.0, 2.0]
    assert [record.pose for record in records[::2]] == [(0.1, 0.2, 0.3), (1.1, 0.2, 0.3)]
    assert (recording.info.scan_topic, recording.info.odom_topic) == ("FLASER", "FLASER")
    assert (recording.info.format, recording.info.scan_count) == ("carmen", 2)


@pytest.mark.parametrize(
    ("beams", "step"),
    [(180, math.pi / 180), (181, math.pi / 180), (360, math.pi / 360), (361, math.pi / 360)],
)
def test_geometry_of_half_a_circle(log, beams, step):
    (record,) = [r for r in log(flaser(1.0, [1.0] * beams)).records() if isinstance(r, LaserScan)]
    assert record.ranges.shape == (beams,)
    assert record.angle_min == -math.pi / 2
    assert record.angle_increment == pytest.approx(step, rel=1e-15)
    assert flaser_geometry(beams) == (record.angle_min, record.angle_increment)


@pytest.mark.parametrize("dead", [(0.0, 0.0, 0.0), (math.nan, 0.0, 0.0)])
def test_odom_lines_are_used_when_laser_lines_carry_no_pose(log, dead):
    recording = log(
        odom(0.5, (1.0, 0.0, 0.0)),
        flaser(1.0, robot=dead),
        odom(1.5, (2.0, 0.0, 0.0)),
        flaser(2.0, robot=dead),
    )
    assert recording.info.odom_topic == "ODOM"
    assert [r.stamp for r in recording.records()] == [0.5, 1.0, 1.5, 2.0]
    assert [r.pose[0] for r in recording.records() if isinstance(r, Odometry)] == [1.0, 2.0]


@pytest.mark.parametrize(("wish", "expected"), [("ODOM", "ODOM"), ("FLASER", "FLASER"), ("none", "")])
def test_odometry_by_name(log, wish, expected):
    lines = [odom(0.5), flaser(1.0, robot=(1.0, 0.0, 0.0)), flaser(2.0)]
    assert log(*lines, odom_topic=wish).info.odom_topic == expected


def test_unknown_odometry(log):
    with pytest.raises(UsageError, match="odom topic /odom is not in the log; candidates: FLASER, ODOM"):
        log(odom(0.5), flaser(1.0), odom_topic="/odom")


def test_there_is_no_imu(log):
    with pytest.raises(UsageError, match="imu topic /imu is not in the log"):
        log(flaser(1.0), imu_topic="/imu")


def test_robotlaser_says_what_it_is(log):
    recording = log(
        robotlaser(1.0, [1.0, 2.0, 3.0], remissions=[5, 6, 7], laser=(1.5, 2.0, 0.0), robot=(1.0, 2.0, 0.0)),
        robotlaser(2.0, [1.0, 2.0, 3.0], laser=(3.0, 2.5, math.pi / 2), robot=(3.0, 2.0, math.pi / 2)),
    )
    pose, scan, *_ = recording.records()
    assert recording.info.base_from_laser == pytest.approx((0.5, 0.0, 0.0))
    assert pose.pose == (1.0, 2.0, 0.0)
    assert (scan.angle_min, scan.angle_increment, scan.range_max) == (-0.5, 0.5, 20.0)
    assert scan.intensities.tolist() == [5.0, 6.0, 7.0]


def test_a_missing_resolution_follows_from_the_field_of_view(log):
    scans = [r for r in log(robotlaser(1.0, [1.0] * 5, resolution=0.0)).records() if isinstance(r, LaserScan)]
    assert scans[0].angle_increment == 0.25


def test_two_kinds_of_laser_lines_ask(log):
    lines = [flaser(1.0), robotlaser(1.0, [1.0]), flaser(2.0), robotlaser(2.0, [1.0])]
    with pytest.raises(UsageError) as caught:
        log(*lines)
    assert caught.value.message == (
        "several scan topics: FLASER (CARMEN FLASER, 2 messages, 2.0 Hz),"
        " ROBOTLASER1 (CARMEN ROBOTLASER1, 2 messages, 2.0 Hz)"
    )
    assert log(*lines, scan_topic="ROBOTLASER1").info.scan_topic == "ROBOTLASER1"


def test_laser_offset_from_the_parameters(log):
    assert log("PARAM robot_frontlaser_offset 0.25", flaser(1.0)).info.base_from_laser == (0.25, 0.0, 0.0)


def test_a_corrected_log_has_no_mount(log):
    lines = [flaser(float(k), robot=(k, 0.0, 0.0), laser=(k * 1.1, 0.2, 0.0)) for k in range(5)]
    recording = log(*lines)
    assert recording.info.base_from_laser == (0.0, 0.0, 0.0)
    assert recording.warnings[0].startswith("the laser pose in the log is no fixed mount (a corrected log?)")


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        (flaser(1.5)[:30], "unreadable line"),
        ("FLASER many 1.0", "unreadable line"),
        ("FLASER -3 1.0", "unreadable line"),
        ("FLASER 1e300 1.0", "unreadable line"),
        (flaser(1.5, []), "scan without beams"),
        (flaser(math.nan), "non-finite stamp"),
        (flaser(math.inf), "non-finite stamp"),
    ],
)
def test_bad_lines_are_counted(log, line, reason):
    recording = log(flaser(1.0), line, flaser(2.0))
    assert sum(isinstance(record, LaserScan) for record in recording.records()) == 2
    assert recording.dropped == {reason: 1}


def test_a_bad_robotlaser_line_is_counted(log):
    good = robotlaser(1.0, [1.0, 2.0])
    recording = log(good, good[:60], robotlaser(2.0, [1.0, 2.0], resolution=math.nan), good)
    assert sum(isinstance(record, LaserScan) for record in recording.records()) == 2
    assert recording.dropped == {
        "unreadable line": 1,
        "scan with a zero or non-finite angle increment": 1,
    }


def test_exotic_numbers_are_read(log):
    line = "FLASER 3 1e0 nan +2.5 0 0 0 1 2 0.5 1.0 nohost 1.0"
    odometry, scan = log(line).records()
    np.testing.assert_array_equal(scan.ranges, np.float32([1.0, math.nan, 2.5]))
    assert odometry.pose == (1.0, 2.0, 0.5)


def test_a_bad_pose_loses_only_the_odometry(log):
    recording = log(flaser(1.0, robot=(1, 1, 1)), flaser(2.0, robot=(math.nan, 0, 0)), odom_topic="FLASER")
    assert [type(r) for r in recording.records()] == [Odometry, LaserScan, LaserScan]
    assert recording.dropped == {"odometry that is not finite or has no orientation": 1}


def test_lines_stay_in_order_when_stamps_step_back(log):
    stamps = [1.0, 1.9, 1.1, 1.1, 2.0]
    scans = [r for r in log(*map(flaser, stamps)).records() if isinstance(r, LaserScan)]
    assert [scan.stamp for scan in scans] == stamps


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ({"start": 1.0}, [2.0, 3.0, 4.0]),
        ({"duration": 1.5}, [1.0, 2.0]),
        ({"start": 0.5, "duration": 2.0}, [2.0, 3.0]),
        ({"every": 2}, [1.0, 3.0]),
    ],
)
def test_part_of_a_log(log, options, expected):
    recording = log(*map(flaser, [1.0, 2.0, 3.0, 4.0]), **options)
    assert [r.stamp for r in recording.records() if isinstance(r, LaserScan)] == expected
    assert recording.info.scan_count == pytest.approx(len(expected), abs=1)


def test_the_loggers_clock_gives_the_record_times(log):
    recording = log(flaser(100.0, logged=0.0), flaser(100.9, logged=1.0), flaser(100.5, logged=2.0))
    scans = [r for r in recording.records() if isinstance(r, LaserScan)]
    assert [scan.record_stamp for scan in scans] == [100.0, 101.0, 102.0]
    assert recording.info.duration == 2.0


def test_without_a_loggers_clock_the_stamps_do(log):
    recording = log(flaser(100.0, logged=0.0), flaser(101.0, logged=0.0))
    assert [r.record_stamp for r in recording.records()] == [100.0, 100.0, 101.0, 101.0]


@pytest.mark.parametrize("silent", [81.83, 50.0, 81.91, 51.06])
def test_silent_beams_reach_range_max(log, silent):
    far = [2.0 + k / 7 for k in range(50)]
    lines = [flaser(float(k), [silent, *far[k : k + 5], silent, 1.0, silent]) for k in range(30)]
    recording = log(*lines)
    assert recording.info.no_echo == np.float32(silent)
    for scan in (r for r in recording.records() if isinstance(r, LaserScan)):
        assert np.flatnonzero(scan.ranges >= scan.range_max).tolist() == [0, 6, 8]


def test_compressed_and_in_pieces(tmp_path):
    paths = []
    for number in range(2):
        path = tmp_path / f"part{number}"
        with gzip.open(path, "wt") as file:
            file.write("\n".join(flaser(10.0 * number + k) for k in range(3)) + "\n")
        paths.append(path)
    recording = open_recording(paths)
    stamps = [r.stamp for r in recording.records() if isinstance(r, LaserScan)]
    assert stamps == [0.0, 1.0, 2.0, 10.0, 11.0, 12.0]


def test_a_log_of_odometry_only(log):
    with pytest.raises(NoScansError, match="no usable FLASER or ROBOTLASER1 line in"):
        log(odom(1.0), odom(2.0))
