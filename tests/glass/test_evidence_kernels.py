"""Counting beams along a line."""

import math

import numpy as np
import pytest
from glass_worlds import naive_counts
from hypothesis import given
from hypothesis import strategies as st

from glassslam.glass.evidence_kernels import count_along_line

BAND, BEYOND, LIMIT, STEP, BEFORE = 0.1, 0.25, math.radians(4.0), 0.1, 0.5


def count(poses, sensors, points, first, foot, direction, start, bins, chosen=None):
    solid, passed, normal, blocked = (np.zeros(bins, dtype=np.int64) for _ in range(4))
    chosen = np.arange(len(poses)) if chosen is None else chosen
    count_along_line(
        poses, sensors, points, first, chosen, foot, direction, start, STEP, BAND, BEYOND, LIMIT, BEFORE,
        solid, passed, normal, blocked,
    )  # fmt: skip
    return solid, passed, normal, blocked


def beams(*ends, sensor=(0.0, 0.0)):
    """What beams of one node at the origin count on the line y = 1, in ten pieces from x = 0 on."""
    points, first = np.array(ends, dtype=np.float32), np.array([0, len(ends)])
    line = (np.array([0.0, 1.0]), np.array([1.0, 0.0]), 0.0, 10)
    counted = count(np.zeros((1, 3)), np.array([sensor]), points, first, *line)
    return [table.tolist() for table in counted]


def pieces(**at):
    table = [0] * 10
    for name, value in at.items():
        table[int(name[1:])] = value
    return table


NONE = pieces()


@given(st.integers(0, 10**6), st.floats(-math.pi, math.pi))
def test_it_counts_as_its_naive_twin(seed, angle):
    random = np.random.default_rng(seed)
    lengths = random.integers(0, 12, 4)
    first = np.concatenate(([0], np.cumsum(lengths)))
    poses = random.uniform(-2.0, 2.0, (4, 3))
    sensors = random.uniform(-0.3, 0.3, (4, 2))
    points = random.uniform(-4.0, 4.0, (int(lengths.sum()), 2)).astype(np.float32)
    line = (random.uniform(-1.0, 1.0, 2), np.array([math.cos(angle), math.sin(angle)]), -2.0)
    expected = naive_counts(
        poses,
        sensors,
        points,
        first,
        *line,
        STEP,
        40,
        tolerance=BAND,
        beyond=BEYOND,
        limit=LIMIT,
        before=BEFORE,
    )
    for counted, naive in zip(count(poses, sensors, points, first, *line, 40), expected, strict=True):
        assert counted.tolist() == naive.tolist()


def test_a_return_on_the_line_is_solid_where_it_is():
    assert beams((0.55, 1.05), (0.55, 0.95), (0.25, 1.0)) == [pieces(p2=1, p5=2), NONE, NONE, NONE]


def test_a_beam_beyond_the_line_passed_where_it_crossed():
    assert beams((1.1, 2.0)) == [NONE, pieces(p5=1), NONE, NONE]


def test_a_beam_that_crossed_at_normal_incidence_counts_twice():
    assert beams((0.05, 2.0)) == [NONE, pieces(p0=1), pieces(p0=1), NONE]


@pytest.mark.parametrize("end", [(0.5, 0.4), (0.5, 1.2), (0.5, -2.0), (-1.0, 1.0), (9.0, 1.0)])
def test_other_beams_say_nothing(end):
    """Far short of the line, just behind it, away from it, before and after its pieces."""
    assert beams(end) == [NONE, NONE, NONE, NONE]


def test_the_beam_begins_at_the_laser_not_at_the_base():
    assert beams((0.55, 2.0), sensor=(0.55, 0.0)) == [NONE, pieces(p5=1), pieces(p5=1), NONE]


def test_only_the_chosen_nodes_count():
    poses, sensors = np.zeros((2, 3)), np.zeros((2, 2))
    points, first = np.array([[0.55, 1.0], [0.25, 1.0]], np.float32), np.array([0, 1, 2])
    line = (np.array([0.0, 1.0]), np.array([1.0, 0.0]), 0.0, 10)
    solid, *_ = count(poses, sensors, points, first, *line, chosen=np.array([1]))
    assert solid.tolist() == pieces(p2=1)


def test_a_beam_that_ends_just_before_the_line_is_blocked_where_it_would_have_crossed():
    assert beams((0.44, 0.8)) == [NONE, NONE, NONE, pieces(p5=1)]


def test_a_beam_on_its_way_along_or_away_from_the_line_is_not_blocked():
    assert beams((0.5, -0.2), (0.5, 0.6), sensor=(0.0, 0.6)) == [NONE, NONE, NONE, NONE]
