"""Kernel that counts the beams of a lidar that head for a wall."""

import math

import numpy as np
from numpy.typing import NDArray

from glassslam.accelerate import kernel
from glassslam.records import FloatArray

_STEP = 0.5


@kernel
def count_meetings(start: FloatArray, ends: FloatArray, walls: NDArray[np.bool_], beyond: float) -> int:
    """Count the rays that meet a wall on the way or up to `beyond` cells after it; ends (k, 2), in cells."""
    rows, columns = walls.shape
    met = 0
    for k in range(ends.shape[0]):
        dx, dy = ends[k, 0] - start[0], ends[k, 1] - start[1]
        length = math.hypot(dx, dy)
        if length == 0.0:
            continue
        for s in range(math.floor((length + beyond) / _STEP) + 1):
            share = s * _STEP / length
            row, column = math.floor(start[1] + share * dy), math.floor(start[0] + share * dx)
            if not (0 <= row < rows and 0 <= column < columns):
                break
            if walls[row, column]:
                met += 1
                break
    return met
