"""CasADi's sqpmethod on the generated kernel: the second opinion beside the own matching loop.

The solver asks through callbacks for the cost, its gradient and the Gauss-Newton matrix, which read
and write its own memory. Building one costs milliseconds, so every thread keeps those it used.
"""

from functools import lru_cache
from threading import local
from typing import Any

import casadi as ca
import numpy as np

from glassslam.matching.kernels import objective
from glassslam.matching.problem import MatchProblem
from glassslam.records import FloatArray
from glassslam.symbolic.callback import CostCallback, SolverCallback, write

_SOLVERS_KEPT = 8
_thread = local()


def minimise(problem: MatchProblem, max_iterations: int, tolerance: float) -> tuple[FloatArray, int]:
    """Pose of least cost and the number of evaluations it took.

    Parameters
    ----------
    problem : MatchProblem
        The scan, the grid and the prediction.
    max_iterations : int
        Most quadratic problems solved.
    tolerance : float
        Largest entry of the gradient (1/m and 1/rad) at the end; steps shorter than a tenth of it
        (m and rad) end the search as well.
    """
    if not hasattr(_thread, "solver"):
        _thread.solver = lru_cache(maxsize=_SOLVERS_KEPT)(SqpSolver)
    solver: SqpSolver = _thread.solver(max_iterations, tolerance)
    return solver.solve(problem)


class SqpSolver:
    """One sqpmethod solver, used for one match after the other."""

    def __init__(self, max_iterations: int, tolerance: float) -> None:
        self._evaluation = _Evaluation()
        # the solver does not keep its callbacks alive
        self._callbacks = (
            _Cost(self._evaluation, 3), _Derivatives(self._evaluation, 3), _Hessian(self._evaluation, 3),
        )  # fmt: skip
        cost, derivatives, hessian = self._callbacks
        x = ca.MX.sym("x", 3)
        options = _options(max_iterations, tolerance) | {"jac_fg": derivatives, "hess_lag": hessian}
        # a callback cannot be the problem itself, an expression that calls it can
        self._solver = ca.nlpsol("match", "sqpmethod", {"x": x, "f": cost(x, ca.DM(0, 0))}, options)
        self._start, self._found = np.zeros(3), np.zeros(3)
        self._low, self._high = np.full(3, -np.inf), np.full(3, np.inf)
        self._buffer: Any
        self._buffer, self._run = self._solver.buffer()
        # bounds that are not set read as zero
        for name, array in (("x0", self._start), ("lbx", self._low), ("ubx", self._high)):
            self._buffer.set_arg(self._solver.index_in(name), array.data)
        self._buffer.set_res(self._solver.index_out("x"), self._found.data)

    def solve(self, problem: MatchProblem) -> tuple[FloatArray, int]:
        """Pose of least cost and the number of evaluations."""
        self._evaluation.begin(problem)
        self._start[:] = problem.prediction
        self._run()
        # without any hold the quadratic problem may have no solution
        pose = self._found if np.isfinite(self._found).all() else self._start
        return pose.copy(), self._evaluation.count


def _options(max_iterations: int, tolerance: float) -> dict[str, Any]:
    return {
        "qpsol": "qrqp",
        "qpsol_options": {"print_iter": False, "print_header": False, "error_on_fail": False},
        "print_time": False,
        "print_header": False,
        "print_iteration": False,
        "print_status": False,
        "calc_lam_p": False,
        "calc_lam_x": False,
        "error_on_fail": False,
        "max_iter": max_iterations,
        "tol_du": tolerance,
        "min_step_size": 0.1 * tolerance,
        # a line search that accepts steps uphill, as is the default, leaves the basin
        "merit_memory": 1,
        "max_iter_ls": 8,
        "beta": 0.3,
    }


class _Evaluation:
    """The objective at the pose the solver asked for last, shared by the callbacks."""

    def __init__(self) -> None:
        self._at, self._values = np.full(3, np.nan), np.zeros(13)
        self.count = 0

    def begin(self, problem: MatchProblem) -> None:
        self._problem = problem
        self._at[:] = np.nan
        self.count = 0

    def at(self, buffer: Any) -> FloatArray:
        """Cost, gradient (3) and Gauss-Newton Hessian (9) at the pose in a buffer."""
        pose = np.frombuffer(buffer, dtype=np.float64)
        if not (pose == self._at).all():
            arguments = (*self._problem.arguments, pose, self._values)
            objective(*arguments)
            self._at[:] = pose
            self.count += 1
        return self._values


class _Callback(SolverCallback[_Evaluation]):
    def get_sparsity_out(self, index: int) -> ca.Sparsity:
        sparsity = {
            "f": ca.Sparsity.dense(1, 1),
            "grad_f_x": ca.Sparsity.dense(3, 1),
            "g": ca.Sparsity.dense(0, 1),
            "jac_g_x": ca.Sparsity.dense(0, 3),
            "hess_gamma_x_x": ca.Sparsity.dense(3, 3),
        }
        return sparsity[self.outputs[index]]


class _Derivatives(_Callback):
    outputs = ("f", "grad_f_x", "g", "jac_g_x")

    def eval_buffer(self, arguments: tuple[Any, ...], results: tuple[Any, ...]) -> int:
        values = self.evaluation.at(arguments[0])
        write(results[0], values[:1])
        write(results[1], values[1:4])
        return 0


class _Cost(CostCallback[_Evaluation]):
    derivatives = _Derivatives

    def eval_buffer(self, arguments: tuple[Any, ...], results: tuple[Any, ...]) -> int:
        write(results[0], self.evaluation.at(arguments[0])[:1])
        return 0


class _Hessian(_Callback):
    inputs = ("x", "p", "lam_f", "lam_g")
    outputs = ("hess_gamma_x_x",)

    def eval_buffer(self, arguments: tuple[Any, ...], results: tuple[Any, ...]) -> int:
        factor = np.frombuffer(arguments[2], dtype=np.float64)[0]
        write(results[0], factor * self.evaluation.at(arguments[0])[4:])
        return 0
