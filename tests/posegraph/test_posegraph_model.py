"""Residuals and losses of the generated kernels against the formula and against finite differences."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pose_worlds import naive_error, naive_loss

from glassslam.posegraph.linearise_kernels import (
    GEMAN_MCCLURE,
    HUBER,
    NO_LOSS,
    residual_and_jacobians,
    robust,
)
from glassslam.posegraph.storage import KINDS

CODES = {"none": NO_LOSS, "huber": HUBER, "geman_mcclure": GEMAN_MCCLURE}
coordinate = st.floats(-20, 20)
angle = st.floats(-7, 7)
pose = st.tuples(coordinate, coordinate, angle).map(np.array)
matrix = st.lists(st.floats(-5, 5), min_size=9, max_size=9).map(lambda v: np.array(v).reshape(3, 3))


def split(a, b, z, w):
    full = np.array(residual_and_jacobians(a, b, z, w))
    return full[:3], full[3:12].reshape(3, 3).T, full[12:].reshape(3, 3).T


def near_the_cut(a, b, z):
    return abs(abs(naive_error(a, b, z)[2]) - math.pi) < 1e-3


@given(pose, pose, pose, matrix)
def test_the_residual_is_the_weighted_error(a, b, z, w):
    if near_the_cut(a, b, z):
        return
    np.testing.assert_allclose(split(a, b, z, w)[0], w @ naive_error(a, b, z), atol=1e-9)


@given(pose, pose, pose, matrix)
def test_the_jacobians_are_those_of_finite_differences(a, b, z, w):
    if near_the_cut(a, b, z):
        return
    _, by_a, by_b = split(a, b, z, w)
    h = 1e-6
    for column in range(3):
        d = np.zeros(3)
        d[column] = h
        slope_a = w @ (naive_error(a + d, b, z) - naive_error(a - d, b, z)) / (2 * h)
        slope_b = w @ (naive_error(a, b + d, z) - naive_error(a, b - d, z)) / (2 * h)
        np.testing.assert_allclose(by_a[:, column], slope_a, atol=1e-6)
        np.testing.assert_allclose(by_b[:, column], slope_b, atol=1e-6)


@pytest.mark.parametrize("turns", [-3, -1, 0, 1, 3])
def test_whole_turns_do_not_count(turns):
    a, b, z = np.zeros(3), np.array([1.0, 0.0, 3.0 + 2 * np.pi * turns]), np.array([1.0, 0.0, -3.0])
    residual = split(a, b, z, np.eye(3))[0]
    assert residual[2] == pytest.approx(2 * np.pi - 6.0, abs=1e-12)


@given(st.floats(0, 1e4), st.floats(0.1, 30), st.sampled_from(sorted(CODES)), st.sampled_from(KINDS))
def test_the_loss_is_the_textbook_one_and_spares_all_but_closures(s, k, loss, kind):
    rho, weight = robust(s, KINDS.index(kind), CODES[loss], k)
    assert rho == pytest.approx(naive_loss(s, kind, loss, k), rel=1e-12)
    assert 0.0 <= weight <= 1.0 + 1e-15
    if kind != "loop":
        assert (rho, weight) == (s, 1.0)


@given(st.floats(1e-3, 1e4), st.floats(0.1, 30), st.sampled_from(sorted(CODES)))
def test_the_weight_is_the_slope_of_the_loss(s, k, loss):
    if abs(s - k * k) < 1e-3 * k * k:
        return
    h = 1e-5 * s
    kind = KINDS.index("loop")
    up, down = robust(s + h, kind, CODES[loss], k)[0], robust(s - h, kind, CODES[loss], k)[0]
    assert robust(s, kind, CODES[loss], k)[1] == pytest.approx((up - down) / (2 * h), rel=1e-5, abs=1e-9)


@pytest.mark.parametrize("loss", sorted(CODES))
def test_a_perfect_closure_has_full_weight_and_no_cost(loss):
    assert robust(0.0, KINDS.index("loop"), CODES[loss], 2.0) == (0.0, 1.0)


def test_geman_mcclure_saturates():
    assert robust(1e12, KINDS.index("loop"), GEMAN_MCCLURE, 3.0) == pytest.approx((9.0, 0.0), abs=1e-8)
