"""Odometry and yaw rates, asked for the time of a scan."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from glassslam.geometry import interpolate
from glassslam.records import Imu, Odometry
from glassslam.slam.odometry_track import OdometryTrack, YawTrack, mend_late_stamps

stamps = st.floats(0.0, 100.0).map(lambda v: round(v, 3))


def track_of(*rows):
    track = OdometryTrack()
    for stamp, x, y, theta in rows:
        track.add(Odometry(stamp, (x, y, theta)))
    return track


def mended(times, following):
    times = list(times)
    mend_late_stamps(times, following)
    return times


class TestMending:
    def test_one_late_stamp_moves_between_its_neighbours(self):
        assert mended([1.0, 2.0, 3.9], 3.0) == [1.0, 2.0, 2.5]

    def test_late_stamps_in_a_row_are_spread_evenly(self):
        assert mended([1.0, 2.0, 3.9, 3.7], 3.5) == [1.0, 2.0, 2.5, 3.0]

    def test_at_most_four_are_moved(self):
        assert mended([0.0, 9.0, 9.1, 9.2, 9.3], 5.0) == [0.0, 1.0, 2.0, 3.0, 4.0]
        five = [0.0, 9.0, 9.1, 9.2, 9.3, 9.4]
        assert mended(five, 5.0) == five

    def test_a_clock_that_was_set_back_is_left_alone(self):
        assert mended([3601.0, 3602.0, 3603.0], 2.0) == [3601.0, 3602.0, 3603.0]
        long = [3600.0 + k for k in range(20)]
        assert mended(long, 2.0) == long

    def test_equal_stamps_are_not_late(self):
        assert mended([1.0, 2.0, 2.0], 2.0) == [1.0, 2.0, 2.0]

    @given(st.lists(stamps, max_size=8).map(sorted), stamps)
    def test_rising_stamps_stay(self, times, ahead):
        following = (times[-1] if times else 0.0) + ahead
        assert mended(times, following) == times

    @given(st.lists(stamps, max_size=8), stamps)
    def test_only_late_stamps_at_the_end_change_and_then_rise_to_the_following(self, times, following):
        after = mended(times, following)
        changed = [k for k, (a, b) in enumerate(zip(times, after, strict=True)) if a != b]
        assert len(changed) <= 4
        assert all(times[k] > following for k in changed)
        if changed:
            tail = [*after[changed[0] :], following]
            assert changed == list(range(changed[0], len(times)))
            assert tail == sorted(tail)


class TestOdometryTrack:
    def test_poses_are_interpolated_with_the_heading_along_the_shorter_arc(self):
        track = track_of((1.0, 0.0, 0.0, 3.0), (2.0, 1.0, 2.0, -3.0))
        expected = [0.5, 1.0, -math.pi]
        np.testing.assert_allclose(track.pose_at(1.5), expected, atol=1e-12)

    def test_at_a_stamp_it_is_the_pose_itself(self):
        track = track_of((1.0, 0.1, 0.2, 0.3), (2.0, 0.4, 0.5, 0.6))
        np.testing.assert_allclose(track.pose_at(1.0), [0.1, 0.2, 0.3])
        np.testing.assert_array_equal(track.pose_at(2.0), [0.4, 0.5, 0.6])
        assert track.latest == 2.0
        np.testing.assert_array_equal(track.latest_pose, [0.4, 0.5, 0.6])

    def test_it_goes_on_with_the_last_velocity_for_half_a_second(self):
        track = track_of((1.0, 0.0, 0.0, math.pi / 2), (1.1, 0.0, 0.2, math.pi / 2))
        np.testing.assert_allclose(track.pose_at(1.6), [0.0, 1.2, math.pi / 2], atol=1e-12)
        assert track.pose_at(1.61) is None

    def test_without_a_recent_velocity_the_last_pose_holds(self):
        np.testing.assert_array_equal(track_of((1.0, 1, 2, 3)).pose_at(1.4), [1, 2, 3])
        assert track_of((1.0, 1, 2, 3)).pose_at(1.6) is None
        slow = track_of((1.0, 0, 0, 0), (2.0, 5, 0, 0))
        np.testing.assert_array_equal(slow.pose_at(2.4), [5, 0, 0])

    def test_before_the_first_pose_nothing_is_known(self):
        assert OdometryTrack().pose_at(1.0) is None
        assert OdometryTrack().latest_pose is None
        assert OdometryTrack().latest == -math.inf
        assert track_of((1.0, 0, 0, 0), (2.0, 1, 0, 0)).pose_at(0.999) is None

    def test_after_a_step_of_the_clock_the_newer_stretch_counts(self):
        long_ago = [(float(k), 0.0, 0.0, 0.0) for k in range(10, 30)]
        now = [(float(k), 7.0, 0.0, 0.0) for k in range(5, 15)]
        track = track_of(*long_ago, *now)
        assert track.pose_at(12.5)[0] == 7.0
        assert track.pose_at(14.3)[0] == 7.0
        assert track.pose_at(5.5)[0] == 7.0

    def test_a_late_pose_is_put_in_its_place(self):
        track = track_of((1.0, 1, 0, 0), (2.0, 2, 0, 0), (4.9, 3, 0, 0), (4.0, 4, 0, 0))
        np.testing.assert_allclose(track.pose_at(3.0), [3, 0, 0])

    @pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
    @pytest.mark.parametrize("place", range(4))
    def test_what_is_not_finite_is_left_out_and_counted(self, bad, place):
        row = [3.0, 1.0, 2.0, 0.5]
        row[place] = bad
        track = track_of((1.0, 0, 0, 0), row, (2.0, 1, 0, 0))
        assert (len(track), track.dropped) == (2, 1)
        np.testing.assert_allclose(track.pose_at(1.5), [0.5, 0, 0])

    def test_silence_counts_from_the_start_and_to_the_end_as_well(self):
        track = track_of((1.0, 0, 0, 0), (2.0, 0, 0, 0), (6.0, 0, 0, 0))
        assert track.longest_silence(0.5, 2.5) == pytest.approx(1.0)
        assert track.longest_silence(1.5, 7.0) == pytest.approx(4.0)
        assert track.longest_silence(6.0, 9.0) == pytest.approx(3.0)
        assert OdometryTrack().longest_silence(1.0, 9.0) == pytest.approx(8.0)

    def test_fast_odometry_reaches_back_to_slow_scans(self):
        track = track_of(*((0.001 * k, 0.001 * k, 0.0, 0.0) for k in range(16_000)))
        np.testing.assert_allclose(track.pose_at(0.5), [0.5, 0.0, 0.0], atol=1e-9)

    def test_memory_does_not_grow_with_time(self):
        track = track_of(*((float(k), float(k), 0.0, 0.0) for k in range(100_000)))
        assert len(track) <= 40_000
        np.testing.assert_allclose(track.pose_at(90_000.5), [90_000.5, 0, 0])
        assert track.pose_at(0.5) is None

    @given(st.lists(stamps, min_size=2, max_size=30, unique=True).map(sorted), st.floats(0, 1))
    def test_rising_stamps_interpolate_like_numpy(self, times, share):
        track = track_of(*((t, k, -k, 0.0) for k, t in enumerate(times)))
        stamp = times[0] + share * (times[-1] - times[0])
        expected = np.interp(stamp, times, np.arange(len(times)))
        np.testing.assert_allclose(track.pose_at(stamp), [expected, -expected, 0.0], atol=1e-9)

    @given(st.lists(stamps, min_size=1, max_size=40), stamps)
    def test_any_stamps_agree_with_a_search_from_the_newest(self, times, stamp):
        rows = [(t, float(k), 0.0, 0.0) for k, t in enumerate(times)]
        actual = track_of(*rows).pose_at(stamp)
        kept = []
        for t in times:
            mend_late_stamps(kept, t)
            kept.append(t)
        assume(stamp < kept[-1])  # extrapolated otherwise, see above
        expected = None
        for k in range(len(kept) - 2, -1, -1):
            if kept[k] <= stamp < kept[k + 1]:
                fraction = (stamp - kept[k]) / (kept[k + 1] - kept[k])
                expected = interpolate(np.array(rows[k][1:]), np.array(rows[k + 1][1:]), fraction)
                break
        if expected is None:
            assert actual is None
        else:
            np.testing.assert_array_equal(actual, expected)


def yaw_of(*rows):
    track = YawTrack()
    for stamp, rate in rows:
        track.add(Imu(stamp, rate))
    return track


class TestYawTrack:
    def test_rates_add_up_to_a_heading(self):
        track = yaw_of((1.0, 0.5), (1.2, 0.5), (1.4, -1.0), (1.5, 0.0))
        turned = track.angle_at(1.5) - track.angle_at(1.0)
        assert turned == pytest.approx(0.5 * 0.2 + -1.0 * 0.2 + 0.0 * 0.1)

    def test_between_and_after_stamps_the_last_rate_goes_on(self):
        track = yaw_of((1.0, 0.5), (1.2, 2.0))
        assert track.angle_at(1.1) - track.angle_at(1.0) == pytest.approx(0.05)
        assert track.angle_at(1.5) - track.angle_at(1.2) == pytest.approx(0.6)

    def test_nothing_is_known_before_the_first_rate_and_half_a_second_after_the_last(self):
        track = yaw_of((1.0, 0.5), (1.2, 2.0))
        assert track.angle_at(0.99) is None
        assert track.angle_at(1.71) is None
        assert YawTrack().angle_at(1.0) is None

    def test_late_and_not_finite_rates_are_left_out_and_counted(self):
        clean = yaw_of((1.0, 0.5), (1.2, 0.5))
        track = yaw_of(
            (1.0, 0.5), (1.0, 9.0), (0.9, 9.0), (1.1, math.nan), (math.nan, 1.0), (math.inf, 1.0), (1.2, 0.5)
        )
        assert track.dropped == 5
        assert track.angle_at(1.3) == clean.angle_at(1.3)

    def test_no_turn_is_assumed_in_a_gap(self):
        track = yaw_of((1.0, 3.0), (61.0, 3.0))
        assert track.angle_at(61.0) == track.angle_at(1.0)

    def test_after_the_clock_was_set_back_the_heading_goes_on(self):
        track = yaw_of((1000.0, 1.0), (1000.2, 1.0), (5.0, 1.0), (5.2, 1.0))
        assert track.angle_at(5.0) == pytest.approx(0.2)
        assert track.angle_at(5.2) == pytest.approx(0.4)
        assert track.dropped == 0

    def test_memory_does_not_grow_with_time(self):
        track = yaw_of(*((0.1 * k, 1.0) for k in range(50_000)))
        assert track.angle_at(0.0) is None
        assert track.angle_at(4999.9) == pytest.approx(4999.9)
