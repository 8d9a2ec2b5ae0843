"""What the callbacks of CasADi's solvers have in common: names, shapes and access to the solver's memory."""

from collections.abc import Mapping, Sequence
from typing import Any, Generic, TypeVar

import casadi as ca
import numpy as np

from glassslam.records import FloatArray

_E = TypeVar("_E")


class SolverCallback(ca.Callback, Generic[_E]):
    """A function (x, p, ...) of a solver without parameters and constraints, computed in its own memory.

    Parameters
    ----------
    evaluation : object
        Where the values come from; subclasses use it.
    variables : int
        Length of x.
    """

    inputs: tuple[str, ...] = ("x", "p")
    outputs: tuple[str, ...] = ("f",)

    def __init__(self, evaluation: _E, variables: int) -> None:
        super().__init__()
        self.evaluation = evaluation
        self.variables = variables
        self.construct(type(self).__name__.strip("_").lower(), {})

    def get_n_in(self) -> int:
        """Count of inputs."""
        return len(self.inputs)

    def get_n_out(self) -> int:
        """Count of outputs."""
        return len(self.outputs)

    def get_name_in(self, index: int) -> str:
        """Name of an input."""
        return self.inputs[index]

    def get_name_out(self, index: int) -> str:
        """Name of an output."""
        return self.outputs[index]

    def get_sparsity_in(self, index: int) -> ca.Sparsity:
        """Shape of an input."""
        rows = {"x": self.variables, "p": 0, "lam_f": 1, "lam_g": 0}[self.inputs[index]]
        return ca.Sparsity.dense(rows, 0 if self.inputs[index] == "p" else 1)

    def has_eval_buffer(self) -> bool:
        """Say that values are computed in the memory of the solver."""
        return True


class CostCallback(SolverCallback[_E]):
    """The cost as a function (x, p); `derivatives` is the callback whose second output is its gradient."""

    derivatives: type[SolverCallback[Any]]

    def get_sparsity_out(self, index: int) -> ca.Sparsity:  # noqa: ARG002
        """Shape of the output."""
        return ca.Sparsity.dense(1, 1)

    def has_jacobian(self) -> bool:
        """Say that there is a Jacobian."""
        return True

    def get_jacobian(
        self, name: str, inputs: Sequence[str], outputs: Sequence[str], options: Mapping[str, Any]
    ) -> ca.Function:
        """Jacobian as CasADi's calculus wants it: asked for when a solver is built, not when it runs."""
        self._gradient = self.derivatives(self.evaluation, self.variables)
        x, p, f = ca.MX.sym("x", self.variables), ca.MX.sym("p", 0, 0), ca.MX.sym("f")
        row = self._gradient(x, p)[1].T
        return ca.Function(name, [x, p, f], [row, ca.MX(1, 0)], inputs, outputs, options)


def read(buffer: Any) -> FloatArray:
    """The numbers of an input of `eval_buffer`, not copied."""
    return np.frombuffer(buffer, dtype=np.float64)


def write(buffer: Any, values: Any) -> None:
    """Fill an output of `eval_buffer`; one that nobody asked for has no memory."""
    if buffer is not None:
        np.frombuffer(buffer, dtype=np.float64)[:] = values
