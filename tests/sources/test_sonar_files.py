"""Sonar from a second file: pi-map text logs, bags, Player logs."""

import itertools
import math

import numpy as np
import pytest
from test_player import NEW_HEAD, RING, laser
from test_player import sonar as player_sonar
from tiny_bags import T0, odom, scan, tf, write_ros1
from tiny_sonar import cloud, echoes, sonar

from glassslam.errors import ConfigError, RecordingError, UsageError
from glassslam.records import LaserScan, Odometry, PointSet, RangeRing
from glassslam.sources import SourceOptions, open_recording
from glassslam.sources.inspection import inspect_recording
from glassslam.sources.pimap import read_pimap
from glassslam.sources.rings import load_ring

TICKS_AT_1970 = 621355968000000000
DRIVE = [message for k in range(40) for message in (odom(k / 10), scan(k / 10 + 0.01, [1.0, 2.0]))]


def pimap_line(k, at, values):
    return f"{k} {1000 + 20 * k} {k // 8} {round((T0 + at) * 10**7) + TICKS_AT_1970} " + " ".join(
        map(str, values)
    )


def pimap_log(path, rows, scan_period=0.17):
    """A log of lines every 0.1 s, whose ticks are the stamp of the last scan."""
    ticks = [math.floor(k / 10 / scan_period) * scan_period for k in range(len(rows))]
    path.write_text(
        "\n".join(pimap_line(k, at, row) for k, (at, row) in enumerate(zip(ticks, rows, strict=True)))
    )
    return path


@pytest.fixture
def drive(tmp_path):
    return write_ros1(tmp_path / "run.bag", DRIVE)


@pytest.fixture
def pimap(tmp_path):
    rng = np.random.default_rng(2)
    rows = rng.uniform(0.5, 4.5, (40, 16)).round(3).tolist()
    rows[0] = [5] * 16
    return pimap_log(tmp_path / "scene_sonar.txt", rows)


def test_ticks_become_seconds_since_1970(pimap):
    log = read_pimap(pimap)
    times = log.sweep_times
    assert log.values.shape == (40, 16)
    assert log.values[0].tolist() == [5.0] * 16
    # a line through ticks that stand still for 0.17 s and are on average half as late
    np.testing.assert_allclose(np.diff(times), 0.1, atol=2e-3)
    assert times[0] == pytest.approx(T0 - 0.085, abs=0.03)


def test_ticks_that_are_not_steady_stay_as_they_are(tmp_path):
    path = tmp_path / "gap.txt"
    ats = [0.0, 0.1, 0.2, 60.0, 60.1, 60.2]
    path.write_text("\n".join(pimap_line(k, at, [1.0, 2.0, 3.0, 4.0]) for k, at in enumerate(ats)))
    np.testing.assert_allclose(read_pimap(path).sweep_times - T0, ats, atol=1e-6)


