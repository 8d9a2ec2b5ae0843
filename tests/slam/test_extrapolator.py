"""Where the next scan is expected."""

import math

import numpy as np
import pytest

from glassslam.geometry import compose, inverse
from glassslam.records import Imu, Odometry
from glassslam.slam.extrapolator import PoseExtrapolator
from glassslam.slam.tracking import Event

START = np.array([5.0, 1.0, math.pi / 2])


def moving(motion, *, period=0.1, odometry=None):
    """An extrapolator after two scans, `motion` apart in the frame of the base, ending at START."""
    extrapolator = PoseExtrapolator()
    extrapolator.add_pose(1.0 - period, compose(START, inverse(np.array(motion))), None)
    extrapolator.add_pose(1.0, START, None if odometry is None else np.array(odometry, dtype=np.float64))
    return extrapolator


def test_the_first_scan_is_expected_at_zero():
    expected = PoseExtrapolator().predict(7.0, np.array([3.0, 4.0, 1.0]))
    np.testing.assert_array_equal(expected.pose_in_local, np.zeros(3))
    np.testing.assert_array_equal(expected.twist, np.zeros(3))
    assert not expected.measured
    assert expected.after_gap


def test_odometry_moves_the_last_pose_by_what_the_wheels_measured():
    extrapolator = moving((0.0, 0.0, 0.0), odometry=(0.0, 0.0, 0.0))
    expected = extrapolator.predict(1.1, np.array([0.2, 0.0, 0.05]))
    np.testing.assert_allclose(expected.pose_in_local, [5.0, 1.2, math.pi / 2 + 0.05])
    np.testing.assert_allclose(expected.twist, [2.0, 0.0, 0.5])
    assert expected.distance == pytest.approx(0.2)
    assert expected.rotation == pytest.approx(0.05)
    assert expected.measured
    assert not expected.after_gap


def test_odometry_is_asked_before_the_velocity():
    extrapolator = moving((0.05, 0.0, 0.0), odometry=(0.0, 0.0, 0.0))
    np.testing.assert_allclose(extrapolator.predict(1.1, np.zeros(3)).pose_in_local, START)


def test_without_odometry_the_last_velocity_goes_on():
    expected = moving((0.1, 0.0, 0.02)).predict(1.2, None)
    np.testing.assert_allclose(expected.pose_in_local, [5.0, 1.2, math.pi / 2 + 0.04])
    np.testing.assert_allclose(expected.twist, [1.0, 0.0, 0.2], atol=1e-9)
    assert not expected.measured


def test_odometry_that_was_unknown_at_the_last_scan_says_nothing_yet():
    expected = moving((0.1, 0.0, 0.0)).predict(1.1, np.array([40.0, 2.0, 0.0]))
    np.testing.assert_allclose(expected.pose_in_local, [5.0, 1.1, math.pi / 2])
    assert not expected.measured


@pytest.mark.parametrize("stamp", [1.7, 30.0, 1.0, 0.5])
def test_velocity_ends_with_a_gap_and_does_not_go_backwards(stamp):
    expected = moving((0.1, 0.0, 0.02)).predict(stamp, None)
    np.testing.assert_array_equal(expected.pose_in_local, START)
    np.testing.assert_array_equal(expected.twist, np.zeros(3))
    assert expected.after_gap


@pytest.mark.parametrize("period", [0.7, 0.005, 0.0, -0.1])
def test_no_velocity_is_told_from_scans_too_far_apart_or_too_close(period):
    expected = moving((0.1, 0.0, 0.02), period=period).predict(1.1, None)
    np.testing.assert_array_equal(expected.pose_in_local, START)


def test_yaw_rates_turn_what_the_velocity_moves():
    extrapolator = PoseExtrapolator()
    for k in range(30):
        extrapolator.add_imu(Imu(0.8 + 0.01 * k, 1.5))
    extrapolator.add_pose(0.9, compose(START, inverse(np.array([0.1, 0.0, 0.0]))), None)
    extrapolator.add_pose(1.0, START, None)
    expected = extrapolator.predict(1.1, None)
    np.testing.assert_allclose(expected.pose_in_local, [5.0, 1.1, math.pi / 2 + 0.15])
    assert not expected.measured


