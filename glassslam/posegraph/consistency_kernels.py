"""Kernels that compare loop closures with each other through the odometry between them."""

import math

import numpy as np
from numpy.typing import NDArray

from glassslam.accelerate import kernel
from glassslam.posegraph.structure_kernels import Integers
from glassslam.records import FloatArray

Bits = NDArray[np.uint64]


@kernel
def add_moved(
    covariance: FloatArray, cos: float, sin: float, px: float, py: float, sign: float, out: FloatArray
) -> None:
    """Add sign * A C A^T to `out` (3, 3), A = [[R, (py, -px)], [0, 1]]: a twist moved to another frame."""
    c02, c12, c22 = covariance[0, 2], covariance[1, 2], covariance[2, 2]
    # rows of A C, column by column
    x0 = cos * covariance[0, 0] - sin * covariance[0, 1] + py * c02
    x1 = cos * covariance[0, 1] - sin * covariance[1, 1] + py * c12
    x2 = cos * c02 - sin * c12 + py * c22
    y0 = sin * covariance[0, 0] + cos * covariance[0, 1] - px * c02
    y1 = sin * covariance[0, 1] + cos * covariance[1, 1] - px * c12
    y2 = sin * c02 + cos * c12 - px * c22
    out[0, 0] += sign * (x0 * cos - x1 * sin + x2 * py)
    out[0, 1] += sign * (x0 * sin + x1 * cos - x2 * px)
    out[1, 1] += sign * (y0 * sin + y1 * cos - y2 * px)
    out[0, 2] += sign * x2
    out[1, 2] += sign * y2
    out[2, 2] += sign * c22
    out[1, 0], out[2, 0], out[2, 1] = out[0, 1], out[0, 2], out[1, 2]


@kernel
def mahalanobis(s: FloatArray, x: float, y: float, z: float) -> float:
    """(x, y, z) S^-1 (x, y, z)^T of a symmetric S (3, 3); infinite when S is not positive definite."""
    l10, l20 = s[1, 0] / s[0, 0], s[2, 0] / s[0, 0]
    d1 = s[1, 1] - l10 * s[1, 0]
    l21 = (s[2, 1] - l20 * s[1, 0]) / d1
    d2 = s[2, 2] - l20 * s[2, 0] - l21 * l21 * d1
    if not (s[0, 0] > 0.0 and d1 > 0.0 and d2 > 0.0):
        return math.inf
    y -= l10 * x
    z -= l20 * x + l21 * y
    length: float = x * x / s[0, 0] + y * y / d1 + z * z / d2
    return length


@kernel
def cycle_distance(
    i: int,
    k: int,
    ends: Integers,
    corrections: FloatArray,
    spread: FloatArray,
    drift: FloatArray,
    work: FloatArray,
) -> float:
    """Squared Mahalanobis length of the cycle: closure i, odometry, closure k backwards, odometry."""
    xi, yi, ci, si = corrections[i, 0], corrections[i, 1], corrections[i, 3], corrections[i, 4]
    xk, yk, ck, sk = corrections[k, 0], corrections[k, 1], corrections[k, 3], corrections[k, 4]
    phi = corrections[i, 2] - corrections[k, 2]
    phi -= 2.0 * math.pi * np.floor((phi + math.pi) / (2.0 * math.pi))
    cos, sin = ci * ck + si * sk, si * ck - ci * sk
    x, y = xi - cos * xk + sin * yk, yi - sin * xk - cos * yk
    # logarithm of the motion: half / tan(half), by its series where the quotient loses digits
    half = 0.5 * phi
    alpha = half * sin / (1.0 - cos) if abs(phi) > 1e-3 else 1.0 - phi * phi / 12.0
    ai, ak, bi, bk = ends[i, 0], ends[k, 0], ends[i, 1], ends[k, 1]
    along_a, along_b = 1.0 if ak > ai else -1.0, 1.0 if bk > bi else -1.0
    for r in range(3):
        for c in range(3):
            work[0, r, c] = spread[i, r, c] + spread[k, r, c] + along_a * (drift[ak, r, c] - drift[ai, r, c])
            work[1, r, c] = drift[bk, r, c] - drift[bi, r, c]
    add_moved(work[1], ci, si, xi, yi, along_b, work[0])
    return mahalanobis(work[0], alpha * x + half * y, alpha * y - half * x, phi)


@kernel
def consistent_pairs(
    ends: Integers, corrections: FloatArray, spread: FloatArray, drift: FloatArray, limit: float
) -> Bits:
    """Rows of bits, shape (k, ceil(k / 64)): which closures agree; none with itself.

    Parameters
    ----------
    ends : ndarray of int64, shape (k, 2)
        Stations a and b of every closure.
    corrections : ndarray of float64, shape (k, 5)
        What every closure says the b side moves by, in the common frame: x, y, theta and its cosine
        and sine.
    spread : ndarray of float64, shape (k, 3, 3)
        Covariance of the closure itself, as a twist in the common frame.
    drift : ndarray of float64, shape (stations, 3, 3)
        Covariance of the odometry up to every station, as a twist in the common frame.
    limit : float
        Largest squared Mahalanobis length of a cycle.
    """
    count = ends.shape[0]
    bits = np.zeros((count, (count + 63) // 64), dtype=np.uint64)
    work = np.zeros((2, 3, 3))
    one = np.uint64(1)
    for i in range(count):
        for k in range(i + 1, count):
            if cycle_distance(i, k, ends, corrections, spread, drift, work) <= limit:
                bits[i, k >> 6] |= one << np.uint64(k & 63)
                bits[k, i >> 6] |= one << np.uint64(i & 63)
    return bits
