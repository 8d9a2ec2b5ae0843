"""Kernels of gradient scan matching: normal equations of one scan, and Levenberg-Marquardt around them."""

import math

import numpy as np

from glassslam.accelerate import kernel
from glassslam.grid.kernels import Cells
from glassslam.matching._generated import occupied_space
from glassslam.records import Float32Array, FloatArray

FIRST_DAMPING = 1.0
"""Residuals stay large at the best pose, so the first steps of an undamped loop would overshoot."""
LARGEST_DAMPING = 1e8


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
    """Sum of squared residuals of all points; fills J^T J (3, 3) and J^T r (3,).

    A point outside the grid counts as unknown: it costs, but does not pull.
    """
    rows, columns = cells.shape
    x, y, theta = pose[0], pose[1], pose[2]
    cosine, sine = math.cos(theta), math.sin(theta)
    cost = h00 = h01 = h02 = h11 = h12 = h22 = g0 = g1 = g2 = 0.0
    for k in range(points.shape[0]):
        px, py = points[k, 0], points[k, 1]
        u = (cosine * px - sine * py + x - origin[0]) * inverse_resolution - 0.5
        v = (sine * px + cosine * py + y - origin[1]) * inverse_resolution - 0.5
        if not (u >= 1.0 and v >= 1.0 and u < columns - 2 and v < rows - 2):
            cost += (1.0 - table[0]) ** 2
            continue
        i, j = int(u), int(v)
        r, jx, jy, jt = occupied_space(
            x, y, theta, px, py, origin[0], origin[1], inverse_resolution, float(i), float(j),
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
        g0, g1, g2 = g0 + jx * r, g1 + jy * r, g2 + jt * r
    hessian[0, 0], hessian[1, 1], hessian[2, 2] = h00, h11, h22
    hessian[0, 1], hessian[0, 2], hessian[1, 2] = h01, h02, h12
    hessian[1, 0], hessian[2, 0], hessian[2, 1] = h01, h02, h12
    gradient[0], gradient[1], gradient[2] = g0, g1, g2
    return cost


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
    """Cost of a pose as in `align`, its gradient and the upper triangle of its Gauss-Newton Hessian, (10,)."""
    hessian, gradient = np.empty((3, 3)), np.empty(3)
    cost = normal_equations(cells, table, origin, inverse_resolution, points, pose, hessian, gradient)
    out[0] = weight * cost + prior_cost(pose, prediction, prior)
    k = 4
    for a in range(3):
        out[1 + a] = 2.0 * (weight * gradient[a] + prior[a] * (pose[a] - prediction[a]))
        for b in range(a + 1):
            out[k] = 2.0 * weight * hessian[a, b]
            k += 1
        out[k - 1] += 2.0 * prior[a]


@kernel
def damped_step(
    hessian: FloatArray,
    gradient: FloatArray,
    weight: float,
    prior: FloatArray,
    away: FloatArray,
    damping: float,
    system: FloatArray,
    step: FloatArray,
) -> bool:
    """Levenberg-Marquardt step at a pose `away` from the prediction; False when there is none."""
    right = np.empty(3)
    for a in range(3):
        for b in range(3):
            system[a, b] = weight * hessian[a, b]
        # the last term keeps directions that neither walls nor prior hold
        system[a, a] = (system[a, a] + prior[a]) * (1.0 + damping) + 1e-9
        right[a] = -weight * gradient[a] - prior[a] * away[a]
    return solve_symmetric(system, right, step)


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
    """Pose of least cost near a prediction, by Levenberg-Marquardt.

    Cost: weight * sum_k (1 - M(T h_k))^2 + sum_a prior[a] * (T_a - prediction_a)^2. Writes the pose and the
    information of the match alone (weight * J^T J at the pose); returns (cost, iterations). Ends where a
    step is shorter than `tolerance` (m, and about a third of it in rad) or saves less than that share.
    """
    trial, step, system = np.empty(3), np.empty(3), np.empty((3, 3))
    hessian, trial_hessian = np.empty((3, 3)), np.empty((3, 3))
    gradient, trial_gradient = np.empty(3), np.empty(3)
    pose[:] = prediction
    cost = weight * normal_equations(
        cells, table, origin, inverse_resolution, points, pose, hessian, gradient
    )
    damping = FIRST_DAMPING
    iterations = 0
    while iterations < max_iterations and damping < LARGEST_DAMPING:
        iterations += 1
        if not damped_step(hessian, gradient, weight, prior, pose - prediction, damping, system, step):
            damping *= 4.0
            continue
        trial[:] = pose + step
        trial_cost = weight * normal_equations(
            cells, table, origin, inverse_resolution, points, trial, trial_hessian, trial_gradient
        ) + prior_cost(trial, prediction, prior)
        small = (
            step[0] ** 2 + step[1] ** 2 < tolerance * tolerance and step[2] ** 2 < 0.1 * tolerance * tolerance
        )
        if trial_cost < cost:
            done = small or cost - trial_cost < tolerance * cost
            pose[:], hessian[:], gradient[:] = trial, trial_hessian, trial_gradient
            cost = trial_cost
            damping *= 0.5
            if done:
                break
        else:
            damping *= 4.0
            if small:
                break
    information[:] = weight * hessian
    return cost, iterations
