"""A solver that fails costs its improvement, never the map."""

import numpy as np
import pytest
from odd_runs import is_whole, length, plain, run

from glassslam.cli import main
from glassslam.errors import GraphError
from glassslam.matching import sqp
from glassslam.posegraph import PoseGraph, levenberg_marquardt
from glassslam.slam import global_slam


def broken(graph, *_, **__):
    raise GraphError("the solver has failed")


def test_poses_that_are_not_finite_are_not_taken_over(monkeypatch):
    graph = PoseGraph()
    graph.add_poses([[0.0, 0.0, 0.0], [1.1, 0.0, 0.0]])
    graph.add_constraints([0], [1], np.array([[1.0, 0.0, 0.0]]), np.eye(3)[None], "odometry")
    minimise = levenberg_marquardt.minimise

    def lost(system, poses, *limits):
        solution = minimise(system, poses, *limits)
        solution.poses[:] = np.nan
        return solution

    monkeypatch.setattr(levenberg_marquardt, "minimise", lost)
    with pytest.raises(GraphError, match="the solver found poses that are not finite"):
        graph.optimize()
    np.testing.assert_array_equal(graph.poses[1], [1.1, 0.0, 0.0])


def test_a_failed_optimisation_keeps_the_poses_and_is_told(monkeypatch):
    sound = run(plain())
    monkeypatch.setattr(global_slam, "prune_closures", broken)
    result = run(plain())
    assert is_whole(result)
    assert length(result) == pytest.approx(length(sound), abs=0.05)
    assert result.statistics.solver_failures == 1
    assert any("could not be optimised" in warning for warning in result.statistics.warnings)


def test_it_ends_with_code_3(asked_runs, tiny_result, tmp_path):
    tiny_result.statistics.solver_failures = 2
    assert main(["map", "any.bag", "-o", str(tmp_path / "out")]) == 3
    assert (tmp_path / "out" / "map.pgm").exists()


def test_a_match_without_a_result_keeps_the_prediction(monkeypatch):
    """What CasADi's solver finds is looked at: a pose that is not finite is the prediction instead."""
    solve, broken_once = sqp.SqpSolver.solve, []

    def sometimes_lost(self, problem):
        run_solver = self._run
        if len(broken_once) % 3 == 0:
            self._run = lambda: self._found.__setitem__(slice(None), np.nan)
        broken_once.append(True)
        try:
            return solve(self, problem)
        finally:
            self._run = run_solver

    monkeypatch.setattr(sqp.SqpSolver, "solve", sometimes_lost)
    result = run(plain(), local={"solver": "casadi"})
    assert is_whole(result)
    assert len(broken_once) > 10
    assert length(result) == pytest.approx(3.3, abs=0.3)
