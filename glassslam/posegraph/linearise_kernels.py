"""Kernels over all edges: cost, residuals, gradient and the blocks of the Gauss-Newton matrix."""

import numpy as np
from numpy.typing import NDArray

from glassslam.accelerate import kernel
from glassslam.posegraph._generated import between, geman_mcclure, huber
from glassslam.posegraph.storage import LOOP
from glassslam.posegraph.structure_kernels import Integers
from glassslam.records import FloatArray

NO_LOSS, HUBER, GEMAN_MCCLURE = 0, 1, 2


@kernel
def robust(s: float, kind: int, loss: int, scale: float) -> tuple[float, float]:
    """Loss of the squared norm s and its derivative; only loop closures are doubted."""
    if kind == LOOP and loss == HUBER:
        return huber(s, scale)
    if kind == LOOP and loss == GEMAN_MCCLURE:
        return geman_mcclure(s, scale)
    return s, 1.0


@kernel
def residual_and_jacobians(a: FloatArray, b: FloatArray, z: FloatArray, w: FloatArray) -> tuple[float, ...]:
    """Weighted residual (3), its Jacobians by a (9) and by b (9), both column by column."""
    return between(
        a[0], a[1], a[2], b[0], b[1], b[2], z[0], z[1], z[2],
        w[0, 0], w[1, 0], w[2, 0], w[0, 1], w[1, 1], w[2, 1], w[0, 2], w[1, 2], w[2, 2],
    )  # fmt: skip


@kernel
def residuals(
    poses: FloatArray, ends: Integers, measured: FloatArray, weights: FloatArray, out: FloatArray
) -> None:
    """Weighted residuals of all edges into `out`, shape (n, 3)."""
    for e in range(ends.shape[0]):
        r = residual_and_jacobians(poses[ends[e, 0]], poses[ends[e, 1]], measured[e], weights[e])
        out[e, 0], out[e, 1], out[e, 2] = r[0], r[1], r[2]


@kernel
def total_cost(
    poses: FloatArray,
    ends: Integers,
    measured: FloatArray,
    weights: FloatArray,
    kinds: NDArray[np.int8],
    edges: Integers,
    loss: int,
    scale: float,
) -> float:
    """Half the sum of the losses of the edges listed in `edges`."""
    total = 0.0
    for e in edges:
        r = residual_and_jacobians(poses[ends[e, 0]], poses[ends[e, 1]], measured[e], weights[e])
        total += robust(r[0] * r[0] + r[1] * r[1] + r[2] * r[2], kinds[e], loss, scale)[0]
    return 0.5 * total


@kernel
def _add_product(x: tuple[float, ...], y: tuple[float, ...], weight: float, out: FloatArray) -> None:
    """Add weight * X^T Y to the row-major block `out`; X and Y are given column by column."""
    for i in range(3):
        for j in range(3):
            out[3 * i + j] += weight * (
                x[3 * i] * y[3 * j] + x[3 * i + 1] * y[3 * j + 1] + x[3 * i + 2] * y[3 * j + 2]
            )


@kernel
def _add_gradient(x: tuple[float, ...], r: tuple[float, ...], weight: float, out: FloatArray) -> None:
    for i in range(3):
        out[i] += weight * (x[3 * i] * r[0] + x[3 * i + 1] * r[1] + x[3 * i + 2] * r[2])


@kernel
def linearise(
    poses: FloatArray,
    ends: Integers,
    measured: FloatArray,
    weights: FloatArray,
    kinds: NDArray[np.int8],
    edges: Integers,
    loss: int,
    scale: float,
    variable: Integers,
    slot: Integers,
    diagonal: FloatArray,
    upper: FloatArray,
    gradient: FloatArray,
) -> float:
    """Cost; fills the blocks of J^T J (diagonal (n, 9), strictly upper (m, 9)) and the gradient (n, 3)."""
    diagonal[:] = 0.0
    upper[:] = 0.0
    gradient[:] = 0.0
    total = 0.0
    for k in range(edges.size):
        e = edges[k]
        full = residual_and_jacobians(poses[ends[e, 0]], poses[ends[e, 1]], measured[e], weights[e])
        r, ja, jb = full[0:3], full[3:12], full[12:21]
        rho, weight = robust(r[0] * r[0] + r[1] * r[1] + r[2] * r[2], kinds[e], loss, scale)
        total += rho
        a, b = variable[ends[e, 0]], variable[ends[e, 1]]
        if a >= 0:
            _add_product(ja, ja, weight, diagonal[a])
            _add_gradient(ja, r, weight, gradient[a])
        if b >= 0:
            _add_product(jb, jb, weight, diagonal[b])
            _add_gradient(jb, r, weight, gradient[b])
        if slot[k] >= 0:
            if a < b:
                _add_product(ja, jb, weight, upper[slot[k]])
            else:
                _add_product(jb, ja, weight, upper[slot[k]])
    return 0.5 * total
