"""Gradient matching: steps, the loop around them, and the two solvers."""

import math
import subprocess
import sys
import threading

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matching_worlds import NOTHING, apart, cost_of, mapped, naive_residuals, random_grid, scan_from, slopes
from scipy.optimize import minimize

from glassslam.errors import GridError
from glassslam.grid import ProbabilityGrid
from glassslam.matching import match_scan
from glassslam.matching.kernels import (
    FIRST_DAMPING,
    LONGEST_STEP,
    align,
    linearise,
    newton_step,
    objective,
    prior_cost,
    solve_symmetric,
)

TRUE = np.array([0.3, -0.4, 0.7])
TIGHT = {"tolerance": 1e-9, "max_iterations": 200}
numbers = st.floats(-3, 3)
matrices = st.lists(numbers, min_size=9, max_size=9).map(lambda v: np.array(v).reshape(3, 3))
vectors = st.lists(numbers, min_size=3, max_size=3).map(np.array)
SOLVERS = ["lm", "casadi"]


@given(matrices, vectors)
def test_solve_symmetric_solves(a, b):
    positive = a @ a.T + 0.1 * np.eye(3)
    step = np.empty(3)
    assert solve_symmetric(positive, b, step)
    np.testing.assert_allclose(step, np.linalg.solve(positive, b), rtol=1e-6, atol=1e-9)


@given(matrices)
def test_solve_symmetric_refuses_what_is_not_positive_definite(a):
    symmetric = a + a.T
    if np.abs(np.linalg.eigvalsh(symmetric)).min() < 1e-6:
        return
    positive = np.linalg.eigvalsh(symmetric)[0] > 0
    assert solve_symmetric(symmetric, np.ones(3), np.empty(3)) == positive


@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan])
@pytest.mark.parametrize("axis", range(3))
def test_solve_symmetric_refuses_a_bad_diagonal(axis, bad):
    a = np.eye(3)
    a[axis, axis] = bad
    assert not solve_symmetric(a, np.ones(3), np.empty(3))


@given(vectors, vectors, vectors)
def test_prior_cost(pose, prediction, prior):
    assert prior_cost(pose, prediction, prior) == pytest.approx(float(prior @ (pose - prediction) ** 2))


def step_of(
    hessian, curvature, gradient, damping=0.0, away=(0.0, 0.0, 0.0), weight=0.5, prior=(1.0, 2.0, 3.0)
):
    step, system = np.empty(3), np.empty((3, 3))
    right = -weight * gradient - np.array(prior) * away
    arrays = (hessian, curvature, gradient)
    assert newton_step(*arrays, weight, np.array(prior), np.array(away), damping, system, step)
    np.testing.assert_allclose(system @ step, right, rtol=1e-6, atol=1e-8)
    return step


@given(matrices, vectors, vectors, st.floats(0, 100))
def test_a_step_solves_the_damped_equations(a, g, away, damping):
    hessian, curvature, prior = a @ a.T + np.eye(3), 0.1 * np.eye(3), np.array([1.0, 2.0, 3.0])
    gradient, away = 1e-3 * g, 1e-3 * away
    scale = np.diag(0.5 * np.diag(hessian) + prior)
    system = 0.5 * (hessian + curvature) + np.diag(prior) + damping * scale
    expected = np.linalg.solve(system, -0.5 * gradient - prior * away)
    np.testing.assert_allclose(step_of(hessian, curvature, gradient, damping, away), expected, atol=1e-8)


def gauss_newton(hessian, gradient):
    system = 0.5 * hessian + np.diag([1.0, 2.0, 3.0])
    return np.linalg.solve(system + FIRST_DAMPING * np.diag(np.diag(system)), -0.5 * gradient)


def test_where_the_surface_curves_the_wrong_way_the_step_is_gauss_newtons():
    hessian, gradient = np.diag([4.0, 5.0, 6.0]), np.array([0.02, 0.01, -0.03])
    step = step_of(hessian, -100.0 * np.eye(3), gradient)
    np.testing.assert_allclose(step, gauss_newton(hessian, gradient), rtol=1e-6)
    assert step @ gradient < 0


@pytest.mark.parametrize("axis", range(3))
def test_a_long_step_is_not_trusted(axis):
    hessian, gradient = np.diag([4.0, 5.0, 6.0]), np.zeros(3)
    curvature = -0.9 * (hessian + 2 * np.diag([1.0, 2.0, 3.0]))
    gradient[axis] = 1.0
    newton = np.linalg.solve(0.5 * (hessian + curvature) + np.diag([1.0, 2.0, 3.0]), -0.5 * gradient)
    assert abs(newton[axis]) > LONGEST_STEP
    np.testing.assert_allclose(
        step_of(hessian, curvature, gradient), gauss_newton(hessian, gradient), rtol=1e-6
    )