def test_yaw_rates_alone_turn_a_robot_without_velocity():
    extrapolator = PoseExtrapolator()
    for k in range(300):
        extrapolator.add_imu(Imu(0.8 + 0.01 * k, 0.5))
    extrapolator.add_pose(1.0, START, None)
    np.testing.assert_allclose(extrapolator.predict(2.0, None).pose_in_local, START + np.array([0, 0, 0.5]))


class TestAlternative:
    def test_odometry_that_agrees_with_the_velocity_has_none(self):
        extrapolator = moving((0.1, 0.0, 0.02), odometry=(0, 0, 0))
        assert extrapolator.predict(1.1, np.array([0.12, 0.0, 0.0])).alternative is None

    @pytest.mark.parametrize("claimed", [(0, 0, 0), (0.9, 0, 0), (0.2, 0, 0.2)])
    def test_frozen_and_jumping_odometry_is_confronted_with_the_velocity(self, claimed):
        extrapolator = moving((0.2, 0.0, 0.02), odometry=(0, 0, 0))
        expected = extrapolator.predict(1.1, np.array(claimed, dtype=np.float64))
        np.testing.assert_allclose(expected.alternative, [5.0, 1.2, math.pi / 2 + 0.02])
        np.testing.assert_allclose(expected.pose_in_local, compose(START, np.array(claimed)))

    def test_without_velocity_there_is_none(self):
        extrapolator = PoseExtrapolator()
        extrapolator.add_pose(1.0, START, np.zeros(3))
        assert extrapolator.predict(1.1, np.array([2.0, 0, 0])).alternative is None


class TestJumps:
    def test_odometry_that_is_reset_says_nothing_for_one_step(self):
        extrapolator = moving((0.1, 0.0, 0.0), odometry=(80.0, 20.0, 1.0))
        expected = extrapolator.predict(1.1, np.zeros(3))
        np.testing.assert_allclose(expected.pose_in_local, [5.0, 1.1, math.pi / 2])
        assert not expected.measured
        assert extrapolator.jumps == 1
        extrapolator.add_pose(1.1, expected.pose_in_local, np.zeros(3))
        again = extrapolator.predict(1.2, np.array([0.1, 0.0, 0.0]))
        np.testing.assert_allclose(again.pose_in_local, [5.0, 1.2, math.pi / 2])
        assert again.measured
        assert extrapolator.jumps == 1

    def test_after_a_gap_a_robot_may_be_far(self):
        extrapolator = moving((0.1, 0.0, 0.0), odometry=(0, 0, 0))
        expected = extrapolator.predict(31.0, np.array([60.0, 0.0, 0.0]))
        np.testing.assert_allclose(expected.pose_in_local, [5.0, 61.0, math.pi / 2])
        assert expected.after_gap

    def test_where_stamps_stand_still_a_few_metres_are_possible(self):
        extrapolator = moving((0.1, 0.0, 0.0), odometry=(0, 0, 0))
        assert extrapolator.predict(1.0, np.array([0.5, 0.0, 0.0])).measured
        assert not extrapolator.predict(1.0, np.array([3.1, 0.0, 0.0])).measured


