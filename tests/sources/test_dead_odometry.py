"""Odometry that stands still all through a recording of a robot that drives is not used."""

import math

import numpy as np
import pytest
from test_carmen import flaser
from test_carmen import odom as carmen_odom
from tiny_bags import imu, odom, scan, tf

from glassslam.records import LaserScan, Odometry
from glassslam.sources import SourceOptions, open_recording

COUNT = 80
BEAMS = 90


def seen(x):
    """Ranges of a half circle in a room 6 m wide and 10 m long, x m from its far end."""
    bearings = np.linspace(-math.pi / 2, math.pi / 2, BEAMS)
    ahead = x / np.maximum(np.cos(bearings), 1e-6)
    return np.minimum(ahead, 3.0 / np.maximum(np.abs(np.sin(bearings)), 1e-6))


def moving(k):
    return seen(8.0 - 0.08 * k)


def standing(k):
    ranges = seen(8.0)
    begin = 7 * k % 80
    ranges[begin : begin + 10] = 0.7  # people walk by
    return ranges


def scans(ranges):
    geometry = {"angle_min": -math.pi / 2, "angle_max": math.pi / 2, "angle_increment": math.pi / BEAMS}
    mount = tf(0.0, "base_link", "laser", topic="/tf_static")
    return [mount, *(scan(0.1 * k, ranges(k), **geometry) for k in range(COUNT))]


def wheels(pose=lambda k: 0.0):
    return [odom(0.1 * k, pose(k)) for k in range(COUNT)]


def count(recording, kind=Odometry):
    return sum(isinstance(record, kind) for record in recording.records())


def test_it_is_not_used_and_a_warning_says_so(any_bag):
    recording = any_bag(*scans(moving), *wheels())
    assert recording.info.odom_topic == ""
    assert recording.warnings == [
        "/odom is not used: it stands still all the time while the scans change",
    ]
    assert (count(recording), count(recording, LaserScan)) == (0, COUNT)


def test_neither_is_a_transform(any_bag):
    links = [tf(0.1 * k, "odom", "base_link", (1.0, 2.0, 0.0)) for k in range(COUNT)]
    recording = any_bag(*scans(moving), *links)
    assert recording.info.odom_topic == ""
    assert recording.warnings == [
        "tf:odom->base_link is not used: it stands still all the time while the scans change",
    ]


def test_records_of_one_and_the_same_time_are_judged_as_well(ros1):
    sent = [type(one)(one.topic, one.msgtype, 1.0, one.build) for one in (*scans(moving), *wheels())]
    assert ros1(*sent).info.odom_topic == ""


def test_a_robot_that_stands_is_believed(any_bag):
    recording = any_bag(*scans(standing), *wheels())
    assert (recording.info.odom_topic, recording.warnings) == ("/odom", [])
    assert count(recording) == COUNT


@pytest.mark.parametrize("pose", [lambda k: 0.1 * (k == 40), lambda k: 1e-6 * k])
def test_odometry_that_moves_at_all_is_believed(ros1, pose):
    recording = ros1(*scans(moving), *wheels(pose))
    assert (recording.info.odom_topic, recording.warnings) == ("/odom", [])


def test_so_is_one_that_the_user_names(ros1):
    recording = ros1(*scans(moving), *wheels(), odom_topic="/odom")
    assert (recording.info.odom_topic, recording.warnings) == ("/odom", [])


def test_a_dead_imu_beside_it_is_told_too(ros1):
    recording = ros1(*scans(moving), *wheels(), *(imu(0.1 * k, (0.0, 0.0, 0.0)) for k in range(5)))
    assert (recording.info.odom_topic, recording.info.imu_topic) == ("", "")
    assert len(recording.warnings) == 2


class TestCarmen:
    def log(self, tmp_path, ranges, robot=(0.0, 0.0, 0.0), others=(), **options):
        lines = [flaser(0.1 * k, ranges(k), robot=robot) for k in range(COUNT)]
        path = tmp_path / "run.log"
        path.write_text("\n".join([*lines, *others]) + "\n")
        return open_recording(path, SourceOptions(**options))

    def test_it_is_not_used(self, tmp_path):
        recording = self.log(tmp_path, moving)
        assert recording.info.odom_topic == ""
        assert recording.warnings == [
            "the odometry in FLASER lines is not used: it stands still all the time while the scans change"
        ]
        assert count(recording) == 0

    def test_dead_odom_lines_change_nothing(self, tmp_path):
        recording = self.log(tmp_path, moving, others=[carmen_odom(0.1 * k) for k in range(COUNT)])
        assert recording.info.odom_topic == ""

    def test_odom_lines_that_move_are_used_in_its_place(self, tmp_path):
        others = [carmen_odom(0.1 * k, (0.1 * k, 0.0, 0.0)) for k in range(COUNT)]
        recording = self.log(tmp_path, moving, others=others)
        assert (recording.info.odom_topic, recording.warnings) == ("ODOM", [])

    def test_a_robot_that_stands_is_believed(self, tmp_path):
        recording = self.log(tmp_path, standing)
        assert (recording.info.odom_topic, recording.warnings) == ("FLASER", [])

    def test_so_is_one_that_the_user_names(self, tmp_path):
        assert self.log(tmp_path, moving, odom_topic="FLASER").info.odom_topic == "FLASER"