@given(matrices, matrices, vectors, vectors, st.floats(0, 10))
def test_no_step_is_longer_than_the_surface_is_trusted(a, b, gradient, away, damping):
    step = step_of(a @ a.T, b + b.T, 1e3 * gradient, damping, away)
    assert np.abs(step).max() <= LONGEST_STEP * (1 + 1e-9)


def test_a_long_way_is_gone_in_its_direction():
    hessian, gradient = np.diag([4.0, 5.0, 6.0]), np.array([30.0, -10.0, 1.0])
    step, whole = step_of(hessian, np.zeros((3, 3)), gradient), gauss_newton(hessian, gradient)
    np.testing.assert_allclose(step, whole * LONGEST_STEP / np.abs(whole).max(), rtol=1e-6)


def aligned(grid, points, prediction, prior=(0.0, 0.0, 0.0), weight=1.0, tolerance=1e-9, iterations=100):
    pose, information = np.empty(3), np.empty((3, 3))
    cost, used = align(
        grid.cells, grid.table, grid.origin, 1 / grid.resolution, points, np.array(prediction, float),
        np.array(prior), weight, iterations, pose, information, tolerance,
    )  # fmt: skip
    return pose, cost, information, used


PRIOR = np.array([0.3, 0.3, 0.1])


def test_the_loop_finds_the_minimum_an_optimiser_finds_from_the_formula():
    grid, points = mapped(), scan_from(TRUE, 40)
    start = np.add(TRUE, [0.03, -0.02, 0.01])
    pose, cost, _, _ = aligned(grid, points, start, PRIOR, 0.02)
    expected = minimize(
        lambda p: cost_of(grid, points, p, start, PRIOR, 0.02), start, method="Nelder-Mead",
        options={"xatol": 1e-7, "fatol": 1e-13, "initial_simplex": start + 0.03 * np.eye(4, 3)},
    )  # fmt: skip
    assert cost == pytest.approx(cost_of(grid, points, pose, start, PRIOR, 0.02), rel=1e-9)
    assert cost == pytest.approx(expected.fun, rel=1e-8)
    np.testing.assert_allclose(pose, expected.x, atol=1e-4)


@given(st.tuples(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), st.floats(-0.1, 0.1)))
def test_the_loop_ends_where_the_cost_is_level_and_not_above_the_start(shift):
    grid, points, start = mapped(), scan_from(TRUE, 60), TRUE + shift
    pose, cost, _, _ = aligned(grid, points, start, PRIOR, 1 / 60)
    assert cost <= cost_of(grid, points, start, start, PRIOR, 1 / 60) + 1e-12
    out = np.empty(13)
    objective(
        grid.cells, grid.table, grid.origin, 1 / grid.resolution, points, start, PRIOR, 1 / 60, pose, out
    )
    assert out[0] == pytest.approx(cost)
    np.testing.assert_allclose(out[1:4], 0.0, atol=1e-4)


def test_the_loose_default_comes_close_to_the_minimum():
    grid, points = mapped(), scan_from(TRUE, 180)
    for shift in ([0.05, 0.0, 0.0], [0.0, -0.05, 0.02], [-0.03, 0.04, -0.02]):
        exact = aligned(grid, points, TRUE + shift, PRIOR, 1 / 180)[0]
        loose, _, _, used = aligned(grid, points, TRUE + shift, PRIOR, 1 / 180, tolerance=1e-3)
        distance, turn = apart(exact, loose)
        assert distance < 2e-4
        assert turn < 1e-4
        assert used <= 6


def test_the_default_tolerance_is_the_loose_one():
    grid, points = mapped(), scan_from(TRUE, 90)
    pose, information = np.empty(3), np.empty((3, 3))
    arguments = (grid.cells, grid.table, grid.origin, 20.0, points, TRUE + 0.02, PRIOR, 1 / 90, 20)
    cost, used = align(*arguments, pose, information)
    again = aligned(grid, points, TRUE + 0.02, PRIOR, 1 / 90, 1e-3, 20)
    assert (cost, used) == (again[1], again[3])


def test_the_information_is_that_of_the_residuals_alone():
    grid, points = mapped(), scan_from(TRUE, 60)
    pose, _, information, _ = aligned(grid, points, TRUE + 0.01, [5.0, 5.0, 5.0], 0.5)
    jacobian = slopes(lambda p: naive_residuals(grid, points, p), pose)
    np.testing.assert_allclose(information, 0.5 * jacobian.T @ jacobian, rtol=1e-5, atol=1e-5)


