"""What inspect says of a recording."""

import itertools
import json
import math

import pytest
from tiny_bags import T0, imu, odom, scan, tf, write_ros1, write_ros2
from tiny_sonar import echoes, range_array, sonar

from glassslam.cli import main
from glassslam.sources.inspection import inspect_recording


@pytest.fixture
def report(tmp_path):
    numbers = itertools.count()

    def make(*messages):
        return inspect_recording(write_ros1(tmp_path / f"run{next(numbers)}.bag", messages))

    return make


def test_topics_times_and_plan(report):
    found = report(
        tf(0.0, "base_link", "laser", (0.5, 0.0, 0.0), (0.1, 0.2, 0.3), topic="/tf_static"),
        *(m for k in range(11) for m in (odom(k / 10, k * 0.5), scan(k / 10), imu(k / 10, (0, 0, 0.25)))),
    )
    assert [(t.name, t.count) for t in found.topics] == [
        ("/tf_static", 1),
        ("/odom", 11),
        ("/scan", 11),
        ("/imu", 11),
    ]
    assert found.topics[2].rate == pytest.approx(11.0)
    assert (found.format, found.duration, found.begin) == ("rosbag1", pytest.approx(1.0), T0)
    assert found.odometry[0].path_length == pytest.approx(5.0)
    assert found.odometry[0].frames == "odom -> base_link"
    assert found.imus[0].yaw_rate_mean == pytest.approx(0.25)
    (edge,) = found.transforms
    assert (edge.parent, edge.child, edge.static, edge.moved) == ("base_link", "laser", True, False)
    assert edge.rotation == pytest.approx((0.1, 0.2, 0.3))
    plan = found.plan
    assert (plan.scan_topic, plan.odom_topic, plan.imu_topic, plan.problem) == ("/scan", "/odom", "/imu", "")
    assert plan.base_from_laser[0] == 0.5


def test_times_that_go_wrong(report):
    stamps = [0.0, 0.1, 0.05, 0.05, 0.2, 0.3, 0.4, 1.4]
    times = report(*(scan(k / 10, stamp=T0 + at) for k, at in enumerate(stamps))).scans[0].stamps
    assert (times.count, times.backward, times.equal, times.gaps) == (8, 1, 1, 1)
    assert times.period == pytest.approx(0.1, abs=1e-6)
    assert times.largest_step_back == pytest.approx(0.05, abs=1e-6)
    assert times.longest_gap == pytest.approx(1.0, abs=1e-6)
    assert (times.offset_min, times.offset_max) == pytest.approx((-0.7, 0.25), abs=1e-6)


def test_geometry_that_changes(report):
    (found,) = report(scan(0.0, [1.0] * 5), scan(0.1, [1.0] * 5), scan(0.2, [1.0] * 7, angle_min=-1.0)).scans
    assert (found.beams, found.geometry_changes) == ((5, 7), 1)
    assert found.angle_min == (-1.0, -0.5)
    assert found.field_of_view == 2.0
    assert found.frame_id == "laser"


def test_ranges(report):
    ranges = [1.0] * 10 + [2.0] * 10 + [math.nan, math.inf, 0.0, 0.05, 31.0]
    (found,) = report(scan(0.0, ranges)).scans
    assert found.shares == {"valid": 0.8, "no_echo": 0.08, "nan": 0.04, "too_near": 0.08}
    assert found.percentiles == pytest.approx((1.0, 1.0, 2.0))
    assert found.no_echo == math.inf


@pytest.mark.parametrize(
    ("intensities", "verdict"),
    [
        ([], "none"),
        ([0.0, 0.0, 0.0], "all zero"),
        ([7.0, 7.0, 7.0], "constant"),
        ([0.0, 47.0, 0.0], "two-valued"),
        ([1.0, 2.0, 3.0], "equal to range"),
        ([10.0, 20.0, 254.0], "informative"),
    ],
)
def test_whether_intensities_carry_information(report, intensities, verdict):
    (found,) = report(*(scan(k / 10, [1.0, 2.0, 3.0], intensities=intensities) for k in range(3))).scans
    assert found.intensity.verdict == verdict