def test_poses_of_a_pimap_log(tmp_path):
    rows = [[0.1 * (k // 2), 0.2, 0.3] for k in range(6)]
    path = tmp_path / "scene_pose.txt"
    path.write_text("\n".join(pimap_line(k, 0.17 * (k // 2), row) for k, row in enumerate(rows)))
    log = read_pimap(path)
    np.testing.assert_allclose(log.times - T0, [0.0, 0.0, 0.17, 0.17, 0.34, 0.34], atol=1e-6)
    assert log.values.tolist() == rows


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is no pi-map log: 0 of 0 lines cannot be read"),
        ("hello\n" * 3, "3 of 3 lines cannot be read"),
        (pimap_line(0, 0, [1, "x", 3]), "1 of 1 lines cannot be read"),
        ((pimap_line(0, 0, [1, 2, 3]) + "\nx\ny\n") * 5, "10 of 15 lines cannot be read"),
    ],
)
def test_pimap_logs_that_are_none(tmp_path, text, message):
    path = tmp_path / "bad.txt"
    path.write_text(text)
    with pytest.raises(RecordingError, match=message):
        read_pimap(path)


def test_a_cut_off_last_line_is_left_out(pimap):
    pimap.write_text(pimap.read_text()[:-30])
    log = read_pimap(pimap)
    assert (len(log.times), log.dropped) == (39, 1)


def test_poses_are_not_ranges(pimap, drive):
    pimap.write_text("\n".join(pimap_line(k, k / 10, [1.0, 2.0, 3.0]) for k in range(5)))
    with pytest.raises(RecordingError, match="holds poses, not ranges"):
        open_recording(drive, SourceOptions(sonar=pimap))


def test_pimap_sonar_beside_a_recording(drive, pimap):
    recording = open_recording(drive, SourceOptions(sonar=pimap))
    assert recording.info.sonar_ring.name == "pioneer-3dx"
    assert recording.info.sonar_topics == ("pi-map sonar",)
    records = list(recording.records())
    rest = [record for record in records if not isinstance(record, RangeRing)]
    alone = list(open_recording(drive).records())
    assert [(type(r), r.stamp, r.record_stamp) for r in rest] == [
        (type(r), r.stamp, r.record_stamp) for r in alone
    ]
    times = [record.record_stamp for record in records]
    assert times == sorted(times)
    sweeps = [record for record in records if isinstance(record, RangeRing)]
    # the line before the recording begins is left out, the silence before the first echo says nothing
    assert len(sweeps) == 39
    assert np.isfinite(sweeps[5].ranges).all()
    assert (recording.dropped, recording.warnings[1:]) == ({}, [])


def test_each_reading_starts_anew(drive, pimap):
    recording = open_recording(drive, SourceOptions(sonar=pimap))
    first, second = (
        [r.ranges.tolist() for r in recording.records() if isinstance(r, RangeRing)] for _ in range(2)
    )
    np.testing.assert_array_equal(first, second)


def test_dropped_messages_of_both_files_are_counted(tmp_path):
    ring = load_ring("pioneer-3dx").poses
    ends = np.column_stack(
        [ring[:, :2] + np.stack([np.cos(ring[:, 2]), np.sin(ring[:, 2])], axis=1), ring[:, 0] * 0]
    )
    clouds = [cloud(k / 10, ends) for k in range(12)]
    sonars = write_ros1(tmp_path / "sonar.bag", [*clouds, cloud(1.5, ends[:3])])
    main = write_ros1(tmp_path / "main.bag", [*DRIVE, scan(3.99, [])])
    options = SourceOptions(sonar=sonars, sonar_ring="pioneer-3dx")
    recording = open_recording(main, options)
    for _ in range(2):
        assert sum(isinstance(record, RangeRing) for record in recording.records()) == 12
        assert recording.dropped == {
            "sonar message with another number of readings than the ring has": 1,
            "scan without beams": 1,
        }


def test_a_bag_of_single_ranges(drive, tmp_path):
    mount = tf(0.0, "base_link", "sonar_0", (0.3, 0.0, 0.0), topic="/tf_static")
    sonars = write_ros1(tmp_path / "sonar.bag", [mount, *(sonar(k / 10, 1.0 + k / 100) for k in range(30))])
    recording = open_recording(drive, SourceOptions(sonar=sonars))
    np.testing.assert_allclose(recording.info.sonar_ring.poses, [[0.3, 0.0, 0.0]])
    kinds = {type(record) for record in recording.records()}
    assert kinds == {LaserScan, Odometry, RangeRing}


def test_a_bag_of_3d_points(drive, tmp_path):
    points = write_ros1(tmp_path / "points.bag", [echoes(k / 10, [[1.0, 0.0, 0.5]]) for k in range(5)])
    recording = open_recording(drive, SourceOptions(sonar=points))
    assert sum(isinstance(record, PointSet) for record in recording.records()) == 5
    assert recording.warnings[-1].startswith("no transform from a base frame to toposens")


def test_a_player_log(tmp_path):
    main, second = tmp_path / "main.log", tmp_path / "sonar.log"
    main.write_text(NEW_HEAD + "\n".join(laser(k / 10) for k in range(10)) + "\n")
    second.write_text(
        NEW_HEAD + "\n".join([RING, *(player_sonar(k / 10, [1 + k / 50, 5.0]) for k in range(10))]) + "\n"
    )
    recording = open_recording(main, SourceOptions(sonar=second))
    assert recording.info.sonar_topics == ("sonar:0",)
    kinds = [type(record) for record in recording.records()]
    assert kinds == list(itertools.chain(*[(RangeRing, LaserScan)] * 10))
    second.write_text(main.read_text())
    with pytest.raises(RecordingError, match="no sonar in"):
        open_recording(main, SourceOptions(sonar=second))


def test_no_overlap_in_time(pimap, tmp_path):
    bag = write_ros1(tmp_path / "later.bag", [scan(100.0), scan(101.0)])
    log = tmp_path / "later.clf"
    log.write_text(f"FLASER 2 1.0 2.0 0 0 0 0 0 0 {T0 + 100} host {T0 + 100}\n" * 2)
    for later in (bag, log):
        with pytest.raises(RecordingError, match=r"do not overlap in time \(96\.\d s apart\)") as caught:
            open_recording(later, SourceOptions(sonar=pimap))
        assert caught.value.exit_code == 1
        assert caught.value.hint == "both must be recorded at the same time, on the same clock"


@pytest.mark.parametrize(
    ("content", "message", "hint"),
    [
        (b"some words\n", "is no recording known here", "sonar is read from ROS bags, mcap, Player logs"),
        (b"", "is empty", ""),
        (
            b"FLASER 1 1.0 0 0 0 0 0 0 1.0 host 1.0\n",
            "is a CARMEN log, which holds no sonar",
            "sonar is read from",
        ),
        (b"PK\x03\x04", "is a zip archive", "unpack it"),
    ],
)
def test_files_that_hold_no_sonar(drive, tmp_path, content, message, hint):
    path = tmp_path / "what.txt"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=message) as caught:
        open_recording(drive, SourceOptions(sonar=path))
    assert str(path) in caught.value.message
    assert caught.value.hint.startswith(hint)
    assert caught.value.exit_code == 1


def test_a_missing_file(drive, tmp_path):
    with pytest.raises(RecordingError, match=r"nowhere\.txt does not exist"):
        open_recording(drive, SourceOptions(sonar=tmp_path / "nowhere.txt"))


def test_a_bag_without_sonar(drive, tmp_path):
    other = write_ros1(tmp_path / "other.bag", [odom(0.0)])
    with pytest.raises(RecordingError, match="no sonar in") as caught:
        open_recording(drive, SourceOptions(sonar=other))
    assert caught.value.hint == "recorded: /odom (nav_msgs/msg/Odometry, 1 messages, 0.0 Hz)"


def test_what_does_not_fit_the_second_file(drive, pimap, tmp_path):
    ranges = write_ros1(tmp_path / "sonar.bag", [sonar(k / 10, 1.0) for k in range(3)])
    for options, message in (
        (
            {"sonar": pimap, "sonar_ring": "turtlebot-9"},
            "the ring turtlebot-9 has 9 sonars, .* holds 16 ranges a line",
        ),
        ({"sonar": pimap, "sonar_topic": "/sonar"}, "has no topics"),
        ({"sonar": pimap, "sonar_topic": "none"}, "a sonar file was named and sonar switched off"),
        ({"sonar": ranges}, "no transform from a base frame to the sonars sonar_0"),
        ({"sonar": ranges, "sonar_topic": "/other"}, "sonar topic /other is not in the recording"),
    ):
        with pytest.raises(UsageError, match=message):
            open_recording(drive, SourceOptions(**options))
    with pytest.raises(ConfigError, match="cannot read"):
        open_recording(drive, SourceOptions(sonar=pimap, sonar_ring=tmp_path / "no.yaml"))


def test_a_carmen_log_takes_sonar_from_a_second_file_only(tmp_path, pimap):
    log = tmp_path / "run.clf"
    log.write_text("".join(f"FLASER 2 1.0 2.0 0 0 0 0 0 0 {T0 + k} host {k}\n" for k in range(4)))
    with pytest.raises(UsageError, match="a CARMEN log holds no sonar"):
        open_recording(log, SourceOptions(sonar_ring="pioneer-3dx"))
    recording = open_recording(log, SourceOptions(sonar=pimap))
    assert recording.info.format == "carmen"
    assert sum(isinstance(record, RangeRing) for record in recording.records()) > 20


def test_a_sonar_log_is_no_recording(pimap):
    with pytest.raises(RecordingError, match="holds no laser scans") as caught:
        open_recording(pimap)
    assert caught.value.hint == "name the recording, and this file with --sonar"
    report = inspect_recording(pimap)
    assert [(t.msgtype, t.count) for t in report.topics] == [("pi-map ranges", 40)]
    assert (report.sonars[0].sonars, report.sonars[0].stamps.count) == (16, 40)
    assert "holds no laser scans" in report.plan.problem


def test_a_part_of_the_recording(drive, pimap):
    recording = open_recording(drive, SourceOptions(sonar=pimap, start=1.0, duration=1.0))
    stamps = [record.stamp - T0 for record in recording.records() if isinstance(record, RangeRing)]
    assert 1.0 <= min(stamps) < 1.1
    assert 1.9 < max(stamps) <= 2.0
