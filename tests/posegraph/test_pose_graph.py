"""What a user of the pose graph can rely on."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pose_worlds import WEIGHT, copy_of, naive_cost, naive_error, square_walk, walk_graph, wrap
from scipy.optimize import least_squares

from glassslam.errors import GraphError
from glassslam.geometry import between
from glassslam.posegraph import Constraint, PoseGraph


def line(count, step=1.0):
    """Poses on a line, all at the origin at first, odometry of `step` between neighbours."""
    graph = PoseGraph()
    graph.add_poses(np.zeros((count, 3)))
    nodes = np.arange(count)
    graph.add_constraints(nodes[:-1], nodes[1:], np.tile([step, 0, 0], (count - 1, 1)), WEIGHT, "odometry")
    return graph


def scipy_optimum(graph, loss, scale):
    """Poses of least cost by a dense solver that knows nothing of the kernels."""
    constraints, start = graph.constraints, graph.poses
    norms = {
        "none": lambda n: n,
        "huber": lambda n: n if n <= scale else math.sqrt(2 * scale * n - scale * scale),
    }

    def residuals(x):
        poses = np.vstack((start[:1], x.reshape(-1, 3)))
        rows = []
        for c in constraints:
            r = c.sqrt_information @ naive_error(poses[c.a], poses[c.b], c.a_from_b)
            norm = np.linalg.norm(r)
            share = norms[loss](norm) / norm if c.kind == "loop" and norm > 0 else 1.0
            rows.append(r * share)
        return np.concatenate(rows)

    fit = least_squares(residuals, start[1:].ravel(), x_scale="jac", xtol=1e-14, ftol=1e-14, gtol=1e-12)
    return np.vstack((start[:1], fit.x.reshape(-1, 3))), fit.cost


@pytest.mark.parametrize("solver", ["lm", "casadi"])
@pytest.mark.parametrize("loss", ["none", "huber"])
def test_the_optimum_is_that_of_scipy(solver, loss):
    graph, _, _ = walk_graph(24, 6, outliers=1, seed=3)
    expected, cost = scipy_optimum(graph, loss, 3.0)
    report = graph.optimize(solver=solver, loss=loss, huber_scale=3.0, tolerance=1e-12)
    assert report.converged
    assert report.final_cost == pytest.approx(cost, rel=1e-7)
    np.testing.assert_allclose(graph.poses[:, :2], expected[:, :2], atol=1e-5)
    np.testing.assert_allclose(wrap(graph.poses[:, 2] - expected[:, 2]), 0, atol=1e-5)


@pytest.mark.parametrize("loss", ["none", "huber", "geman_mcclure"])
@pytest.mark.parametrize("seed", range(3))
def test_both_solvers_agree(loss, seed):
    graphs = [walk_graph(120, 60, outliers=3, seed=seed)[0] for _ in range(2)]
    first, second = (
        graph.optimize(solver=solver, loss=loss, huber_scale=3.0, tolerance=1e-10)
        for graph, solver in zip(graphs, ("lm", "casadi"), strict=True)
    )
    assert first.converged
    assert second.converged
    assert second.final_cost == pytest.approx(first.final_cost, rel=1e-7)
    difference = graphs[0].poses - graphs[1].poses
    assert np.abs(np.column_stack((difference[:, :2], wrap(difference[:, 2])))).max() < 1e-5


def test_the_report_tells_cost_and_residuals():
    graph, _, _ = walk_graph(40, 20, outliers=2)
    before = naive_cost(graph.poses, graph.constraints, "huber", 3.0)
    report = graph.optimize(huber_scale=3.0)
    assert report.initial_cost == pytest.approx(before, rel=1e-12)
    after = naive_cost(graph.poses, graph.constraints, "huber", 3.0)
    assert report.final_cost == pytest.approx(after, rel=1e-9)
    expected = [
        np.linalg.norm(c.sqrt_information @ naive_error(graph.poses[c.a], graph.poses[c.b], c.a_from_b))
        for c in graph.constraints
    ]
    np.testing.assert_allclose(report.residual_norms, expected, atol=1e-6)
    assert 0 < report.iterations < 50


@pytest.mark.parametrize("solver", ["lm", "casadi"])
def test_the_limit_of_iterations_is_kept_and_told(solver):
    graph, _, _ = walk_graph(40, 20, outliers=5)
    report = graph.optimize(max_iterations=1, solver=solver)
    assert report.iterations == 1
    assert not report.converged
    assert report.final_cost < report.initial_cost


def test_wrong_closures_do_not_bend_the_map():
    errors = {}
    for loss in ("none", "huber", "geman_mcclure"):
        graph, true, wrong = walk_graph(200, 100, outliers=5, seed=8)
        graph.optimize(loss="huber", huber_scale=2.0)
        report = graph.optimize(loss=loss, huber_scale=2.0)
        errors[loss] = np.hypot(*(graph.poses - true)[:, :2].T).max()
        if loss != "none":
            assert report.residual_norms[wrong].min() > 10
    clean = walk_graph(200, 100, seed=8)
    clean[0].optimize()
    reference = np.hypot(*(clean[0].poses - clean[1])[:, :2].T).max()
    assert errors["none"] > 5 * reference
    assert errors["huber"] < 2 * reference
    assert errors["geman_mcclure"] < 1.2 * reference


def test_the_same_graph_gives_the_same_bytes():
    results = set()
    for _ in range(3):
        graph, _, _ = walk_graph(100, 50, outliers=2)
        report = graph.optimize()
        results.add((graph.poses.tobytes(), report.residual_norms.tobytes(), report.final_cost))
    assert len(results) == 1


def test_growing_and_optimising_again_ends_where_optimising_once_does():
    full, _, _ = walk_graph(100, 60, outliers=2, seed=5)
    grown = PoseGraph()
    poses, constraints = full.poses, sorted(full.constraints, key=lambda c: max(c.a, c.b))
    added = 0
    for count in (25, 50, 75, 100):
        grown.add_poses(poses[len(grown.poses) : count])
        while added < len(constraints) and max(constraints[added].a, constraints[added].b) < count:
            grown.add_constraint(constraints[added])
            added += 1
        grown.optimize(tolerance=1e-12)
    full.optimize(tolerance=1e-12)
    np.testing.assert_allclose(grown.poses[:, :2], full.poses[:, :2], atol=1e-5)


def test_optimising_an_optimum_changes_next_to_nothing():
    graph, _, _ = walk_graph(100, 50)
    first = graph.optimize()
    poses = graph.poses
    second = graph.optimize()
    assert second.iterations == 1
    assert second.final_cost == pytest.approx(first.final_cost, rel=1e-7)
    np.testing.assert_allclose(graph.poses, poses, atol=1e-4)


def test_adding_in_bulk_is_adding_one_by_one():
    graph, _, _ = walk_graph(40, 20)
    other = copy_of(graph)
    graph.optimize()
    other.optimize()
    assert graph.poses.tobytes() == other.poses.tobytes()


def test_the_first_vertex_is_held_by_default():
    graph = line(5)
    graph.optimize()
    np.testing.assert_allclose(graph.poses[:, 0], np.arange(5), atol=1e-9)


def test_a_fixed_vertex_takes_the_place_of_the_first():
    graph = line(5)
    graph.set_fixed(3)
    graph.optimize()
    np.testing.assert_allclose(graph.poses[:, 0], np.arange(5) - 3.0, atol=1e-9)
    graph.set_fixed(3, False)
    graph.set_fixed(0)
    graph.optimize()
    np.testing.assert_allclose(graph.poses[:, 0], np.arange(5) - 3.0, atol=1e-9)


@pytest.mark.parametrize("solver", ["lm", "casadi"])
def test_two_fixed_vertices_share_the_strain(solver):
    graph = line(5)
    graph.set_poses(4, [[8.0, 0.0, 0.0]])
    graph.set_fixed(0)
    graph.set_fixed(4)
    graph.optimize(solver=solver)
    np.testing.assert_allclose(graph.poses[:, 0], 2.0 * np.arange(5), atol=1e-6)


@pytest.mark.parametrize("solver", ["lm", "casadi"])
def test_parts_without_connection_stay_where_they_are(solver):
    graph = line(3)
    alone = graph.add_pose((7.0, 8.0, 1.0))
    first = graph.add_poses([[50.0, 0.0, math.pi / 2], [60.0, 0.0, 0.0]])
    graph.add_constraint(Constraint(first, first + 1, np.array([1.0, 0.0, 0.0]), WEIGHT, "odometry"))
    assert graph.optimize(solver=solver).converged
    np.testing.assert_array_equal(graph.poses[alone], [7.0, 8.0, 1.0])
    np.testing.assert_array_equal(graph.poses[first], [50.0, 0.0, math.pi / 2])
    np.testing.assert_allclose(graph.poses[first + 1], [50.0, 1.0, math.pi / 2], atol=1e-8)


@pytest.mark.parametrize("solver", ["lm", "casadi"])
@pytest.mark.parametrize("count", [0, 1, 3])
def test_a_graph_without_constraints_is_its_own_optimum(solver, count):
    graph = PoseGraph()
    graph.add_poses(np.full((count, 3), 2.0))
    report = graph.optimize(solver=solver)
    assert (report.iterations, report.initial_cost, report.final_cost, report.converged) == (0, 0, 0, True)
    np.testing.assert_array_equal(graph.poses, np.full((count, 3), 2.0))


def test_a_direction_no_constraint_speaks_of_is_left_alone():
    graph = PoseGraph()
    graph.add_poses([[0.0, 0.0, 0.0], [5.0, 6.0, 0.3]])
    only_x = np.diag([1.0, 0.0, 0.0])
    graph.add_constraint(Constraint(0, 1, np.array([1.0, 0.0, 0.0]), only_x, "odometry"))
    assert graph.optimize().converged
    np.testing.assert_allclose(graph.poses[1], [1.0, 6.0, 0.3], atol=1e-5)


def test_parallel_constraints_add_up():
    graph = PoseGraph()
    graph.add_poses(np.zeros((2, 3)))
    for x, weight in ((1.0, 1.0), (2.0, math.sqrt(3.0))):
        graph.add_constraint(Constraint(0, 1, np.array([x, 0, 0]), weight * np.eye(3), "odometry"))
    graph.add_constraint(Constraint(1, 0, np.array([-1.75, 0, 0]), np.eye(3), "odometry"))
    graph.optimize()
    np.testing.assert_allclose(graph.poses[1], [1.75, 0, 0], atol=1e-8)


def test_a_disabled_constraint_has_no_say_but_keeps_its_residual():
    graph = line(3)
    closure = graph.add_constraint(Constraint(0, 2, np.array([9.0, 0, 0]), WEIGHT, "loop"))
    graph.set_enabled([closure], False)
    report = graph.optimize()
    np.testing.assert_allclose(graph.poses[2], [2, 0, 0], atol=1e-8)
    assert report.residual_norms[closure] == pytest.approx(7.0 * WEIGHT[0, 0])
    graph.set_enabled([closure], True)
    graph.optimize(loss="none")
    assert graph.poses[2, 0] > 3.0


def test_headings_end_within_one_turn():
    graph = PoseGraph()
    graph.add_poses([[0, 0, 0], [0, 0, 9.0]])
    graph.add_constraint(Constraint(0, 1, np.array([1.0, 0.0, 3.0]), WEIGHT, "odometry"))
    graph.optimize()
    np.testing.assert_allclose(graph.poses[1], [1.0, 0.0, 3.0], atol=1e-8)


@settings(max_examples=20)
@given(st.integers(0, 10**6), st.floats(-50, 50), st.floats(-50, 50), st.floats(-math.pi, math.pi))
def test_a_graph_of_exact_measurements_is_solved_exactly_wherever_it_lies(seed, x, y, theta):
    rng = np.random.default_rng(seed)
    from glassslam.geometry import compose

    true = compose(np.array([x, y, theta]), square_walk(30))
    graph = PoseGraph()
    start = true + rng.normal(size=true.shape) * [0.3, 0.3, 0.1]
    start[0] = true[0]
    graph.add_poses(start)
    nodes = np.arange(30)
    graph.add_constraints(nodes[:-1], nodes[1:], between(true[:-1], true[1:]), WEIGHT, "odometry")
    graph.add_constraints(nodes[:10], nodes[20:], between(true[:10], true[20:]), WEIGHT, "loop")
    assert graph.optimize().converged
    np.testing.assert_allclose(graph.poses[:, :2], true[:, :2], atol=1e-5)
    np.testing.assert_allclose(wrap(graph.poses[:, 2] - true[:, 2]), 0, atol=1e-6)


def test_poses_are_a_copy():
    graph = line(2)
    graph.poses[1] = 5.0
    np.testing.assert_array_equal(graph.poses[1], np.zeros(3))


def raises(message):
    return pytest.raises(GraphError, match=f"^{message}$")


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_numbers_that_are_not_finite_are_refused(value, axis):
    graph, bad = line(2), np.zeros(3)
    bad[axis] = value
    with raises("pose that is not finite"):
        graph.add_pose(bad)
    with raises("pose that is not finite"):
        graph.set_poses(0, [bad])
    with raises("constraint with a non-finite measurement or information"):
        graph.add_constraint(Constraint(0, 1, bad, WEIGHT, "loop"))
    with raises("constraint with a non-finite measurement or information"):
        graph.add_constraint(Constraint(0, 1, np.zeros(3), np.diag(bad), "loop"))
    assert (len(graph.poses), len(graph.constraints)) == (2, 1)


def test_what_makes_no_sense_is_refused_in_one_line():
    graph = line(2)
    with raises("constraint between vertices 0 and 2, but the graph has 2"):
        graph.add_constraints([0], [2], np.zeros((1, 3)), WEIGHT, "loop")
    with raises("constraint between vertices -1 and 0, but the graph has 2"):
        graph.add_constraints([-1], [0], np.zeros((1, 3)), WEIGHT, "loop")
    with raises("constraint from vertex 1 to itself"):
        graph.add_constraints([1], [1], np.zeros((1, 3)), WEIGHT, "loop")
    with raises("unknown kind of constraint 'glass'"):
        graph.add_constraints([0], [1], np.zeros((1, 3)), WEIGHT, "glass")
    with raises("no vertex 2: the graph has 2"):
        graph.set_fixed(2)
    with raises("no vertex 2: the graph has 2"):
        graph.set_poses(1, np.zeros((2, 3)))
    with raises("unknown loss 'cauchy'"):
        graph.optimize(loss="cauchy")
    with raises("unknown solver 'ceres'"):
        graph.optimize(solver="ceres")
    for scale in (0.0, -1.0, math.nan, math.inf):
        with raises(f"scale of the loss is {scale}"):
            graph.optimize(huber_scale=scale)
    graph.set_poses(1, [[1e300, 0, 0]])
    with raises("the cost of the pose graph is not finite"):
        graph.optimize()
