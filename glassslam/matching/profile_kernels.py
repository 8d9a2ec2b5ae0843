"""Kernel that follows the fit of a scan along a line, to tell how far it could slide unnoticed."""

import math

import numpy as np
from numpy.typing import NDArray

from glassslam.accelerate import kernel
from glassslam.matching.kernels import normal_equations
from glassslam.records import Float32Array, FloatArray


@kernel
def flat_reach(
    cells: NDArray[np.uint16],
    table: Float32Array,
    origin: FloatArray,
    inverse_resolution: float,
    points: FloatArray,
    pose: FloatArray,
    direction: FloatArray,
    limit: float,
    reach: float,
    step: float,
) -> float:
    """Farthest shift along +-direction, m, at which the residual still is below `limit`; 0 when none is."""
    hessian, gradient, trial = np.empty((3, 3)), np.empty(3), pose.copy()
    farthest = 0.0
    for k in range(1, int(reach / step) + 1):
        for sign in (-1.0, 1.0):
            trial[0] = pose[0] + sign * k * step * direction[0]
            trial[1] = pose[1] + sign * k * step * direction[1]
            cost = normal_equations(
                cells, table, origin, inverse_resolution, points, trial, hessian, gradient
            )
            if math.sqrt(cost / points.shape[0]) < limit:
                farthest = k * step
    return farthest
