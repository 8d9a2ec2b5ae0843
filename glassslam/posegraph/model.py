"""The symbolic model of the pose graph: residuals, robust losses and their derivatives by CasADi.

Nothing here runs during mapping: `tools/generate_kernels.py` writes the functions below as numba
kernels into `_generated.py`.
"""

import math

import casadi as ca


def wrapped(angle: ca.SX) -> ca.SX:
    """Angle brought into [-pi, pi); the derivative is 1."""
    return angle - 2.0 * math.pi * ca.floor((angle + math.pi) / (2.0 * math.pi))


def between_error(a: ca.SX, b: ca.SX, a_from_b: ca.SX) -> ca.SX:
    """Measured minus predicted pose of b in the frame of a (Hess et al. 2016, section V-A), angle wrapped."""
    c, s = ca.cos(a[2]), ca.sin(a[2])
    dx, dy = b[0] - a[0], b[1] - a[1]
    predicted = ca.vertcat(c * dx + s * dy, c * dy - s * dx)
    return ca.vertcat(a_from_b[:2] - predicted, wrapped(a_from_b[2] - (b[2] - a[2])))


def huber(s: ca.SX, k: ca.SX) -> ca.SX:
    """Loss of a squared norm s: s below k^2, then growing with its square root."""
    # the root of the larger keeps the derivative finite at s = 0
    return ca.if_else(s <= k * k, s, 2.0 * k * ca.sqrt(ca.fmax(s, k * k)) - k * k)


def geman_mcclure(s: ca.SX, k: ca.SX) -> ca.SX:
    """Loss of a squared norm s that saturates at k^2: far outliers pull no more."""
    return s * k * k / (s + k * k)


def between_function() -> ca.Function:
    """Weighted residual W e and its Jacobians with respect to both poses."""
    a, b, z = ca.SX.sym("a", 3), ca.SX.sym("b", 3), ca.SX.sym("z", 3)
    w = ca.SX.sym("w", 3, 3)
    residual = w @ between_error(a, b, z)
    jacobians = [ca.jacobian(residual, pose) for pose in (a, b)]
    return ca.Function(
        "between", [a, b, z, w], [residual, *jacobians], ["a", "b", "z", "w"], ["r", "ja", "jb"]
    )


def loss_function(name: str, loss: ca.SX, s: ca.SX, k: ca.SX) -> ca.Function:
    """Value of a loss and its first derivative by the squared norm (the weight of an edge)."""
    return ca.Function(name, [s, k], [loss, ca.gradient(loss, s)], ["s", "k"], ["rho", "weight"])


def functions() -> dict[str, ca.Function]:
    """Name of the kernel -> function."""
    s, k = ca.SX.sym("s"), ca.SX.sym("k")
    return {
        "between": between_function(),
        "huber": loss_function("huber", huber(s, k), s, k),
        "geman_mcclure": loss_function("geman_mcclure", geman_mcclure(s, k), s, k),
    }