def test_saturated_intensities(report):
    (found,) = report(
        scan(0.0, intensities=[254.0, 254.0, 9.0]), scan(0.1, intensities=[254.0, 8.0, 7.0])
    ).scans
    intensity = found.intensity
    assert (intensity.minimum, intensity.maximum, intensity.share_at_maximum) == (7.0, 254.0, 0.5)


def test_dropped_messages_are_named(report):
    assert report(scan(0.0), scan(0.1, [])).dropped == {"/scan: scan without beams": 1}


def test_an_ambiguous_recording_is_inspected_all_the_same(report):
    found = report(scan(0.0, topic="/front"), scan(0.0, topic="/rear"))
    assert [s.topic for s in found.scans] == ["/front", "/rear"]
    assert found.plan.problem.startswith("several scan topics: /front")
    assert found.plan.hint == "choose one with --scan-topic"


def test_carmen(tmp_path):
    path = tmp_path / "run.log"
    lines = [
        f"ODOM {k} 0 0 0 0 0 {k} host {k}\nFLASER 3 1 2 50 {k} 0 0 {k} 0 0 {k} host {k}" for k in range(9)
    ]
    path.write_text("\n".join([*lines, "FLASER 3 1"]) + "\n")
    found = inspect_recording(path)
    assert [(t.name, t.count) for t in found.topics] == [("FLASER", 10), ("ODOM", 9)]
    assert [(o.topic, o.path_length) for o in found.odometry] == [("FLASER", 8.0), ("ODOM", 8.0)]
    assert found.scans[0].beams == (3, 3)
    assert found.dropped == {"FLASER: unreadable line": 1}
    assert (found.plan.scan_topic, found.plan.odom_topic) == ("FLASER", "FLASER")


def test_json_is_strict(report):
    plain = report(scan(0.0, [math.inf, math.nan, 1.0], range_max=math.inf)).to_dict()
    again = json.loads(json.dumps(plain, allow_nan=False))
    assert again["scans"][0]["range_max"] == "inf"
    assert again["plan"]["scan_topic"] == "/scan"


def test_command(tmp_path, capsys):
    silent = [scan(k / 10, [1.0, 65.5, 2.0, 65.5, 3.0], intensities=[5, 0, 6, 0, 7]) for k in range(40)]
    path = write_ros2(tmp_path / "run", [odom(0.0), *silent])
    assert main(["inspect", str(path)]) == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "/scan sensor_msgs/msg/LaserScan 40 10.3" in text
    assert "5 beams from -28.65 deg, step 28.6479 deg" in text
    assert "no echo: 65.500 m, from 30.00 m on" in text
    assert "intensities: informative, 0 to 7, 20.0% at the maximum" in text
    assert "map would use scans /scan, odometry /odom" in text


def test_command_says_why_map_would_stop(tmp_path, capsys):
    path = write_ros1(tmp_path / "run.bag", [odom(0.0)])
    assert main(["inspect", str(path)]) == 0
    assert "map would stop no laser scan in" in " ".join(capsys.readouterr().out.split())


