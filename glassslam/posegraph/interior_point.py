"""CasADi's interface to IPOPT on the generated kernels: the second opinion beside the own solver."""

from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from glassslam.posegraph.levenberg_marquardt import Solution
from glassslam.posegraph.structure import Structure
from glassslam.posegraph.system import System
from glassslam.records import FloatArray
from glassslam.symbolic.callback import CostCallback, SolverCallback, read, write


def minimise(system: System, poses: FloatArray, max_iterations: int, tolerance: float) -> Solution:
    """Move the variables to the least cost; arguments as in `levenberg_marquardt.minimise`.

    IPOPT asks through callbacks for the cost, its gradient and the Gauss-Newton matrix, which read
    and write its own memory.
    """
    initial = system.cost(poses)
    if system.size == 0:
        return Solution(poses, 0, initial, initial, True)
    evaluation = _Evaluation(system, poses)
    size = 3 * system.size
    cost, gradient, hessian = _Cost(evaluation, size), _Gradient(evaluation, size), _Hessian(evaluation, size)
    x = ca.MX.sym("x", size)
    # a callback cannot be the problem itself, an expression that calls it can
    problem = {"x": x, "f": cost(x, ca.DM(0, 0))}
    options = _options(max_iterations, tolerance) | {"grad_f": gradient, "hess_lag": hessian}
    solver = ca.nlpsol("solver", "ipopt", problem, options)
    start = poses[system.structure.vertex].ravel()
    result = np.asarray(solver(x0=start, lbx=-np.inf, ubx=np.inf)["x"], dtype=np.float64).ravel()
    statistics = solver.stats()
    final = evaluation.placed(result)
    return Solution(
        final.copy(), int(statistics["iter_count"]), initial, system.cost(final), bool(statistics["success"])
    )


def _options(max_iterations: int, tolerance: float) -> dict[str, Any]:
    return {
        "print_time": False,
        "calc_lam_p": False,
        "calc_lam_x": False,
        "ipopt.print_level": 0,
        "ipopt.sb": "yes",
        "ipopt.linear_solver": "mumps",
        "ipopt.nlp_scaling_method": "none",
        "ipopt.max_iter": max_iterations,
        # stop when the cost no longer changes: gradients have no natural scale here
        "ipopt.acceptable_obj_change_tol": tolerance,
        "ipopt.acceptable_iter": 1,
        "ipopt.acceptable_tol": 1e20,
        "ipopt.acceptable_dual_inf_tol": 1e20,
    }


class _Evaluation:
    """The system at the point the solver asked for last, shared by the callbacks."""

    def __init__(self, system: System, poses: FloatArray) -> None:
        self.system = system
        self.poses = poses.copy()
        self.entries = _scalar_entries(system.structure)
        self._linearised_at: FloatArray | None = None
        self._cost = 0.0

    def placed(self, x: FloatArray) -> FloatArray:
        """All poses, the variables at x; valid until the next call."""
        self.poses[self.system.structure.vertex] = x.reshape(-1, 3)
        return self.poses

    def linearised(self, x: FloatArray) -> float:
        """Cost at x, with the system linearised there."""
        if self._linearised_at is None or not np.array_equal(self._linearised_at, x):
            self._cost = self.system.linearise(self.placed(x))
            self._linearised_at = x.copy()
        return self._cost


class _Gradient(SolverCallback[_Evaluation]):
    outputs = ("f", "grad_f_x")

    def get_sparsity_out(self, index: int) -> ca.Sparsity:
        return ca.Sparsity.dense(1 if index == 0 else self.variables, 1)

    def eval_buffer(self, arguments: tuple[Any, ...], results: tuple[Any, ...]) -> int:
        write(results[0], self.evaluation.linearised(read(arguments[0])))
        write(results[1], self.evaluation.system.gradient.ravel())
        return 0


class _Cost(CostCallback[_Evaluation]):
    derivatives = _Gradient

    def eval_buffer(self, arguments: tuple[Any, ...], results: tuple[Any, ...]) -> int:
        evaluation = self.evaluation
        write(results[0], evaluation.system.cost(evaluation.placed(read(arguments[0]))))
        return 0


class _Hessian(SolverCallback[_Evaluation]):
    inputs = ("x", "p", "lam_f", "lam_g")
    outputs = ("triu_hess_gamma_x_x",)

    def get_sparsity_out(self, index: int) -> ca.Sparsity:  # noqa: ARG002
        starts, rows, _ = self.evaluation.entries
        return ca.Sparsity(self.variables, self.variables, starts.tolist(), rows.tolist())

    def eval_buffer(self, arguments: tuple[Any, ...], results: tuple[Any, ...]) -> int:
        evaluation, factor = self.evaluation, read(arguments[2])[0]
        evaluation.linearised(read(arguments[0]))
        blocks = np.concatenate((evaluation.system.upper.ravel(), evaluation.system.diagonal.ravel()))
        write(results[0], factor * blocks[evaluation.entries[2]])
        return 0


def _scalar_entries(structure: Structure) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Upper triangle in compressed scalar columns, and where in (upper, diagonal) each number is."""
    n = structure.vertex.size
    block_row = np.concatenate((structure.row, np.arange(n)))
    block_column = np.concatenate((np.repeat(np.arange(n), np.diff(structure.column_start)), np.arange(n)))
    row = (3 * block_row[:, None] + np.repeat(np.arange(3), 3)).ravel()
    column = (3 * block_column[:, None] + np.tile(np.arange(3), 3)).ravel()
    keep = np.flatnonzero(row <= column)
    keep = keep[np.lexsort((row[keep], column[keep]))]
    starts = np.concatenate(
        (np.zeros(1, dtype=np.int64), np.cumsum(np.bincount(column[keep], minlength=3 * n)))
    )
    return starts, row[keep], keep
