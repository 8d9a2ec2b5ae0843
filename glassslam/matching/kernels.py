"""Kernels of gradient scan matching: the equations of one scan, and a damped Newton method around them.

Residuals stay large at the best pose, since no return falls on a cell that is surely occupied.
Gauss-Newton steps, which take residuals for small, overshoot there; the exact second derivatives
cost hardly more than the first.
"""

import math

import numpy as np

from glassslam.accelerate import kernel
from glassslam.grid.kernels import Cells
from glassslam.matching._generated import occupied_space
from glassslam.records import Float32Array, FloatArray

FIRST_DAMPING = 1.0
LARGEST_DAMPING = 1e8
LEAST_CURVATURE = 1e-9
"""Keeps the directions that neither walls nor prior hold."""
LONGEST_STEP = 0.1
"""Farthest the slopes of the surface are trusted, m and rad: two cells."""


@kernel
def linearise(
    cells: Cells,
    table: Float32Array,
    origin: FloatArray,
    inverse_resolution: float,
    points: FloatArray,
    pose: FloatArray,
    hessian: FloatArray,
    curvature: FloatArray,
    gradient: FloatArray,
) -> float:
    """Sum of squared residuals r of all points; fills J^T J (3, 3), sum r r'' (3, 3) and J^T r (3,).

    A point outside the grid counts as unknown: it costs, but does not pull.
    """
    rows, columns = cells.shape
    x, y = pose[0] - origin[0], pose[1] - origin[1]
    cosine, sine = math.cos(pose[2]), math.sin(pose[2])
    cost = h00 = h01 = h02 = h11 = h12 = h22 = g0 = g1 = g2 = c00 = c01 = c02 = c11 = c12 = c22 = 0.0
    for k in range(points.shape[0]):
        px = cosine * points[k, 0] - sine * points[k, 1]
        py = sine * points[k, 0] + cosine * points[k, 1]
        u, v = (px + x) * inverse_resolution - 0.5, (py + y) * inverse_resolution - 0.5
        if not (u >= 1.0 and v >= 1.0 and u < columns - 2 and v < rows - 2):
            cost += (1.0 - table[0]) ** 2
            continue
        i, j = int(u), int(v)
        r, jx, jy, jt, xx, xy, xt, yy, yt, tt = occupied_space(
            px, py, u - i, v - j, inverse_resolution,
            table[cells[j - 1, i - 1]], table[cells[j - 1, i]],
            table[cells[j - 1, i + 1]], table[cells[j - 1, i + 2]],
            table[cells[j, i - 1]], table[cells[j, i]],
            table[cells[j, i + 1]], table[cells[j, i + 2]],
            table[cells[j + 1, i - 1]], table[cells[j + 1, i]],
            table[cells[j + 1, i + 1]], table[cells[j + 1, i + 2]],
            table[cells[j + 2, i - 1]], table[cells[j + 2, i]],
            table[cells[j + 2, i + 1]], table[cells[j + 2, i + 2]],
        )  # fmt: skip
        cost += r * r
        h00, h01, h02 = h00 + jx * jx, h01 + jx * jy, h02 + jx * jt
        h11, h12, h22 = h11 + jy * jy, h12 + jy * jt, h22 + jt * jt
        c00, c01, c02 = c00 + r * xx, c01 + r * xy, c02 + r * xt
        c11, c12, c22 = c11 + r * yy, c12 + r * yt, c22 + r * tt
        g0, g1, g2 = g0 + jx * r, g1 + jy * r, g2 + jt * r
    _fill(hessian, h00, h01, h02, h11, h12, h22)
    _fill(curvature, c00, c01, c02, c11, c12, c22)
    gradient[0], gradient[1], gradient[2] = g0, g1, g2
    return cost


@kernel
def _fill(a: FloatArray, a00: float, a01: float, a02: float, a11: float, a12: float, a22: float) -> None:
    """Symmetric matrix from its upper triangle."""
    a[0, 0], a[0, 1], a[0, 2] = a00, a01, a02
    a[1, 0], a[1, 1], a[1, 2] = a01, a11, a12
    a[2, 0], a[2, 1], a[2, 2] = a02, a12, a22


@kernel
def normal_equations(
    cells: Cells,
    table: Float32Array,
    origin: FloatArray,
    inverse_resolution: float,
    points: FloatArray,
    pose: FloatArray,
    hessian: FloatArray,
    gradient: FloatArray,
) -> float:
    """Sum of squared residuals of all points; fills J^T J (3, 3) and J^T r (3,)."""
    curvature = np.empty((3, 3))
    return linearise(cells, table, origin, inverse_resolution, points, pose, hessian, curvature, gradient)


@kernel
def solve_symmetric(a: FloatArray, b: FloatArray, step: FloatArray) -> bool:
    """Solve the 3x3 system a step = b by Cholesky; False when a is not positive definite."""
    if not a[0, 0] > 0.0:
        return False
    l00 = math.sqrt(a[0, 0])
    l10, l20 = a[1, 0] / l00, a[2, 0] / l00
    d1 = a[1, 1] - l10 * l10
    if not d1 > 0.0:
        return False
    l11 = math.sqrt(d1)
    l21 = (a[2, 1] - l20 * l10) / l11
    d2 = a[2, 2] - l20 * l20 - l21 * l21
    if not d2 > 0.0:
        return False
    l22 = math.sqrt(d2)
    y0 = b[0] / l00
    y1 = (b[1] - l10 * y0) / l11
    y2 = (b[2] - l20 * y0 - l21 * y1) / l22
    step[2] = y2 / l22
    step[1] = (y1 - l21 * step[2]) / l11
    step[0] = (y0 - l10 * step[1] - l20 * step[2]) / l00
    return True


