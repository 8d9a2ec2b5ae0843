"""Kernels of the probability grid.

A cell is a uint16: 0 means never observed, a value v up to `top` means the log odds
`lower + (v - 1) * LOG_ODDS_STEP`, and `top` + 1 is locked: occupied, whatever is observed later.
Columns run along x, rows along y; the cell (0, 0) has its lower left corner at the origin.
"""

import math
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from glassslam.accelerate import kernel
from glassslam.records import FloatArray

Cells: TypeAlias = NDArray[np.uint16]


@kernel
def updated(value: np.uint16, step: int, prior: int, top: int) -> np.uint16:
    """Cell value after one observation; an unknown cell starts from even odds, a locked one stays."""
    if value > top:
        return value
    odds = np.int64(prior) if value == 0 else np.int64(value)
    return np.uint16(min(max(int(odds) + step, 1), top))


@kernel
def mark_hits(
    cells: Cells,
    marks: Cells,
    mark: np.uint16,
    points: FloatArray,
    inverse_resolution: float,
    step: int,
    prior: int,
    top: int,
) -> None:
    """Raise every cell that holds a return, once per scan."""
    for k in range(points.shape[0]):
        column = math.floor(points[k, 0] * inverse_resolution)
        row = math.floor(points[k, 1] * inverse_resolution)
        if marks[row, column] != mark:
            marks[row, column] = mark
            cells[row, column] = updated(cells[row, column], step, prior, top)


@kernel
def clear_ray(
    cells: Cells,
    marks: Cells,
    mark: np.uint16,
    x0: float,
    y0: float,
    x1: float,
    y1: float,
    step: int,
    prior: int,
    top: int,
    barrier: int,
) -> None:
    """Lower every unmarked cell between two points given in cell units (Amanatides and Woo 1987).

    The ray ends before the first cell of at least the value `barrier`.
    The path never leaves the box spanned by the two end cells, whatever the rounding: an axis that
    has reached its last cell is stepped no more.
    """
    column, row = math.floor(x0), math.floor(y0)
    last_column, last_row = math.floor(x1), math.floor(y1)
    dx, dy = x1 - x0, y1 - y0
    step_x, step_y = 1 if dx > 0.0 else -1, 1 if dy > 0.0 else -1
    next_x = next_y = delta_x = delta_y = math.inf
    if column != last_column:
        delta_x = abs(1.0 / dx)
        next_x = (column + 1 - x0 if dx > 0.0 else x0 - column) * delta_x
    if row != last_row:
        delta_y = abs(1.0 / dy)
        next_y = (row + 1 - y0 if dy > 0.0 else y0 - row) * delta_y
    for _ in range(abs(last_column - column) + abs(last_row - row) + 1):
        if cells[row, column] >= barrier:
            return
        if marks[row, column] != mark:
            marks[row, column] = mark
            cells[row, column] = updated(cells[row, column], step, prior, top)
        if next_x < next_y:
            column += step_x
            next_x = next_x + delta_x if column != last_column else math.inf
        else:
            row += step_y
            next_y = next_y + delta_y if row != last_row else math.inf


@kernel
def extend_box(points: FloatArray, box: FloatArray) -> bool:
    """Widen the box (x low, y low, x high, y high) to hold the points; False when one is not finite."""
    finite = True
    for k in range(points.shape[0]):
        x, y = points[k, 0], points[k, 1]
        finite = finite and math.isfinite(x) and math.isfinite(y)
        box[0], box[1] = min(box[0], x), min(box[1], y)
        box[2], box[3] = max(box[2], x), max(box[3], y)
    return finite


@kernel
def insert_scan(
    cells: Cells,
    marks: Cells,
    mark: np.uint16,
    sensor: FloatArray,
    hits: FloatArray,
    free_ends: FloatArray,
    inverse_resolution: float,
    hit_step: int,
    miss_step: int,
    prior: int,
    top: int,
    barrier: int,
) -> None:
    """Enter one scan: hits first, then the free space of all rays, each cell at most once.

    Coordinates are metres from the lower left corner of the grid; all must lie inside. `marks` holds
    the number `mark` of the scan that changed a cell last. Rays without echo end before cells of at least
    the value `barrier`.
    """
    mark_hits(cells, marks, mark, hits, inverse_resolution, hit_step, prior, top)
    x0, y0 = sensor[0] * inverse_resolution, sensor[1] * inverse_resolution
    for k in range(hits.shape[0]):
        x1, y1 = hits[k, 0] * inverse_resolution, hits[k, 1] * inverse_resolution
        clear_ray(cells, marks, mark, x0, y0, x1, y1, miss_step, prior, top, top + 2)
    for k in range(free_ends.shape[0]):
        x1, y1 = free_ends[k, 0] * inverse_resolution, free_ends[k, 1] * inverse_resolution
        clear_ray(cells, marks, mark, x0, y0, x1, y1, miss_step, prior, top, barrier)
