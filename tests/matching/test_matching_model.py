"""The residual of one point and its derivatives, against the B-spline spelled out and finite differences."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matching_worlds import cubic, naive_residuals, random_grid, slopes, smooth

from glassslam.matching._generated import occupied_space
from glassslam.matching.kernels import linearise, normal_equations
from glassslam.matching.model import occupied_space_function, spline_weights, surface_derivatives

fraction = st.floats(0.0, 1.0, exclude_max=True)
seeds = st.integers(0, 10_000)
# within the grid of 17 x 14 cells of 0.25 m, away from its border
place = st.tuples(st.floats(-0.2, 2.2), st.floats(1.2, 3.2), st.floats(-7.0, 7.0)).map(np.array)
POINTS = np.array([[0.1, 0.05], [-0.2, 0.15], [0.0, -0.3], [0.25, 0.2]])


def weights(t):
    x = ca.SX.sym("x")
    return ca.Function("w", [x], [spline_weights(x)])(t).full().ravel()


@given(fraction)
def test_the_weights_are_those_of_the_cardinal_spline(t):
    np.testing.assert_allclose(weights(t), [cubic(t + 1), cubic(t), cubic(t - 1), cubic(t - 2)], atol=1e-14)
    assert weights(t).sum() == pytest.approx(1.0)


def test_value_slope_and_curvature_are_continuous_from_cell_to_cell():
    rng = np.random.default_rng(0)
    u, v, c = ca.SX.sym("u"), ca.SX.sym("v"), ca.SX.sym("c", 16)
    surface = ca.Function("s", [u, v, c], [surface_derivatives(u, v, c)])
    cells = rng.random((4, 5))
    left, right = cells[:, :4].ravel().tolist(), cells[:, 1:].ravel().tolist()
    at_end = surface(1.0, 0.3, ca.DM(left)).full()
    at_start = surface(0.0, 0.3, ca.DM(right)).full()
    order = np.add.outer(range(3), range(3)) <= 2
    np.testing.assert_allclose(at_end[order], at_start[order], atol=1e-12)


@given(seeds, fraction, fraction)
def test_the_surface_derivatives_are_those_of_finite_differences(seed, u0, v0):
    cells = np.random.default_rng(seed).random(16)
    u, v, c = ca.SX.sym("u"), ca.SX.sym("v"), ca.SX.sym("c", 16)
    surface = ca.Function("s", [u, v, c], [surface_derivatives(u, v, c)])

    def at(a, b):
        return surface(a, b, ca.DM(cells.tolist())).full()

    h = 1e-5
    by_u, by_v = (at(u0 + h, v0) - at(u0 - h, v0)) / (2 * h), (at(u0, v0 + h) - at(u0, v0 - h)) / (2 * h)
    m = at(u0, v0)
    np.testing.assert_allclose([m[0, 1], m[0, 2], m[1, 1]], [by_u[0, 0], by_u[0, 1], by_u[1, 0]], atol=1e-8)
    np.testing.assert_allclose([m[1, 0], m[2, 0], m[1, 1]], [by_v[0, 0], by_v[1, 0], by_v[0, 1]], atol=1e-8)


def test_the_function_has_the_outputs_the_kernel_unpacks():
    function = occupied_space_function()
    sizes = {function.name_out(i): function.numel_out(i) for i in range(function.n_out())}
    assert sizes == {"residual": 1, "gradient": 3, "hessian": 6}


def evaluated(grid, pose, point):
    """The kernel for one point of the scan, as `linearise` calls it."""
    turned = np.array([[np.cos(pose[2]), -np.sin(pose[2])], [np.sin(pose[2]), np.cos(pose[2])]]) @ point
    u, v = (turned + pose[:2] - grid.origin) / grid.resolution - 0.5
    i, j = int(u), int(v)
    cells = grid.table[grid.cells[j - 1 : j + 3, i - 1 : i + 3]].astype(float).ravel()
    return np.array(occupied_space(*turned, u - i, v - j, 1 / grid.resolution, *cells))


@given(seeds, place, st.sampled_from(list(POINTS)))
def test_the_residual_is_one_minus_the_smooth_grid(seed, pose, point):
    grid = random_grid(np.random.default_rng(seed))
    c, s = np.cos(pose[2]), np.sin(pose[2])
    x, y = c * point[0] - s * point[1] + pose[0], s * point[0] + c * point[1] + pose[1]
    assert evaluated(grid, pose, point)[0] == pytest.approx(1 - smooth(grid, x, y), abs=1e-12)


@given(seeds, place, st.sampled_from(list(POINTS)))
def test_the_jacobian_is_that_of_finite_differences(seed, pose, point):
    grid = random_grid(np.random.default_rng(seed))
    by_pose = slopes(lambda p: naive_residuals(grid, point[None], p), pose)
    np.testing.assert_allclose(evaluated(grid, pose, point)[1:4], by_pose[0], atol=1e-7)


@given(seeds, place, st.sampled_from(list(POINTS)))
def test_the_hessian_is_that_of_finite_differences_of_the_jacobian(seed, pose, point):
    grid = random_grid(np.random.default_rng(seed))
    by_pose = slopes(lambda p: evaluated(grid, p, point)[1:4], pose)
    np.testing.assert_allclose(evaluated(grid, pose, point)[4:], by_pose[np.triu_indices(3)], atol=2e-5)


def equations(grid, points, pose):
    """(cost, J^T J, sum r r'', J^T r)."""
    hessian, curvature, gradient = np.full((3, 3), 9.0), np.full((3, 3), 9.0), np.full(3, 9.0)
    cost = linearise(
        grid.cells, grid.table, grid.origin, 1 / grid.resolution, points, pose, hessian, curvature, gradient
    )
    return cost, hessian, curvature, gradient


@given(seeds, place)
def test_the_normal_equations_are_those_of_the_residuals_spelled_out(seed, pose):
    grid = random_grid(np.random.default_rng(seed))
    residuals = naive_residuals(grid, POINTS, pose)
    jacobian = slopes(lambda p: naive_residuals(grid, POINTS, p), pose)
    cost, hessian, _, gradient = equations(grid, POINTS, pose)
    assert cost == pytest.approx((residuals**2).sum())
    np.testing.assert_allclose(hessian, jacobian.T @ jacobian, atol=1e-6)
    np.testing.assert_allclose(gradient, jacobian.T @ residuals, atol=1e-6)


@given(seeds, place)
def test_both_parts_of_the_hessian_together_are_the_slope_of_the_gradient(seed, pose):
    grid = random_grid(np.random.default_rng(seed))
    _, hessian, curvature, _ = equations(grid, POINTS, pose)
    by_pose = slopes(lambda p: equations(grid, POINTS, p)[3], pose)
    np.testing.assert_allclose(hessian + curvature, by_pose, atol=2e-5)
    np.testing.assert_array_equal(curvature, curvature.T)


@given(seeds, place)
def test_the_short_form_gives_the_same(seed, pose):
    grid = random_grid(np.random.default_rng(seed))
    hessian, gradient = np.empty((3, 3)), np.empty(3)
    cost = normal_equations(
        grid.cells, grid.table, grid.origin, 1 / grid.resolution, POINTS, pose, hessian, gradient
    )
    full = equations(grid, POINTS, pose)
    assert cost == full[0]
    np.testing.assert_array_equal(hessian, full[1])
    np.testing.assert_array_equal(gradient, full[3])


@pytest.mark.parametrize("shift", [[50.0, 0.0, 0.0], [-50.0, 0.0, 0.0], [0.0, 50.0, 0.0], [0.0, -50.0, 0.0]])
@pytest.mark.parametrize("bad", [0.0, np.nan, 1e300])
def test_points_outside_cost_as_unknown_and_do_not_pull(shift, bad):
    grid = random_grid(np.random.default_rng(1))
    cost, hessian, curvature, gradient = equations(grid, POINTS + bad, np.array(shift))
    assert cost == pytest.approx(len(POINTS) * (1 - float(grid.table[0])) ** 2)
    assert not hessian.any()
    assert not curvature.any()
    assert not gradient.any()


def test_only_points_with_all_sixteen_cells_in_the_grid_are_taken():
    grid = random_grid(np.random.default_rng(2))
    rows, columns = grid.cells.shape
    corner, r = grid.origin, grid.resolution
    for u, v, taken in [
        (1.0, 1.0, True), (columns - 2 - 1e-9, rows - 2 - 1e-9, True), (1.0 - 1e-9, 5.0, False),
        (5.0, 1.0 - 1e-9, False), (columns - 2.0, 5.0, False), (5.0, rows - 2.0, False),
    ]:  # fmt: skip
        pose = np.array([*(corner + (np.array([u, v]) + 0.5) * r), 0.0])
        pose[:2] += 1e-12 if taken and u == 1.0 else 0.0
        assert equations(grid, np.zeros((1, 2)), pose)[1].any() == taken


def test_no_points_cost_nothing():
    assert equations(random_grid(np.random.default_rng(1)), np.empty((0, 2)), np.zeros(3))[0] == 0.0
