"""Kernels of Revisit Scan Fusion: rays cast in two maps at once."""

import math

import numpy as np
from numpy.typing import NDArray

from glassslam.accelerate import kernel
from glassslam.records import Float32Array, FloatArray

LIDAR, SONAR = 1, 2


@kernel
def ray_cells(row: int, column: int, angle: float, path: NDArray[np.int64], rows: int, columns: int) -> int:
    """Cells of a ray from a cell to the border (Bresenham 1965), into `path` (k, 2); return their number."""
    reach = 2.0 * (rows + columns)
    run, rise = round(reach * math.cos(angle)), round(reach * math.sin(angle))
    step_column, step_row = 1 if run > 0 else -1, 1 if rise > 0 else -1
    run, rise = abs(run), abs(rise)
    error = run - rise
    count = 0
    while 0 <= row < rows and 0 <= column < columns:
        path[count, 0], path[count, 1] = row, column
        count += 1
        doubled = 2 * error
        if doubled > -rise:
            error -= rise
            column += step_column
        if doubled < run:
            error += run
            row += step_row
    return count


@kernel
def first_stop(occupied: NDArray[np.bool_], path: NDArray[np.int64], count: int) -> int:
    """Number of the cell after the first at which a path is stopped; `count` when there is none.

    It is stopped by an occupied cell, and by two that touch at the corner through which it would slip.
    """
    for k in range(1, count):
        row, column = path[k, 0], path[k, 1]
        if occupied[row, column]:
            return k
        before_row, before_column = path[k - 1, 0], path[k - 1, 1]
        # on a straight step one of these two is free: the cell before, or this one
        if occupied[before_row, column] and occupied[row, before_column] and k > 1:
            return k
    return count


@kernel
def _length(path: NDArray[np.int64], count: int, stop: int) -> float:
    """Distance of the stop, or of the border, from the first cell, cells (pi-map, equations 11 and 12)."""
    last = min(stop, count - 1)
    return math.hypot(path[last, 0] - path[0, 0], path[last, 1] - path[0, 1])


@kernel
def revisit(
    rays: FloatArray,
    lidar: NDArray[np.bool_],
    sonar: NDArray[np.bool_],
    gap: float,
    everything: bool,
    free: float,
    occupied: float,
    path: NDArray[np.int64],
    fused: Float32Array,
    source: NDArray[np.uint8],
) -> int:
    """Write the rays (x, y, yaw), in cells, into the fused map; return how many met glass.

    `path` has room for rows + columns cells. A ray meets glass when its lidar length exceeds its sonar
    length by more than `gap` cells (pi-map, equation 13); other rays are written only with `everything`, and
    then as the lidar has them (equations 14 and 15). A ray that nothing stops is not written. Walls of one
    cell that run aslant hold it as well, which Bresenham's line would slip through.
    """
    rows, columns = fused.shape
    met = 0
    for k in range(rays.shape[0]):
        row, column = math.floor(rays[k, 1]), math.floor(rays[k, 0])
        count = ray_cells(row, column, rays[k, 2], path, rows, columns)
        if count < 2:
            continue
        by_lidar, by_sonar = first_stop(lidar, path, count), first_stop(sonar, path, count)
        glass = _length(path, count, by_lidar) - _length(path, count, by_sonar) > gap
        stop = by_sonar if glass else by_lidar
        met += glass
        if stop == count or not (glass or everything):
            continue
        sensor = SONAR if glass else LIDAR
        for c in range(stop):
            fused[path[c, 0], path[c, 1]] = free
            source[path[c, 0], path[c, 1]] = sensor
        if (sonar if glass else lidar)[path[stop, 0], path[stop, 1]]:
            fused[path[stop, 0], path[stop, 1]] = occupied
            source[path[stop, 0], path[stop, 1]] = sensor
    return met
