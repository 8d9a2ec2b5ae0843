"""Kernel that tells where walls of one part of a run stand in what another part saw to be free."""

import math

import numpy as np
from numpy.typing import NDArray

from glassslam.accelerate import kernel
from glassslam.records import Float32Array, FloatArray


@kernel
def count_conflicts(
    cells: NDArray[np.uint16],
    table: Float32Array,
    origin: FloatArray,
    inverse_resolution: float,
    points: FloatArray,
    pose: FloatArray,
    margin: int,
    free_below: float,
) -> tuple[int, int]:
    """Points (n, 2), seen from a pose in the frame of the grid, on observed cells; and those amid free space.

    A point is amid free space where P(occupied) of every cell within `margin` cells is below `free_below`.
    """
    rows, columns = cells.shape
    x, y = pose[0] - origin[0], pose[1] - origin[1]
    cosine, sine = math.cos(pose[2]), math.sin(pose[2])
    known = conflicts = 0
    for k in range(points.shape[0]):
        u = (cosine * points[k, 0] - sine * points[k, 1] + x) * inverse_resolution
        v = (sine * points[k, 0] + cosine * points[k, 1] + y) * inverse_resolution
        if not (margin <= u < columns - margin and margin <= v < rows - margin):
            continue
        row, column = int(v), int(u)
        if cells[row, column] == 0:
            continue
        known += 1
        is_free = True
        for i in range(row - margin, row + margin + 1):
            for j in range(column - margin, column + margin + 1):
                is_free = is_free and table[cells[i, j]] < free_below
        conflicts += is_free
    return known, conflicts
