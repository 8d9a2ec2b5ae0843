"""How well a graph knows one pose relative to another."""

import numpy as np

from glassslam.posegraph import covariance_kernels
from glassslam.posegraph.structure_kernels import Integers
from glassslam.posegraph.system import System
from glassslam.records import FloatArray


def relative_covariances(system: System, poses: FloatArray, pairs: Integers) -> FloatArray:
    """Covariances (k, 3, 3) of the poses of b in the frames of a.

    Parameters
    ----------
    system : System
        Factorised without damping at `poses`.
    poses : ndarray of float64, shape (v, 3)
        All poses.
    pairs : ndarray of int64, shape (k, 2)
        Vertices a and b; infinite covariance when no edges lead from one to the other.
    """
    s = system.structure
    out = np.zeros((len(pairs), 3, 3))
    covariance_kernels.relative_covariances(
        poses, pairs, s.variable, s.parent, s.factor_start,
        system.factor_row, system.factor, system.inverse, out,
    )  # fmt: skip
    apart = s.component[pairs[:, 0]] != s.component[pairs[:, 1]]
    out[apart] = np.diag(np.full(3, np.inf))
    return out
