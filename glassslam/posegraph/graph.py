"""The data of a pose graph: vertices are planar poses, edges relative poses with information."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

from glassslam.records import FloatArray

ConstraintKind: TypeAlias = Literal["intra", "loop", "odometry"]


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
    kind : {"intra", "loop", "odometry"}
        A scan in the submap it was inserted in; a loop closure (robust loss); odometry between nodes.
    """

    a: int
    b: int
    a_from_b: FloatArray
    sqrt_information: FloatArray
    kind: ConstraintKind
