"""Which readings of a ring are new, and which say that nothing answered."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from glassslam.sources.rings import load_ring
from glassslam.sources.sweeps import SweepFilter, SweepRule, repeat_cycle, sweep_rule

INF, NAN = np.inf, np.nan
PLAIN = SweepRule(range_min=0.1, limit=5.0)
PIONEER = load_ring("pioneer-3dx")


def read(rule, rows, step=0.1):
    """Readings of consecutive messages, as lists."""
    rows = np.array(rows, dtype=np.float32)
    feed = SweepFilter(rule, rows.shape[1])
    return [feed.read(1e9 + k * step, row).tolist() for k, row in enumerate(rows)]


def test_silence_and_senseless_ranges():
    (row,) = read(PLAIN, [[4.999, 5.0, 81.0, INF, 0.05, 0.0, -1.0, -INF, NAN]])
    assert row[1:4] == [INF, INF, INF]
    assert np.isnan(row[4:]).all()
    assert row[0] == np.float32(4.999)


def test_without_a_cycle_every_message_counts():
    assert read(PLAIN, [[1.0], [1.0], [1.0]]) == [[1.0], [1.0], [1.0]]


def test_a_repeated_range_counts_again_when_the_sonar_had_time_to_fire():
    rule = SweepRule(range_min=0.1, limit=5.0, cycle=0.32)
    rows = read(rule, [[1.0]] * 9)
    assert [row[0] == 1.0 for row in rows] == [True, False, False, False, True, False, False, False, True]


def test_a_changed_range_counts_at_once():
    rule = SweepRule(range_min=0.1, limit=5.0, cycle=0.32)
    rows = read(rule, [[1.0], [1.0], [2.0], [2.0]])
    np.testing.assert_array_equal(np.ravel(rows), [1.0, NAN, 2.0, NAN])


def test_sonars_repeat_one_by_one():
    rule = SweepRule(range_min=0.1, limit=5.0, cycle=0.32)
    rows = read(rule, [[1.0, 2.0, 5.0], [1.0, 2.1, 5.0], [1.1, 2.1, 5.0]])
    np.testing.assert_array_equal(rows, np.float32([[1.0, 2.0, INF], [NAN, 2.1, NAN], [1.1, NAN, NAN]]))


def test_the_very_same_message_sent_again():
    feed = SweepFilter(PLAIN, 1)
    row = np.float32([1.0])
    assert [feed.read(stamp, row)[0] == 1.0 for stamp in (3.0, 3.0, 4.0)] == [True, False, True]


def test_a_ring_that_holds_still_for_seconds_is_not_measuring():
    """A driver that repeats itself while the robot drives on would smear a wall along the path."""
    rows = read(PLAIN, [[1.0, 2.0, 5.0]] * 60 + [[1.0, 2.2, 5.0]])
    told = [not np.isnan(row).all() for row in rows]
    assert told == [True] * 31 + [False] * 29 + [True]
    np.testing.assert_array_equal(rows[-1], np.float32([1.0, 2.2, INF]))


def test_one_sonar_may_see_the_same_for_long():
    """A single echo may stay the same along a wall: with the others moving or silent, it is believed."""
    assert read(PLAIN, [[1.0, 5.0]] * 60)[-1] == [1.0, INF]
    moving = [[1.0, 2.0 + 0.01 * (k % 2)] for k in range(60)]
    assert read(PLAIN, moving)[-1][0] == 1.0


def test_before_the_first_echo_a_ring_is_not_on():
    rule = SweepRule(range_min=0.1, limit=5.0, waits_for_first_echo=True)
    rows = read(rule, [[5.0, 5.0], [5.0, 5.0], [5.0, 2.0], [5.0, 5.0]])
    assert np.isnan(rows[:2]).all()
    assert rows[2:] == [[INF, 2.0], [INF, INF]]


def test_sonars_a_message_does_not_tell_of():
    rows = read(PLAIN, [[1.0, NAN], [NAN, 2.0], [1.0, NAN]])
    np.testing.assert_array_equal(rows, np.float32([[1.0, NAN], [NAN, 2.0], [1.0, NAN]]))


def firing(cycle, period, sonars=16, seconds=60.0, seed=0):
    """Messages every `period` s of sonars that fire one after the other and never measure the same twice."""
    rng = np.random.default_rng(seed)
    times = np.arange(0.0, seconds, period)
    phase = np.arange(sonars) / sonars * cycle
    shots = np.floor((times[:, None] - phase) / cycle).astype(int)
    values = rng.uniform(0.5, 4.5, (sonars, shots.max() + 2)).astype(np.float32)
    return times, values[np.arange(sonars), shots + 1], shots


@pytest.mark.parametrize(("cycle", "period"), [(0.32, 0.1), (0.4, 0.05), (1.0, 0.1), (0.2, 0.02)])
def test_the_firing_cycle_is_read_off_the_changes(cycle, period):
    times, ranges, _ = firing(cycle, period)
    assert repeat_cycle([(times, ranges)]) == pytest.approx(cycle, rel=0.02)


@pytest.mark.parametrize("period", [0.04, 0.1, 0.32])
def test_no_cycle_where_every_message_measures(period):
    times, ranges, _ = firing(period, period)
    assert repeat_cycle([(times, ranges)]) == 0.0


def test_no_cycle_without_changes():
    times = np.arange(100) * 0.1
    assert repeat_cycle([(times, np.ones((100, 4), dtype=np.float32))]) == 0.0
    assert repeat_cycle([]) == 0.0
    assert repeat_cycle([(times, np.full((100, 4), INF, dtype=np.float32))]) == 0.0


def test_exactly_the_first_message_of_every_shot_is_new():
    times, ranges, shots = firing(0.32, 0.1)
    rule = sweep_rule(PIONEER, [(times, ranges)])
    feed = SweepFilter(rule, 16)
    readings = np.array([feed.read(time, row) for time, row in zip(times, ranges, strict=True)])
    np.testing.assert_array_equal(~np.isnan(readings[1:]), np.diff(shots, axis=0) != 0)


def test_the_value_of_silence_is_found_below_the_limit_of_the_ring():
    times, ranges, _ = firing(0.1, 0.1)
    ranges[ranges > 2.5] = 3.0
    rule = sweep_rule(PIONEER, [(times, ranges)])
    assert (rule.range_min, rule.limit, rule.cycle) == (0.1, 3.0, 0.0)


@given(
    arrays(np.float32, (12, 3), elements=st.sampled_from([NAN, INF, -INF, 0.0, 0.5, 1.0, 4.0, 5.0, 9.0])),
    st.sampled_from([0.0, 0.32]),
    st.booleans(),
)
def test_a_reading_is_the_range_silence_or_nothing(rows, cycle, waits):
    for before, after in zip(rows, read(SweepRule(0.1, 5.0, cycle, waits), rows), strict=True):
        for raw, new in zip(before.tolist(), after, strict=True):
            assert np.isnan(new) or (new == raw and 0.1 <= raw < 5.0) or (new == INF and raw >= 5.0)