class TestSweeps:
    """A scan undistorted with a wrong velocity fits where its middle is right."""

    PERIOD = 0.1

    def run(self, error, scans):
        """Velocities of a robot that stands while the first is wrong, m/s."""
        extrapolator = PoseExtrapolator()
        extrapolator.add_pose(-self.PERIOD, np.array([-error * self.PERIOD, 0.0, 0.0]), None)
        extrapolator.add_pose(0.0, np.zeros(3), None)
        velocities = []
        for k in range(1, scans):
            expected = extrapolator.predict(k * self.PERIOD, None)
            velocities.append(expected.twist[0])
            fitted = -expected.twist * self.PERIOD / 2
            extrapolator.add_pose(k * self.PERIOD, fitted, None, self.PERIOD / 2, expected.twist)
        return velocities

    def test_a_wrong_velocity_is_forgotten(self):
        velocities = self.run(1.0, 8)
        assert velocities[0] == pytest.approx(1.0)
        assert np.abs(velocities[4:]).max() < 0.01

    def test_a_steady_velocity_is_kept(self):
        extrapolator = PoseExtrapolator()
        twist = np.array([0.4, 0.0, 0.3])
        pose = np.zeros(3)
        for k in range(6):
            extrapolator.add_pose(k * self.PERIOD, pose, None, self.PERIOD / 2, twist)
            pose = compose(pose, twist * self.PERIOD)
        expected = extrapolator.predict(6 * self.PERIOD, None)
        np.testing.assert_allclose(expected.twist, twist, atol=3e-3)
        np.testing.assert_allclose(expected.pose_in_local, pose, atol=1e-3)

    def test_with_odometry_the_pose_stays_as_matched(self):
        extrapolator = PoseExtrapolator()
        for k in range(3):
            matched = np.array([0.1 * k, 0.0, 0.0])
            extrapolator.add_pose(k * 0.1, matched, matched, 0.05, np.array([3.0, 0.0, 0.0]))
        expected = extrapolator.predict(0.3, np.array([0.25, 0.0, 0.0]))
        np.testing.assert_allclose(expected.pose_in_local, [0.25, 0.0, 0.0])


class TestBreaks:
    """After which the robot may be anywhere."""

    def after(self, *stamps, odometry=()):
        """An extrapolator that has seen scans, and odometry in between."""
        extrapolator = PoseExtrapolator()
        for stamp in odometry:
            extrapolator.add_odometry(Odometry(stamp, (0.1 * stamp, 0.0, 0.0)))
        for stamp in stamps:
            extrapolator.add_pose(stamp, np.array([0.1 * stamp, 0.0, 0.0]), None)
        return extrapolator

    @pytest.mark.parametrize(
        ("stamp", "event"),
        [
            (10.2, Event.NONE),
            (15.0, Event.NONE),
            (15.2, Event.GAP),
            (1e9, Event.GAP),
            (9.2, Event.NONE),
            (9.0, Event.CLOCK_BACK),
            (-3600.0, Event.CLOCK_BACK),
        ],
    )
    def test_long_silence_and_clocks_that_are_set(self, stamp, event):
        assert self.after(9.9, 10.0, 10.1).predict(stamp, None).event == event

    def test_the_first_scan_follows_nothing(self):
        assert PoseExtrapolator().predict(5.0, None).event == Event.NONE

    def test_a_slow_recording_is_not_silent(self):
        slow = self.after(0.0, 8.0, 16.0)
        assert slow.predict(24.0, None).event == Event.NONE
        assert slow.predict(100.0, None).event == Event.GAP

    def test_odometry_that_goes_on_knows_the_way(self):
        wheels = np.arange(9.0, 40.0, 0.5)
        assert self.after(10.0, 10.1, odometry=wheels).predict(30.0, None).event == Event.NONE
        assert self.after(10.0, 10.1, odometry=[9.0, 10.0, 30.0]).predict(30.0, None).event == Event.GAP

    def test_a_robot_drives_on_while_its_clock_is_set(self):
        expected = self.after(10.0, 10.1).predict(-3600.0, None)
        np.testing.assert_allclose(expected.pose_in_local, [1.02, 0.0, 0.0])

    def test_odometry_from_zero_again_says_nothing_of_the_break(self):
        extrapolator = PoseExtrapolator()
        for k in range(2):
            extrapolator.add_pose(10.0 + 0.1 * k, np.array([3.0, 4.0, 0.0]), np.array([9.0, 9.0, 1.0]))
        expected = extrapolator.predict(60.0, np.zeros(3))
        np.testing.assert_allclose(expected.pose_in_local, [3.0, 4.0, 0.0])
        assert not expected.measured
        assert extrapolator.predict(60.0, np.array([9.5, 9.0, 1.0])).measured

    def test_a_jump_of_the_odometry_is_an_event(self):
        extrapolator = PoseExtrapolator()
        extrapolator.add_pose(10.0, np.zeros(3), np.zeros(3))
        assert extrapolator.predict(10.1, np.array([50.0, 0.0, 0.0])).event == Event.ODOMETRY_JUMP
        assert extrapolator.predict(10.1, np.array([0.1, 0.0, 0.0])).event == Event.NONE
