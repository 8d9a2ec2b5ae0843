"""Kernels of the exhaustive search in a small window."""

import math

import numpy as np

from glassslam.accelerate import kernel
from glassslam.grid.kernels import Cells
from glassslam.records import Float32Array, FloatArray


@kernel
def _sum_shifted(
    cells: Cells,
    scores: Float32Array,
    x: float,
    y: float,
    cosine: float,
    sine: float,
    inverse_resolution: float,
    points: FloatArray,
    sums: Float32Array,
) -> None:
    """Add up the scores of the cells hit, for every shift of the scan by whole cells.

    (x, y) is the scan position from the grid's corner, m. What falls outside of the grid scores 0.
    """
    rows, columns = cells.shape
    side = sums.shape[0]
    for k in range(points.shape[0]):
        px, py = points[k, 0], points[k, 1]
        c = math.floor((cosine * px - sine * py + x) * inverse_resolution) - side // 2
        r = math.floor((sine * px + cosine * py + y) * inverse_resolution) - side // 2
        if c >= 0 and r >= 0 and c + side <= columns and r + side <= rows:
            for dy in range(side):
                for dx in range(side):
                    sums[dy, dx] += scores[cells[r + dy, c + dx]]
            continue
        for dy in range(max(0, -r), min(side, rows - r)):
            for dx in range(max(0, -c), min(side, columns - c)):
                sums[dy, dx] += scores[cells[r + dy, c + dx]]


@kernel
def exhaustive_search(
    cells: Cells,
    table: Float32Array,
    origin: FloatArray,
    inverse_resolution: float,
    points: FloatArray,
    guess: FloatArray,
    steps: int,
    angle_steps: int,
    angle_step: float,
    translation_cost: float,
    rotation_cost: float,
    pose: FloatArray,
) -> float:
    """Best pose on the raster of cells and angles around a guess; returns its penalised score.

    Score: mean P(occupied) of the cells hit, times exp(-(translation_cost |t| + rotation_cost |theta|)^2)
    as in Cartographer's real-time correlative matcher; a cell never observed scores 0. `steps` is the
    half window in cells.
    """
    scores = table.copy()
    scores[0] = 0.0
    sums = np.empty((2 * steps + 1, 2 * steps + 1), dtype=np.float32)
    best = -1.0
    pose[:] = guess
    for a in range(-angle_steps, angle_steps + 1):
        turn = a * angle_step
        sums[:] = 0.0
        x, y, angle = guess[0] - origin[0], guess[1] - origin[1], guess[2] + turn
        cosine, sine = math.cos(angle), math.sin(angle)
        _sum_shifted(cells, scores, x, y, cosine, sine, inverse_resolution, points, sums)
        for dy in range(-steps, steps + 1):
            for dx in range(-steps, steps + 1):
                shift = math.hypot(dx, dy) / inverse_resolution
                cost = translation_cost * shift + rotation_cost * abs(turn)
                score = sums[dy + steps, dx + steps] / points.shape[0] * math.exp(-cost * cost)
                if score > best:
                    best = score
                    pose[0], pose[1] = guess[0] + dx / inverse_resolution, guess[1] + dy / inverse_resolution
                    pose[2] = angle
    return best
