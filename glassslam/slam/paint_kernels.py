"""Kernel that lays submaps over each other."""

import math

import numpy as np
from numpy.typing import NDArray

from glassslam.accelerate import kernel
from glassslam.grid.kernels import Cells
from glassslam.records import Float32Array, FloatArray


@kernel
def paint(
    cells: Cells,
    origin: FloatArray,
    resolution: float,
    grid_from_map: FloatArray,
    shades: Float32Array,
    locked: int,
    corner: FloatArray,
    map_resolution: float,
    first_row: int,
    first_column: int,
    stop_row: int,
    stop_column: int,
    brightness: Float32Array,
    state: NDArray[np.uint8],
) -> None:
    """Lay one grid over part of a picture; `state` becomes 1 where observed, 2 where a cell was locked.

    `shades` holds for every cell value the light it adds (above 0) or the share it takes away (below 0).
    """
    cosine, sine = math.cos(grid_from_map[2]), math.sin(grid_from_map[2])
    for row in range(first_row, stop_row):
        y = corner[1] + (row + 0.5) * map_resolution
        for column in range(first_column, stop_column):
            x = corner[0] + (column + 0.5) * map_resolution
            gx = cosine * x - sine * y + grid_from_map[0] - origin[0]
            gy = sine * x + cosine * y + grid_from_map[1] - origin[1]
            c, r = math.floor(gx / resolution), math.floor(gy / resolution)
            if not (0 <= r < cells.shape[0] and 0 <= c < cells.shape[1]):
                continue
            value = cells[r, c]
            if value == 0:
                continue
            shade = shades[value]
            light = brightness[row, column]
            light = light + shade if shade >= 0.0 else light * (np.float32(1.0) + shade)
            brightness[row, column] = min(light, np.float32(1.0))
            state[row, column] = 2 if value == locked else max(state[row, column], np.uint8(1))