def test_without_an_iteration_the_prediction_stays():
    grid, points = mapped(), scan_from(TRUE, 60)
    pose, cost, information, used = aligned(grid, points, TRUE + 0.02, iterations=0)
    assert pose.tolist() == (TRUE + 0.02).tolist()
    assert used == 0
    assert cost == pytest.approx((naive_residuals(grid, points, TRUE + 0.02) ** 2).sum())
    assert information.any()


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("place", [[50.0, 0.0, 0.0], [math.nan, 0.0, 0.0]])
def test_a_scan_outside_of_the_grid_stays_where_it_was_predicted(solver, place):
    result = match_scan(mapped(), scan_from(TRUE, 60), np.array(place), solver=solver)
    np.testing.assert_array_equal(result.pose, place)
    assert not result.information.any()


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("points", [NOTHING, []])
def test_a_scan_without_points_stays_where_it_was_predicted(solver, points):
    result = match_scan(mapped(), points, TRUE, solver=solver)
    assert result.pose.tolist() == TRUE.tolist()
    assert result.residual == 0.0


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_scan_in_an_empty_grid_stays_where_it_was_predicted(solver):
    result = match_scan(ProbabilityGrid(), scan_from(TRUE, 60), TRUE, solver=solver)
    assert result.pose.tolist() == TRUE.tolist()
    assert result.residual == pytest.approx(0.5)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("shift", [[0.05, -0.04, 0.02], [-0.08, 0.06, -0.03], [0.0, 0.1, 0.04]])
def test_the_room_tells_where_the_scan_was_taken(solver, shift):
    result = match_scan(mapped(), scan_from(TRUE, 180), TRUE + shift, solver=solver)
    distance, turn = apart(result.pose, TRUE)
    assert distance < 0.01
    assert turn < 0.004
    assert 0.05 < result.residual < 0.5
    np.testing.assert_array_equal(result.information, result.information.T)
    assert (np.linalg.eigvalsh(result.information) > 0).all()


starts = st.tuples(st.floats(-0.08, 0.08), st.floats(-0.08, 0.08), st.floats(-0.04, 0.04))


