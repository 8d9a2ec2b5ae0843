"""Kernels of the probability grid.

A cell is a uint16: 0 means never observed, any other value v means the log odds `lower + (v - 1) * LOG_ODDS_STEP`.
Columns run along x, rows along y; the cell (0, 0) has its lower left corner at the origin.
"""

import numpy as np

from glassslam.accelerate import kernel

LOG_ODDS_STEP = 1e-3
UNKNOWN = 0


@kernel
def _update(value, step, prior, top):  # type: ignore[no-untyped-def]
    """Cell value after one observation; an unknown cell starts from even odds."""
    if value == 0:
        value = prior
    new = np.int64(value) + step
    return np.uint16(min(max(new, 1), top))


@kernel
def _mark_hits(cells, marks, mark, points, inverse_resolution, hit_step, prior, top):  # type: ignore[no-untyped-def]
    """Raise every cell that holds a return, once per scan."""
    for k in range(points.shape[0]):
        column = np.int64(np.floor(points[k, 0] * inverse_resolution))
        row = np.int64(np.floor(points[k, 1] * inverse_resolution))
        if marks[row, column] != mark:
            marks[row, column] = mark
            cells[row, column] = _update(cells[row, column], hit_step, prior, top)


@kernel
def _clear_ray(cells, marks, mark, x0, y0, x1, y1, miss_step, prior, top):  # type: ignore[no-untyped-def]
    """Lower every unmarked cell between two points given in cell units (Amanatides and Woo 1987)."""
    column, row = np.int64(np.floor(x0)), np.int64(np.floor(y0))
    last_column, last_row = np.int64(np.floor(x1)), np.int64(np.floor(y1))
    dx, dy = x1 - x0, y1 - y0
    step_x = 1 if dx > 0 else -1
    step_y = 1 if dy > 0 else -1
    delta_x = abs(1.0 / dx) if dx != 0.0 else np.inf
    delta_y = abs(1.0 / dy) if dy != 0.0 else np.inf
    next_x = ((column + 1 - x0) if dx > 0 else (x0 - column)) * delta_x if dx != 0.0 else np.inf
    next_y = ((row + 1 - y0) if dy > 0 else (y0 - row)) * delta_y if dy != 0.0 else np.inf
    for _ in range(abs(last_column - column) + abs(last_row - row) + 1):
        if marks[row, column] != mark:
            marks[row, column] = mark
            cells[row, column] = _update(cells[row, column], miss_step, prior, top)
        if next_x < next_y:
            next_x += delta_x
            column += step_x
        else:
            next_y += delta_y
            row += step_y


@kernel
def insert_scan(  # type: ignore[no-untyped-def]
    cells, marks, mark, sensor, hits, free_ends, inverse_resolution, hit_step, miss_step, prior, top
):
    """Enter one scan: hits first, then the free space of all rays, each cell at most once.

    Coordinates are metres from the lower left corner of the grid; all must lie inside.
    """
    _mark_hits(cells, marks, mark, hits, inverse_resolution, hit_step, prior, top)
    x0, y0 = sensor[0] * inverse_resolution, sensor[1] * inverse_resolution
    for k in range(hits.shape[0]):
        _clear_ray(
            cells, marks, mark, x0, y0, hits[k, 0] * inverse_resolution, hits[k, 1] * inverse_resolution,
            miss_step, prior, top,
        )  # fmt: skip
    for k in range(free_ends.shape[0]):
        _clear_ray(
            cells, marks, mark, x0, y0, free_ends[k, 0] * inverse_resolution,
            free_ends[k, 1] * inverse_resolution, miss_step, prior, top,
        )  # fmt: skip