def test_command_as_json(tmp_path, capsys):
    path = write_ros1(tmp_path / "run.bag", [scan(0.0)])
    assert main(["inspect", str(path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["topics"][0]["name"] == "/scan"


def test_command_on_a_missing_file(tmp_path, capsys):
    assert main(["inspect", str(tmp_path / "nowhere.bag")]) == 1
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err == f"error: {tmp_path / 'nowhere.bag'} does not exist\n"


def test_a_ring_of_sonars(report):
    mount = tf(0.0, "base_link", "sonar_0", (0.3, 0.0, 0.0), topic="/tf_static")
    ranges = [sonar(k / 10, 5.0 if k % 4 == 0 else 1.0 + k / 100) for k in range(40)]
    found = report(mount, odom(0.0), scan(0.0), *ranges)
    (ring,) = found.sonars
    assert (ring.topics, ring.ring, ring.sonars) == (("/sonar",), "as recorded", 1)
    assert (ring.stamps.count, ring.rate) == (40, pytest.approx(10.0))
    assert ring.shares == {"echo": 0.75, "no_echo": 0.25, "not_new": 0.0}
    assert (ring.limit, ring.cycle) == (5.0, 0.0)
    assert ring.percentiles[1] == pytest.approx(1.2, abs=0.02)
    assert (found.plan.sonar_topics, found.plan.sonar_ring) == (("/sonar",), "as recorded")


def test_a_3d_sensor(report):
    clouds = [echoes(k / 10, [[1.0, 0.0, 0.0], [0.0, 2.0, 0.0]]) for k in range(10)]
    (sensor,) = report(odom(0.0), scan(0.0), *clouds).sonars
    assert (sensor.sonars, sensor.ring, sensor.shares) == (0, "", {})
    assert sensor.points_per_message == 2.0
    assert sensor.percentiles == pytest.approx((1.0, 1.0, 2.0))


def test_sonar_of_a_recording_without_scans(report):
    found = report(*(echoes(k / 10, [[1.0, 0.0, 0.0]]) for k in range(10)))
    assert found.sonars[0].stamps.count == 10
    assert found.plan.problem.startswith("no laser scan in")
    assert found.warnings[0].startswith("no transform from a base frame to toposens")


def test_why_sonar_is_not_used(report):
    reason = "sonar is not used: no transform from a base frame to the sonars sonar_0 (--sonar-ring NAME or"
    assert report(sonar(0.0, 1.0), sonar(0.1, 1.0)).warnings[0].startswith(reason)
    usable = report(odom(0.0), scan(0.0), sonar(0.0, 1.0))
    assert usable.sonars == ()
    assert any(warning.startswith("sonar is not used") for warning in usable.warnings)


def test_sonar_rows_of_the_command(tmp_path, capsys):
    ring = tmp_path / "mine.yaml"
    ring.write_text("field_of_view_deg: 20\nrange_max: 3\nsonars: [[0, 0, 0], [0, 0, 90]]\n")
    sweeps = [range_array(k / 20, [3.0, 1.0 + k // 4 / 50]) for k in range(160)]
    path = write_ros2(tmp_path / "run", [odom(0.0), scan(0.0), *sweeps])
    assert main(["inspect", str(path), "--sonar-topic", "/sonar_array", "--sonar-ring", str(ring)]) == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "sonar /sonar_array 160 messages, every 50.0 ms" in text
    assert "2 sonars, ring mine, limits 0 to 3 m" in text
    assert "each measures every 0.20 s" in text
    assert "map would use scans /scan, odometry /odom sonar /sonar_array, ring mine" in text


def test_a_wrong_wish_is_told_as_map_would(tmp_path, capsys):
    path = write_ros1(tmp_path / "run.bag", [odom(0.0), scan(0.0), range_array(0.1, [1.0])])
    assert main(["inspect", str(path), "--sonar-ring", "pionier-2dx"]) == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "map would stop unknown sonar ring 'pionier-2dx' did you mean 'pioneer-2dx'?" in text


def test_sonar_of_a_second_file_that_is_unknown(tmp_path, capsys):
    path = write_ros1(tmp_path / "run.bag", [odom(0.0), scan(0.0)])
    (tmp_path / "sonar.txt").write_text("hello\n")
    assert main(["inspect", str(path), "--sonar", str(tmp_path / "sonar.txt")]) == 1
    assert capsys.readouterr().err == (
        f"error: {tmp_path / 'sonar.txt'} is no recording known here"
        " (sonar is read from ROS bags, mcap, Player logs and the text logs of pi-map)\n"
    )


def test_many_topics_are_shortened(tmp_path, capsys):
    mounts = [tf(0.0, "base_link", f"s{k}", (0.1 * k, 0.0, 0.0), topic="/tf_static") for k in range(5)]
    ranges = [sonar(0.1, 1.0 + k, topic=f"/s{k}", frame=f"s{k}") for k in range(5)]
    path = write_ros1(tmp_path / "run.bag", [*mounts, odom(0.0), scan(0.0), *ranges])
    assert main(["inspect", str(path)]) == 0
    assert "sonar /s0 ... /s4 (5 topics)" in " ".join(capsys.readouterr().out.split())