@given(starts, st.sampled_from([60, 180]), st.sampled_from([0.03, 0.5, 3.0]))
def test_both_solvers_find_the_same_pose(shift, beams, prior):
    grid, points = mapped(), scan_from(TRUE, beams, noise=0.01)
    weights = {"translation_weight": prior, "rotation_weight": prior}
    lm, casadi = (
        match_scan(grid, points, TRUE + shift, solver=solver, **weights, **TIGHT) for solver in SOLVERS
    )
    distance, turn = apart(lm.pose, casadi.pose)
    assert distance < 1e-5
    assert turn < 1e-5
    squares = [
        result.residual**2 + prior**2 * float(((result.pose - TRUE - shift) ** 2).sum())
        for result in (lm, casadi)
    ]
    assert squares[0] == pytest.approx(squares[1], rel=1e-7)
    np.testing.assert_allclose(lm.information, casadi.information, rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_strong_prior_holds_the_prediction(solver):
    start = np.add(TRUE, [0.05, 0.0, 0.0])
    result = match_scan(
        mapped(), scan_from(TRUE), start, translation_weight=1e3, rotation_weight=1e3, solver=solver
    )
    np.testing.assert_allclose(result.pose, start, atol=1e-4)


@pytest.mark.parametrize("solver", SOLVERS)
def test_the_weight_of_the_points_counts_against_the_prior_but_not_in_what_is_reported(solver):
    start, points = np.add(TRUE, [0.06, 0.0, 0.0]), scan_from(TRUE)
    prior = {"translation_weight": 5.0, "rotation_weight": 5.0, "solver": solver} | TIGHT
    weak, strong = (match_scan(mapped(), points, start, occupied_space_weight=w, **prior) for w in (0.3, 30))
    assert apart(weak.pose, start)[0] < apart(strong.pose, start)[0]
    for result in (weak, strong):
        residuals = naive_residuals(mapped(), points, result.pose)
        assert result.residual == pytest.approx(np.sqrt((residuals**2).mean()), rel=1e-6)


@pytest.mark.parametrize("solver", SOLVERS)
def test_along_a_corridor_only_the_prediction_tells(solver):
    points = scan_from(np.zeros(3), walls=[((-6, -1), (6, -1)), ((-6, 1), (6, 1))])
    result = match_scan(mapped(corridor=True), points, np.array([0.4, 0.05, 0.02]), solver=solver, **TIGHT)
    assert abs(result.pose[1]) < 0.01
    assert abs(result.pose[2]) < 0.003
    assert result.information[0, 0] < 0.1 * result.information[1, 1]


@pytest.mark.parametrize("solver", SOLVERS)
def test_the_prediction_is_not_changed_and_any_layout_will_do(solver):
    points, prediction = scan_from(TRUE), (TRUE + 0.02).copy()
    plain = match_scan(mapped(), points, prediction, solver=solver)
    other = match_scan(mapped(), np.asfortranarray(points), list(prediction), solver=solver)
    assert prediction.tolist() == (TRUE + 0.02).tolist()
    assert plain.pose.tolist() == other.pose.tolist()
    assert not np.shares_memory(plain.pose, prediction)


def test_the_same_match_twice_gives_the_same_bits():
    for solver in SOLVERS:
        results = [match_scan(mapped(), scan_from(TRUE), TRUE + 0.03, solver=solver) for _ in range(2)]
        assert results[0].pose.tobytes() == results[1].pose.tobytes()


def test_threads_do_not_share_a_solver():
    starts, points, found = [TRUE + 0.01 * k for k in range(4)], scan_from(TRUE), {}
    expected = [match_scan(mapped(), points, start, solver="casadi").pose for start in starts]

    def work(k):
        found[k] = [match_scan(mapped(), points, starts[k], solver="casadi").pose for _ in range(20)]

    threads = [threading.Thread(target=work, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for k, pose in enumerate(expected):
        assert all(other.tobytes() == pose.tobytes() for other in found[k])


@given(
    st.integers(0, 1000), st.tuples(st.floats(0.3, 2.0), st.floats(1.4, 3.0), st.floats(-3, 3)).map(np.array)
)
def test_the_objective_of_the_solver_is_the_cost_and_its_derivatives(seed, pose):
    grid, points = random_grid(np.random.default_rng(seed)), scan_from(np.zeros(3), 12) * 0.1
    prediction = np.add(pose, [0.1, -0.2, 0.05])

    def values(at):
        out = np.empty(13)
        objective(
            grid.cells, grid.table, grid.origin, 1 / grid.resolution, points, prediction, PRIOR, 0.2, at, out
        )
        return out

    out = values(pose)
    assert out[0] == pytest.approx(cost_of(grid, points, pose, prediction, PRIOR, 0.2))
    np.testing.assert_allclose(out[1:4], slopes(lambda p: values(p)[:1], pose)[0], atol=1e-6)
    hessian, exact = out[4:].reshape(3, 3), slopes(lambda p: values(p)[1:4], pose)
    assert (np.linalg.eigvalsh(hessian) > 0).all()
    lowest = np.linalg.eigvalsh(exact)[0]
    if lowest > 1e-3 and np.abs(np.linalg.solve(exact, out[1:4])).max() < 0.99 * LONGEST_STEP:
        np.testing.assert_allclose(hessian, exact, atol=1e-4)
    elif lowest < -1e-3:
        place, parts = (grid.cells, grid.table, grid.origin, 1 / grid.resolution), np.empty((2, 3, 3))
        linearise(*place, points, pose, *parts, np.empty(3))
        gauss_newton = 2 * (0.2 * parts[0] + np.diag(PRIOR))
        damped = gauss_newton + FIRST_DAMPING * np.diag(np.diag(gauss_newton))
        excess = np.abs(np.linalg.solve(damped, out[1:4])).max() / LONGEST_STEP
        np.testing.assert_allclose(hessian, damped * max(excess, 1.0), atol=1e-6, rtol=1e-6)


def test_an_unknown_solver_is_refused():
    with pytest.raises(GridError, match=r"^unknown solver 'ceres'$") as caught:
        match_scan(mapped(), scan_from(TRUE), TRUE, solver="ceres")
    assert caught.value.hint == "known are lm and casadi"


def test_points_of_another_shape_are_refused():
    with pytest.raises(GridError, match=r"^points of shape \(5, 3\)$"):
        match_scan(mapped(), np.zeros((5, 3)), TRUE)


def test_the_own_solver_needs_no_casadi():
    program = (
        "import sys, numpy as np, glassslam as gs; grid = gs.ProbabilityGrid(); "
        "grid.insert(np.zeros(2), np.ones((1, 2)), np.empty((0, 2))); "
        "gs.match_scan(grid, np.ones((1, 2)), np.zeros(3)); print('casadi' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"
