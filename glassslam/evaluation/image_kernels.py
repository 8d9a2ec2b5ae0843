"""Kernels of map alignment: how well points moved by a motion lie on the occupied cells of a map."""

import numpy as np

from glassslam.accelerate import kernel
from glassslam.records import FloatArray


@kernel
def distance_at(x: float, y: float, distances: FloatArray, low: FloatArray, cell: float, far: float) -> float:
    """Distance to the nearest occupied cell at a place, between cell centres; `far` off the map."""
    column, row = (x - low[0]) / cell - 0.5, (y - low[1]) / cell - 0.5
    i, j = int(np.floor(column)), int(np.floor(row))
    if i < 0 or j < 0 or i + 1 >= distances.shape[1] or j + 1 >= distances.shape[0]:
        return far
    u, v = column - i, row - j
    lower = (1.0 - u) * distances[j, i] + u * distances[j, i + 1]
    upper = (1.0 - u) * distances[j + 1, i] + u * distances[j + 1, i + 1]
    return float((1.0 - v) * lower + v * upper)


@kernel
def closeness(
    motion: FloatArray, points: FloatArray, distances: FloatArray, low: FloatArray, cell: float, width: float
) -> float:
    """Mean of exp(-d^2 / 2 width^2) over points (n, 2) moved by x, y, theta."""
    c, s = np.cos(motion[2]), np.sin(motion[2])
    total = 0.0
    for k in range(points.shape[0]):
        x = c * points[k, 0] - s * points[k, 1] + motion[0]
        y = s * points[k, 0] + c * points[k, 1] + motion[1]
        d = distance_at(x, y, distances, low, cell, 1e3)
        total += np.exp(-0.5 * (d / width) ** 2)
    return float(total / max(points.shape[0], 1))


@kernel
def closeness_of_all(
    motions: FloatArray, points: FloatArray, distances: FloatArray, low: FloatArray, cell: float,
    width: float, out: FloatArray,
) -> None:  # fmt: skip
    """Add the closeness of each of the motions (m, 3)."""
    for k in range(motions.shape[0]):
        out[k] += closeness(motions[k], points, distances, low, cell, width)
