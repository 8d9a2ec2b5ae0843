"""Straight surfaces in the successive readings of one sonar."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize
from sonar_worlds import LEFT

from glassslam.sonar.surface_kernels import COLUMNS, fit_surface, surface_pieces

HALF = math.radians(15.0)


def drive(count, wall_angle=0.0, distance=1.0, step=0.08, axis=LEFT, pause=0.3):
    """Readings (stamp, x, y, axis, range) of a sonar driven along x past a wall turned by `wall_angle`."""
    x = step * np.arange(count)
    normal = LEFT + wall_angle
    ranges = distance * math.sin(normal) - x * math.cos(normal)
    return np.column_stack((pause * np.arange(count), x, np.zeros(count), np.full(count, axis), ranges))


def fitted(readings, weight=1e-6):
    out = np.empty(COLUMNS)
    fit_surface(readings, 0, len(readings) - 1, weight, out)
    return out


def pieces(readings, min_readings=4, max_span=0.5, max_residual=0.02, max_pause=1.0):
    table = np.empty((len(readings) + 2, COLUMNS))
    count = surface_pieces(readings, 1e-3, HALF, max_pause, max_span, max_residual, min_readings, table)
    return table[:count]


@given(st.floats(-0.2, 0.2), st.floats(0.4, 2.5))
def test_the_normal_of_a_wall_follows_from_the_change_of_the_range(wall_angle, distance):
    out = fitted(drive(8, wall_angle, distance))
    assert out[2] == pytest.approx(LEFT + wall_angle, abs=1e-3)
    assert out[3] == pytest.approx(distance * math.cos(wall_angle), abs=1e-3)
    assert out[4] < 1e-4


@given(st.integers(0, 10**6))
def test_the_fit_is_that_of_its_naive_twin(seed):
    random = np.random.default_rng(seed)
    readings = drive(9, random.uniform(-0.15, 0.15), 1.2)
    readings[:, 2] += random.normal(0.0, 0.02, 9)
    readings[:, 4] += random.normal(0.0, 0.01, 9)
    weight = 0.01
    s, r = readings[:, 1:3], readings[:, 4]

    def cost(x):
        residual = x[1] - s @ (math.cos(x[0]), math.sin(x[0])) - r
        return residual @ residual + weight * (x[0] - LEFT) ** 2

    naive = minimize(cost, [LEFT, 1.2], method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-15})
    assert fitted(readings, weight)[2:4] == pytest.approx(naive.x, abs=1e-4)


def test_a_sonar_that_stands_takes_its_axis_for_the_normal():
    readings = drive(6, step=0.0, axis=LEFT + 0.1)
    out = fitted(readings, weight=1e-3)
    assert out[2] == pytest.approx(LEFT + 0.1)
    assert out[5] == pytest.approx(0.0, abs=1e-12)


def test_a_long_wall_is_cut_into_pieces_of_the_span():
    found = pieces(drive(40))
    assert (found[:, 7] - found[:, 6] <= 0.5 + 1e-9).all()
    assert (found[:-1, 1] - found[:-1, 0]).tolist() == [6] * (len(found) - 1)
    assert found[0, 0] == 0
    assert found[1:, 0] == pytest.approx(found[:-1, 1] + 1)


@pytest.mark.parametrize(("count", "expected"), [(3, 0), (4, 1)])
def test_a_piece_needs_enough_readings(count, expected):
    assert len(pieces(drive(count))) == expected


def test_a_pause_ends_a_piece():
    readings = drive(10, step=0.02)
    readings[5:, 0] += 5.0
    assert pieces(readings)[:, :2].tolist() == [[0, 4], [5, 9]]


def test_a_step_in_the_surface_ends_a_piece():
    readings = drive(10, step=0.04)
    readings[5:, 4] -= 0.3
    assert pieces(readings)[:, :2].tolist() == [[0, 4], [5, 9]]


def test_readings_that_jump_about_make_no_piece():
    readings = drive(20)
    readings[:, 4] += np.where(np.arange(20) % 2, 0.4, 0.0)
    assert len(pieces(readings)) == 0


def test_a_surface_whose_normal_lies_outside_the_cone_makes_no_piece():
    assert len(pieces(drive(6, wall_angle=math.radians(25.0)))) == 0


def test_the_axis_may_be_given_as_any_turn():
    readings = drive(6)
    readings[:, 3] += 2.0 * np.pi
    assert len(pieces(readings)) == 1


def test_no_readings_make_no_piece():
    assert len(pieces(np.empty((0, 5)))) == 0
