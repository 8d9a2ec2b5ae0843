"""Two streams brought together by time: who pairs, who comes alone, and when that is decided."""

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from glassslam.volume.pairing import ApproximateTime

stamps = st.lists(st.integers(0, 400), max_size=25, unique=True).map(lambda t: sorted(k / 100 for k in t))


def paired(first, second, slop=0.05):
    """Everything that comes out, in order, when both streams arrive by time."""
    pairing, out = ApproximateTime(slop), []
    for stamp, number in sorted([(t, 0) for t in first] + [(t, 1) for t in second]):
        out += (pairing.add_second if number else pairing.add_first)(stamp, stamp)
    return [*out, *pairing.finish()]


@given(stamps, stamps)
def test_everything_comes_out_once_in_the_order_of_its_stream(first, second):
    out = paired(first, second)
    assert [a for a, _ in out if a is not None] == first
    assert [b for _, b in out if b is not None] == second


@given(stamps, stamps)
def test_pairs_are_near_in_time_and_nobody_left_alone_fits_another_one_left_alone(first, second):
    out = paired(first, second)
    assert all(abs(a - b) <= 0.05 for a, b in out if a is not None and b is not None)
    alone_first = [a for a, b in out if b is None]
    alone_second = [b for a, b in out if a is None]
    for a, b in itertools.product(alone_first, alone_second):
        nearer_pairs = [p for p in out if None not in p and min(abs(p[0] - b), abs(p[1] - a)) <= abs(a - b)]
        assert abs(a - b) > 0.05 or nearer_pairs


@given(stamps)
def test_a_stream_alone_comes_out_whole(first):
    assert paired(first, []) == [(a, None) for a in first]
    assert paired([], first) == [(None, b) for b in first]


def test_the_nearest_partner_is_taken():
    assert paired([0.96, 1.0, 1.04], [1.01]) == [(0.96, None), (1.0, 1.01), (1.04, None)]


def test_a_lidar_twice_as_fast_pairs_with_every_second_scan():
    first, second = [k / 40 for k in range(8)], [0.003 + k / 20 for k in range(4)]
    out = paired(first, second, slop=0.01)
    assert [p for p in out if None not in p] == list(zip(first[::2], second, strict=True))
    assert [a for a, b in out if b is None] == first[1::2]


def test_a_partner_too_late_is_none():
    assert paired([1.0], [1.06]) == [(1.0, None), (None, 1.06)]


def test_what_cannot_change_any_more_is_given_out_at_once():
    pairing = ApproximateTime(0.05)
    assert list(pairing.add_first(1.0, "a")) == []
    assert list(pairing.add_second(1.01, "b")) == []
    assert list(pairing.add_first(1.1, "c")) == [("a", "b")]
    assert list(pairing.finish()) == [("c", None)]


def test_who_waits_for_a_silent_stream_does_not_wait_for_ever():
    pairing = ApproximateTime(0.05)
    out = [pair for k in range(100) for pair in pairing.add_first(0.1 * k, k)]
    assert out == [(k, None) for k in range(len(out))]
    assert len(out) == pytest.approx(100 - 11, abs=1)


def test_stamps_that_step_back_lose_nothing():
    pairing, out = ApproximateTime(0.05), []
    for stamp in (1.0, 1.1, 0.3, 0.4, 2.0):
        out += pairing.add_first(stamp, stamp)
        out += pairing.add_second(stamp + 0.01, -stamp)
    out += pairing.finish()
    assert sorted(a for a, _ in out if a is not None) == [0.3, 0.4, 1.0, 1.1, 2.0]
    assert sorted(-b for _, b in out if b is not None) == [0.3, 0.4, 1.0, 1.1, 2.0]