@kernel
def prior_cost(pose: FloatArray, prediction: FloatArray, prior: FloatArray) -> float:
    """Weighted squared distance of a pose from its prediction."""
    cost = 0.0
    for a in range(3):
        cost += prior[a] * (pose[a] - prediction[a]) ** 2
    return cost


@kernel
def newton_step(
    hessian: FloatArray,
    curvature: FloatArray,
    gradient: FloatArray,
    weight: float,
    prior: FloatArray,
    away: FloatArray,
    damping: float,
    system: FloatArray,
    step: FloatArray,
) -> bool:
    """Damped Newton step at a pose `away` from the prediction and its system; False when there is none.

    Where the exact Hessian is not positive definite, or its step is long, the Gauss-Newton one
    with more damping takes its place, cut to the same length: far from the best pose the surface
    curves the wrong way, and its slope tells nothing of what lies two cells away.
    """
    right, scale = np.empty(3), np.empty(3)
    for a in range(3):
        right[a] = -weight * gradient[a] - prior[a] * away[a]
        scale[a] = weight * hessian[a, a] + prior[a]
        for b in range(3):
            system[a, b] = weight * (hessian[a, b] + curvature[a, b])
        system[a, a] += prior[a] + damping * scale[a] + LEAST_CURVATURE
    if solve_symmetric(system, right, step) and max(abs(step[0]), abs(step[1]), abs(step[2])) < LONGEST_STEP:
        return True
    for a in range(3):
        for b in range(3):
            system[a, b] = weight * hessian[a, b]
        system[a, a] = scale[a] * (1.0 + max(damping, FIRST_DAMPING)) + LEAST_CURVATURE
    solved = solve_symmetric(system, right, step)
    excess = max(abs(step[0]), abs(step[1]), abs(step[2])) / LONGEST_STEP
    if solved and excess > 1.0:
        step /= excess
        system *= excess
    return solved


@kernel
def align(
    cells: Cells,
    table: Float32Array,
    origin: FloatArray,
    inverse_resolution: float,
    points: FloatArray,
    prediction: FloatArray,
    prior: FloatArray,
    weight: float,
    max_iterations: int,
    pose: FloatArray,
    information: FloatArray,
    tolerance: float = 1e-3,
) -> tuple[float, int]:
    """Pose of least cost near a prediction, by a damped Newton method.

    Cost: weight * sum_k (1 - M(T h_k))^2 + sum_a prior[a] * (T_a - prediction_a)^2. Writes the pose and the
    information of the match alone (weight * J^T J at the pose); returns (cost, iterations). Ends where a
    step is shorter than `tolerance` (m, and about a third of it in rad) or saves less than that share.
    """
    trial, step, system = np.empty(3), np.empty(3), np.empty((3, 3))
    hessian, curvature, gradient = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    new_hessian, new_curvature, new_gradient = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    pose[:] = prediction
    cost = weight * linearise(
        cells, table, origin, inverse_resolution, points, pose, hessian, curvature, gradient
    )
    damping = 0.0
    iterations = 0
    while iterations < max_iterations and damping < LARGEST_DAMPING:
        iterations += 1
        away = pose - prediction
        if not newton_step(hessian, curvature, gradient, weight, prior, away, damping, system, step):
            damping = max(4.0 * damping, FIRST_DAMPING)
            continue
        trial[:] = pose + step
        new_cost = weight * linearise(
            cells, table, origin, inverse_resolution, points, trial, new_hessian, new_curvature, new_gradient
        ) + prior_cost(trial, prediction, prior)
        small = (
            step[0] ** 2 + step[1] ** 2 < tolerance * tolerance and step[2] ** 2 < 0.1 * tolerance * tolerance
        )
        if new_cost < cost:
            small = small or cost - new_cost < tolerance * cost
            pose[:], hessian[:], curvature[:], gradient[:] = trial, new_hessian, new_curvature, new_gradient
            cost = new_cost
            damping = 0.25 * damping if damping > 0.1 else 0.0
        else:
            damping = max(4.0 * damping, FIRST_DAMPING)
        if small:
            break
    information[:] = weight * hessian
    return cost, iterations


@kernel
def objective(
    cells: Cells,
    table: Float32Array,
    origin: FloatArray,
    inverse_resolution: float,
    points: FloatArray,
    prediction: FloatArray,
    prior: FloatArray,
    weight: float,
    pose: FloatArray,
    out: FloatArray,
) -> None:
    """Cost of a pose as in `align`, its gradient (3) and the Hessian `newton_step` takes (9) into `out`."""
    hessian, curvature, system = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    gradient, away = np.empty(3), pose - prediction
    cost = linearise(cells, table, origin, inverse_resolution, points, pose, hessian, curvature, gradient)
    out[0] = weight * cost + prior_cost(pose, prediction, prior)
    out[1:4] = 2.0 * (weight * gradient + prior * away)
    newton_step(hessian, curvature, gradient, weight, prior, away, 0.0, system, np.empty(3))
    out[4:] = 2.0 * system.ravel()
