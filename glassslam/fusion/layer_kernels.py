"""Kernels of readings of sonars: where they end and what they pass."""

import math

import numpy as np
from numpy.typing import NDArray

from glassslam.accelerate import kernel
from glassslam.records import FloatArray


@kernel
def count_ends(
    starts: FloatArray, ends: FloatArray, ended: NDArray[np.int64], passed: NDArray[np.int64]
) -> None:
    """Count, by cell, the rays that end in it and those that pass it; points (k, 2) in cells, all inside."""
    for k in range(starts.shape[0]):
        x0, y0, x1, y1 = starts[k, 0], starts[k, 1], ends[k, 0], ends[k, 1]
        end_row, end_column = math.floor(y1), math.floor(x1)
        steps = math.ceil(2.0 * math.hypot(x1 - x0, y1 - y0)) + 1
        row = column = -1
        for s in range(steps):
            r, c = math.floor(y0 + (y1 - y0) * s / steps), math.floor(x0 + (x1 - x0) * s / steps)
            if (r == row and c == column) or (r == end_row and c == end_column):
                continue
            row, column = r, c
            passed[r, c] += 1
        ended[end_row, end_column] += 1


@kernel
def clear_rays(
    starts: FloatArray, ends: FloatArray, occupied: NDArray[np.bool_], cleared: NDArray[np.bool_]
) -> None:
    """Mark the cells of rays up to the first occupied one, or to the border; points (k, 2) in cells.

    Two occupied cells that touch at a corner hold a ray as well, which would slip through between them.
    """
    rows, columns = occupied.shape
    for k in range(starts.shape[0]):
        x, y = starts[k, 0], starts[k, 1]
        dx, dy = ends[k, 0] - x, ends[k, 1] - y
        steps = math.ceil(2.0 * math.hypot(dx, dy)) + 1
        before_row, before_column = math.floor(y), math.floor(x)
        for s in range(steps):
            row, column = math.floor(y + dy * s / steps), math.floor(x + dx * s / steps)
            if not (0 <= row < rows and 0 <= column < columns) or occupied[row, column]:
                break
            # on a straight step one of these two is free: the cell before, or this one
            if occupied[before_row, column] and occupied[row, before_column]:
                break
            before_row, before_column = row, column
            cleared[row, column] = True
