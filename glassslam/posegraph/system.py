"""The normal equations of a graph: linearised, damped, factorised and solved."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from glassslam.errors import GraphError
from glassslam.posegraph import ldl_kernels, linearise_kernels
from glassslam.posegraph.graph import Loss
from glassslam.posegraph.storage import EdgeStore
from glassslam.posegraph.structure import Structure
from glassslam.posegraph.structure_kernels import Integers
from glassslam.records import FloatArray

LOSS_CODES: dict[Loss, int] = {
    "none": linearise_kernels.NO_LOSS,
    "huber": linearise_kernels.HUBER,
    "geman_mcclure": linearise_kernels.GEMAN_MCCLURE,
}


@dataclass(frozen=True, slots=True)
class Robust:
    """How loop closures are doubted.

    Attributes
    ----------
    loss : {"none", "huber", "geman_mcclure"}
        Quadratic; linear beyond the scale; saturating beyond the scale.
    scale : float
        Norm of the weighted residual from which an edge loses weight.

    Raises
    ------
    GraphError
        An unknown loss or a scale that is not positive.
    """

    loss: Loss = "huber"
    scale: float = 10.0

    def __post_init__(self) -> None:
        if self.loss not in LOSS_CODES:
            raise GraphError(f"unknown loss {self.loss!r}", f"known are {', '.join(LOSS_CODES)}")
        if not (np.isfinite(self.scale) and self.scale > 0):
            raise GraphError(f"scale of the loss is {self.scale}", "it must be positive")


@dataclass(slots=True)
class System:
    """Gauss-Newton equations of one graph structure, in buffers that are used again.

    Attributes
    ----------
    structure : Structure
        Symbolic analysis.
    edges : EdgeStore
        The constraints.
    robust : Robust
        Loss of the loop closures.
    diagonal, upper : ndarray of float64, shapes (n, 9) and (m, 9)
        Blocks of J^T J as of the last `linearise`.
    gradient : ndarray of float64, shape (n, 3)
        Gradient of the cost as of the last `linearise`.
    """

    structure: Structure
    edges: EdgeStore
    robust: Robust
    diagonal: FloatArray = field(init=False)
    upper: FloatArray = field(init=False)
    gradient: FloatArray = field(init=False)
    factor: FloatArray = field(init=False)
    inverse: FloatArray = field(init=False)
    factor_row: Integers = field(init=False)
    _work: FloatArray = field(init=False)
    _index_work: Integers = field(init=False)

    def __post_init__(self) -> None:
        n, s = self.size, self.structure
        self.diagonal, self.upper, self.gradient = (
            np.empty((n, 9)),
            np.empty((s.row.size, 9)),
            np.empty((n, 3)),
        )
        entries = int(s.factor_start[-1])
        self.factor, self.inverse = np.empty((entries, 9)), np.empty((n, 9))
        self.factor_row = np.empty(entries, dtype=np.int64)
        self._work, self._index_work = np.empty((n + 1, 9)), np.empty((3, n), dtype=np.int64)

    @property
    def size(self) -> int:
        """Number of poses that move."""
        return self.structure.vertex.size

    def cost(self, poses: FloatArray) -> float:
        """Half the sum of the losses at `poses`, shape (v, 3)."""
        return float(linearise_kernels.total_cost(*self._arguments(poses)))

    def linearise(self, poses: FloatArray) -> float:
        """Cost at `poses`; fills `diagonal`, `upper` and `gradient`."""
        s, buffers = self.structure, (self.diagonal, self.upper, self.gradient)
        arguments = (*self._arguments(poses), s.variable, s.slot, *buffers)
        return float(linearise_kernels.linearise(*arguments))

    def factorise(self, damping: FloatArray) -> bool:
        """Factorise J^T J plus the diagonal `damping`, shape (n, 3); False when not positive definite."""
        s = self.structure
        return bool(
            ldl_kernels.factorise(
                s.column_start, s.row, self.upper, self.diagonal, damping, s.parent, s.factor_start,
                self.factor_row, self.factor, self.inverse, self._work, self._index_work,
            )
        )  # fmt: skip

    def solve(self, right: FloatArray) -> FloatArray:
        """Solution, shape (n, 3), with the last factorisation."""
        x = right.copy()
        ldl_kernels.solve(self.structure.factor_start, self.factor_row, self.factor, self.inverse, x)
        return x

    def moved(self, poses: FloatArray, step: FloatArray) -> FloatArray:
        """Copy of `poses` with the variables moved by `step`, shape (n, 3)."""
        out = poses.copy()
        out[self.structure.vertex] += step
        return out

    def _arguments(self, poses: FloatArray) -> tuple[Any, ...]:
        e = self.edges
        code = LOSS_CODES[self.robust.loss]
        return (
            poses, e.ends, e.measured, e.weights, e.kinds, self.structure.edges, code, self.robust.scale,
        )  # fmt: skip
