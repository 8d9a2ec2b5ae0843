"""Frames of a recording as drivers publish them by mistake."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parents[1] / "sources"))
from tiny_bags import odom, scan, tf, write_ros1

from glassslam import map_recording
from glassslam.cli import main
from glassslam.sources import open_recording

BEAMS = np.tile([2.0, 2.5, 3.0], 30)


def drive(*, frame="laser"):
    """Odometry and scans of a robot that creeps ahead."""
    angles = {"angle_min": -1.5, "angle_max": 1.5, "angle_increment": 3.0 / 89}
    return [
        message
        for k in range(20)
        for message in (odom(k / 10, 0.05 * k), scan(k / 10 + 0.01, BEAMS, frame=frame, **angles))
    ]


@pytest.fixture
def bag(tmp_path):
    def make(*extra, after=(), frame="laser"):
        (tmp_path / "run.bag").unlink(missing_ok=True)
        return write_ros1(tmp_path / "run.bag", [*extra, *drive(frame=frame), *after])

    return make


def mount(path):
    return open_recording(path).info.base_from_laser


def test_none_at_all_is_noted(bag):
    recording = open_recording(bag())
    assert recording.info.base_from_laser == (0.0, 0.0, 0.0)
    assert any("laser" in warning for warning in recording.warnings)


def test_one_that_comes_late_still_counts(bag):
    late = tf(1.9, "base_link", "laser", (0.3, 0.0, 0.2), topic="/tf_static")
    assert mount(bag(after=[late])) == pytest.approx((0.3, 0.0, 0.0))


def test_leading_slashes_of_old_recordings(bag):
    static = tf(0.0, "/base_link", "/laser", (0.3, 0.0, 0.0), topic="/tf_static")
    assert mount(bag(static, frame="/laser")) == pytest.approx((0.3, 0.0, 0.0))


@pytest.mark.parametrize("loop", [("laser", "base_link"), ("laser", "laser"), ("base_link", "base_link")])
def test_a_loop_ends(bag, loop):
    static = tf(0.0, "base_link", "laser", (0.3, 0.0, 0.0), topic="/tf_static")
    path = bag(static, tf(0.0, *loop, (5.0, 0.0, 0.0), topic="/tf_static"))
    assert np.isfinite(mount(path)).all()
    assert np.isfinite(map_recording(path).trajectory.poses).all()


def test_the_first_of_two_parents_is_believed_and_the_other_noted_or_harmless(bag):
    first = tf(0.0, "base_link", "laser", (0.3, 0.0, 0.0), topic="/tf_static")
    second = tf(0.0, "camera", "laser", (9.0, 0.0, 0.0), topic="/tf_static")
    assert mount(bag(first, second)) == pytest.approx((0.3, 0.0, 0.0))


def test_a_map_frame_from_another_slam_changes_nothing(bag, tmp_path):
    def poses(*extra):
        return map_recording(bag(*extra)).trajectory.poses

    jumping = [tf(k / 10, "map", "odom", (1.0 * k, -2.0 * k, 0.0), (0.0, 0.0, 0.3 * k)) for k in range(20)]
    np.testing.assert_array_equal(poses(*jumping), poses())


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e300])
def test_one_that_is_no_pose(bag, value, tmp_path, capsys):
    """What is not finite is no transform; a laser off every robot is refused in one line."""
    path = bag(tf(0.0, "base_link", "laser", (value, 0.0, 0.0), topic="/tf_static"))
    code = main(["map", str(path), "-o", str(tmp_path / "out"), "--quiet"])
    error = capsys.readouterr().err
    if np.isfinite(value):
        assert code == 1
        assert "error: the laser cannot sit at 1e+300, 0, 0" in error
    else:
        assert code == 0


def test_a_laser_pose_of_the_command_line_off_every_robot(bag, tmp_path, capsys):
    words = ["map", str(bag()), "-o", str(tmp_path / "out"), "--laser-pose", "150,0,0"]
    assert main(words) == 1
    assert "--laser-pose x,y,yaw" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
