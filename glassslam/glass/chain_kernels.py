"""Kernel that joins surface pieces into chains."""

import math

import numpy as np
from numpy.typing import NDArray

from glassslam.accelerate import kernel
from glassslam.records import FloatArray


@kernel
def _root(parents: NDArray[np.int64], piece: int) -> int:
    while parents[piece] != piece:
        parents[piece] = parents[parents[piece]]
        piece = parents[piece]
    return piece


@kernel
def _axial(a: float, b: float) -> float:
    """Angle between undirected lines, in [0, pi / 2], rad."""
    return abs((a - b + 0.5 * math.pi) % math.pi - 0.5 * math.pi)


@kernel
def join_pieces(
    centres: FloatArray,
    normals: FloatArray,
    max_gap: float,
    distance: float,
    touching: float,
    slack: float,
    parents: NDArray[np.int64],
) -> None:
    """Join pieces that lie on each other's tangents; `parents` becomes the least piece of every one's chain.

    Pieces up to `max_gap` apart belong together when their normals agree within twice the `slack`, and the
    way from one to the other is square to both normals but for the slack and an offset of `distance`. Of
    pieces nearer than `touching` the way says nothing.
    """
    count = centres.shape[0]
    for i in range(count):
        parents[i] = i
    for i in range(count):
        for j in range(i + 1, count):
            dx, dy = centres[j, 0] - centres[i, 0], centres[j, 1] - centres[i, 1]
            square = dx * dx + dy * dy
            if square > max_gap * max_gap or _axial(normals[i], normals[j]) >= 2.0 * slack:
                continue
            length = math.sqrt(square)
            if length >= touching:
                allowed = slack + math.atan2(distance, length)
                along = math.atan2(dy, dx) - 0.5 * math.pi
                if _axial(normals[i], along) >= allowed or _axial(normals[j], along) >= allowed:
                    continue
            a, b = _root(parents, i), _root(parents, j)
            parents[max(a, b)] = min(a, b)
    for i in range(count):
        parents[i] = _root(parents, i)
