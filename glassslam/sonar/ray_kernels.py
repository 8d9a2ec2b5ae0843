"""Kernels that look along rays of a lidar map from where sonars were.

Coordinates are cells: x along columns, y along rows, cell (row, column) covers [column, column + 1) and
[row, row + 1). Cells are P(occupied), NaN where never observed.
"""

import math

from glassslam.accelerate import kernel
from glassslam.records import Float32Array, FloatArray

STEP = 0.5


@kernel
def first_occupied(
    cells: Float32Array, x: float, y: float, angle: float, reach: float, threshold: float
) -> float:
    """Distance to the first cell of at least `threshold`, cells; inf when there is none within `reach`."""
    rows, columns = cells.shape
    dx, dy = math.cos(angle), math.sin(angle)
    for k in range(math.floor(reach / STEP) + 1):
        row, column = math.floor(y + k * STEP * dy), math.floor(x + k * STEP * dx)
        if not (0 <= row < rows and 0 <= column < columns):
            return math.inf
        if cells[row, column] >= threshold:
            return k * STEP
    return math.inf


@kernel
def nearest_in_cones(
    cells: Float32Array,
    rays: FloatArray,
    half_widths: FloatArray,
    steps: int,
    reach: float,
    threshold: float,
    nearest: FloatArray,
) -> None:
    """Nearest occupied cell in cones of growing half width around rays (x, y, yaw), into `nearest` (k, h).

    Each half width is filled by `steps` rays to each side of those of the half width before it.
    """
    for k in range(rays.shape[0]):
        x, y, yaw = rays[k, 0], rays[k, 1], rays[k, 2]
        best = first_occupied(cells, x, y, yaw, reach, threshold)
        inner = 0.0
        for h in range(half_widths.shape[0]):
            for s in range(1, steps + 1):
                angle = inner + (half_widths[h] - inner) * s / steps
                best = min(best, first_occupied(cells, x, y, yaw - angle, reach, threshold))
                best = min(best, first_occupied(cells, x, y, yaw + angle, reach, threshold))
            nearest[k, h] = best
            inner = half_widths[h]
