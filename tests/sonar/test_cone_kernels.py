"""Readings entered cell by cell, against naive twins."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sonar_worlds import naive_belief, naive_beliefs

from glassslam.sonar.cone_kernels import (
    belief,
    box,
    enter_centre_lines,
    enter_masses,
    enter_means,
    enter_odds,
    mixed,
)

SHAPE = (24, 30)
HALF = math.radians(15.0)


def readings(seed, count=5):
    """Random readings in and around a grid of 24 x 30 cells, some of them without an obstacle."""
    random = np.random.default_rng(seed)
    table = np.empty((count, 6))
    table[:, 0], table[:, 1] = random.uniform(-3, 33, count), random.uniform(-3, 27, count)
    table[1, :2] = 15.0, 12.0  # at least one arc lies in the grid
    table[:, 2] = random.uniform(-7.0, 7.0, count)
    obstacle = random.uniform(2.0, 20.0, count)
    obstacle[1] = 7.0
    table[:, 5] = random.uniform(0.6, 2.0, count)
    table[:, 3], table[:, 4] = obstacle - table[:, 5], obstacle
    table[::3, 3:] = np.array([8.0, -1.0, 0.0])
    return table


many = pytest.mark.parametrize("seed", range(6))


@given(st.integers(0, 10**6))
@settings(max_examples=40)
def test_belief_is_that_of_its_naive_twin(seed):
    random = np.random.default_rng(seed)
    reading = readings(seed, 2)[1]
    x, y = random.uniform(-5, 35, 2)
    cosine, sine = math.cos(reading[2]), math.sin(reading[2])
    dx, dy = x - reading[0], y - reading[1]
    said = belief(cosine * dx + sine * dy, cosine * dy - sine * dx, HALF, *reading[3:6])
    assert said == pytest.approx(naive_belief(x, y, reading, HALF), abs=1e-9)


@given(st.integers(0, 10**6), st.floats(0.05, 1.5))
@settings(max_examples=60)
def test_the_box_holds_the_whole_cone(seed, half):
    reading = readings(seed, 2)[seed % 2]
    r0, r1, c0, c1 = box(reading, half, 10**6, 10**6)
    reach = max(reading[3], reading[4] + reading[5])
    for angle in np.linspace(-half, half, 25):
        for d in np.linspace(0.0, reach, 9):
            x, y = (
                reading[0] + d * math.cos(reading[2] + angle),
                reading[1] + d * math.sin(reading[2] + angle),
            )
            if x >= 0 and y >= 0:
                assert r0 <= math.floor(y + 1e-9)
                assert math.floor(y - 1e-9) <= r1
                assert c0 <= math.floor(x + 1e-9)
                assert math.floor(x - 1e-9) <= c1


@many
def test_masses_are_those_of_the_naive_twin(seed):
    table = readings(seed)
    full, empty = np.zeros(SHAPE), np.zeros(SHAPE)
    enter_masses(table, HALF, 0.6, 0.1, full, empty)
    said = naive_beliefs(table, HALF, SHAPE)
    assert full == pytest.approx(np.log(1.0 - 0.6 * np.maximum(said, 0.0)).sum(axis=0), abs=1e-9)
    assert empty == pytest.approx(np.log(1.0 + 0.1 * np.minimum(said, 0.0)).sum(axis=0), abs=1e-9)
    assert (full < 0).any()
    assert (empty < 0).any()


@many
def test_odds_are_those_of_the_naive_twin(seed):
    table = readings(seed)
    odds = np.full(SHAPE, np.nan)
    enter_odds(table, HALF, 0.6, 0.1, 1.2, odds)
    expected = np.full(SHAPE, np.nan)
    for said in naive_beliefs(table, HALF, SHAPE):
        p = 0.5 + 0.5 * said * np.where(said > 0, 0.6, 0.1)
        after = np.clip(np.nan_to_num(expected) + np.log(p / (1.0 - p)), -1.2, 1.2)
        expected = np.where(said != 0, after, expected)
    assert odds == pytest.approx(expected, abs=1e-9, nan_ok=True)
    assert np.isnan(odds).any()
    assert (odds > 0).any()


@many
def test_means_are_those_of_the_naive_twin(seed):
    table, values = readings(seed), np.linspace(0.3, 0.9, 5)
    cells = np.full(SHAPE, np.nan)
    enter_means(table, HALF, values, 0.7, 0.3, cells)
    expected = np.full(SHAPE, np.nan)
    for said, value in zip(naive_beliefs(table, HALF, SHAPE), values, strict=True):
        new = np.where(said > 0, value, 0.0)
        expected = np.where(
            said != 0, np.where(np.isnan(expected), new, 0.7 * expected + 0.3 * new), expected
        )
    assert cells == pytest.approx(expected, abs=1e-9, nan_ok=True)


def test_a_centre_line_marks_its_end_and_clears_what_is_before():
    cells = np.full((3, 8), np.nan)
    reading = np.array([[0.5, 1.5, 0.0, 4.0, 5.0, 1.0]])
    enter_centre_lines(reading, np.array([0.8]), 0.5, 0.5, cells)
    expected = np.full((3, 8), np.nan)
    expected[1, :5], expected[1, 5] = 0.0, 0.8
    assert cells == pytest.approx(expected, nan_ok=True)


def test_a_centre_line_without_obstacle_only_clears():
    cells = np.full((1, 8), np.nan)
    enter_centre_lines(np.array([[0.5, 0.5, 0.0, 3.0, -1.0, 0.0]]), np.zeros(1), 0.5, 0.5, cells)
    assert cells[0, :4].tolist() == [0, 0, 0, 0]
    assert np.isnan(cells[0, 4:]).all()


@given(st.floats(-3.1, 3.1), st.floats(0.5, 12.0))
def test_a_centre_line_enters_each_cell_once_and_ends_at_the_obstacle(yaw, length):
    cells = np.full((30, 30), 0.5)
    enter_centre_lines(np.array([[15.2, 15.3, yaw, length, length, 0.5]]), np.array([1.0]), 0.5, 0.5, cells)
    end = math.floor(15.3 + length * math.sin(yaw)), math.floor(15.2 + length * math.cos(yaw))
    assert set(np.unique(cells)) <= {0.25, 0.5, 0.75}
    assert np.argwhere(cells == 0.75).tolist() == [list(end)]


def test_a_centre_line_that_leaves_the_grid_is_cut():
    cells = np.full((1, 4), np.nan)
    enter_centre_lines(np.array([[1.5, 0.5, 0.0, 9.0, 10.0, 1.0]]), np.ones(1), 0.5, 0.5, cells)
    assert cells[0, 1:].tolist() == [0, 0, 0]


def test_mixing_takes_the_first_value_as_it_is_and_never_exceeds_1():
    assert mixed(math.nan, 0.4, 0.5, 0.5) == 0.4
    assert mixed(0.8, 0.4, 0.75, 0.25) == pytest.approx(0.7)
    assert mixed(1.0, 1.0, 0.9, 0.9) == 1.0
