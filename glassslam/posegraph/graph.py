"""The data of a pose graph: vertices are planar poses, edges relative poses with information."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

from glassslam.records import FloatArray

ConstraintKind: TypeAlias = Literal["loop", "odometry"]
Loss: TypeAlias = Literal["none", "huber", "geman_mcclure"]
Solver: TypeAlias = Literal["lm", "casadi"]


@dataclass(frozen=True, slots=True)
class Constraint:
    """A measured relative pose between two vertices.

    Attributes
    ----------
    a, b : int
        Indices of the vertices.
    a_from_b : ndarray of float64, shape (3,)
        Measured pose of b in the frame of a, m and rad.
    sqrt_information : ndarray of float64, shape (3, 3)
        W with information = W^T W; the weighted residual is W e.
    kind : {"loop", "odometry"}
        A loop closure (robust loss), or the step between consecutive nodes.
    """

    a: int
    b: int
    a_from_b: FloatArray
    sqrt_information: FloatArray
    kind: ConstraintKind


@dataclass(frozen=True, slots=True)
class OptimizationReport:
    """What an optimisation did.

    Attributes
    ----------
    iterations : int
        Linear systems solved.
    initial_cost, final_cost : float
        Half the sum of the losses before and after.
    converged : bool
        Whether it ended at a minimum rather than at the limit of iterations.
    residual_norms : ndarray of float64, shape (constraints,)
        Norm of every weighted residual after, without loss, disabled constraints included.
    """

    iterations: int
    initial_cost: float
    final_cost: float
    converged: bool
    residual_norms: FloatArray
