"""Kernels that tell how much the walls say of a match: how firmly they hold it, how much of it is known."""

import math

import numpy as np
from numpy.typing import NDArray

from glassslam.accelerate import kernel
from glassslam.records import Float32Array, FloatArray

_LEAST_TURNING = 1e-12
_HELD_SHARE = 0.25
"""Information along against across from which walls hold a match; bare corridors stay below 0.2."""
_SLIDE = 0.5
_LEAST_LOSS = 1e-6


@kernel
def weakest_direction(information: FloatArray) -> tuple[float, float]:
    """Direction of translation with the least information when the rotation follows freely, and its share.

    `information` (3, 3) is that of `MatchResult`. The direction is in rad, in (-pi/2, pi/2]; the share is its
    information divided by that across it, in [0, 1].
    """
    turning = max(information[2, 2], _LEAST_TURNING)
    xx = information[0, 0] - information[0, 2] * information[0, 2] / turning
    xy = information[0, 1] - information[0, 2] * information[1, 2] / turning
    yy = information[1, 1] - information[1, 2] * information[1, 2] / turning
    spread = math.hypot(0.5 * (xx - yy), xy)
    heading = 0.5 * math.atan2(2.0 * xy, xx - yy) + 0.5 * math.pi
    if heading > 0.5 * math.pi:
        heading -= math.pi
    middle = 0.5 * (xx + yy)
    if not middle + spread > 0.0:
        return heading, 1.0
    return heading, max(middle - spread, 0.0) / (middle + spread)


@kernel
def mean_probability(
    cells: NDArray[np.uint16],
    table: Float32Array,
    origin: FloatArray,
    inverse_resolution: float,
    points: FloatArray,
    pose: FloatArray,
    x: float,
    y: float,
) -> float:
    """Mean P(occupied) of the cells under points (n, 2) seen from a pose that is shifted by (x, y), m."""
    rows, columns = cells.shape
    x, y = pose[0] + x - origin[0], pose[1] + y - origin[1]
    cosine, sine = math.cos(pose[2]), math.sin(pose[2])
    total = 0.0
    for k in range(points.shape[0]):
        u = (cosine * points[k, 0] - sine * points[k, 1] + x) * inverse_resolution
        v = (sine * points[k, 0] + cosine * points[k, 1] + y) * inverse_resolution
        inside = 0.0 <= u < columns and 0.0 <= v < rows
        total += table[cells[int(v), int(u)]] if inside else table[0]
    return float(total / points.shape[0])


@kernel
def hold_of(
    cells: NDArray[np.uint16],
    table: Float32Array,
    origin: FloatArray,
    inverse_resolution: float,
    points: FloatArray,
    pose: FloatArray,
    information: FloatArray,
) -> tuple[float, float]:
    """How firmly walls hold a match along the direction they hold least, and that direction, rad.

    The first is what the fit loses when the scan slides half a metre along the direction, to the better
    side, as a share of what it loses across it: about 0 along bare walls. The curvature of the match alone
    cannot tell: cells of a wall differ by chance, and a scan fits each pattern of them best at one place.
    It is 1 where the curvatures along and across differ too little for bare walls.
    """
    heading, share = weakest_direction(information)
    if share > _HELD_SHARE:
        return 1.0, heading
    dx, dy = _SLIDE * math.cos(heading), _SLIDE * math.sin(heading)
    here = mean_probability(cells, table, origin, inverse_resolution, points, pose, 0.0, 0.0)
    along = across = 0.0
    for sign in (-1.0, 1.0):
        x, y = sign * dx, sign * dy
        along = max(along, mean_probability(cells, table, origin, inverse_resolution, points, pose, x, y))
        across = max(across, mean_probability(cells, table, origin, inverse_resolution, points, pose, -y, x))
    return (here - along) / max(here - across, _LEAST_LOSS), heading


@kernel
def known_share(
    cells: NDArray[np.uint16],
    origin: FloatArray,
    inverse_resolution: float,
    points: FloatArray,
    pose: FloatArray,
) -> float:
    """Share of the points (n, 2), seen from a pose in the frame of the grid, that fall on observed cells."""
    rows, columns = cells.shape
    x, y = pose[0] - origin[0], pose[1] - origin[1]
    cosine, sine = math.cos(pose[2]), math.sin(pose[2])
    known = 0
    for k in range(points.shape[0]):
        u = (cosine * points[k, 0] - sine * points[k, 1] + x) * inverse_resolution
        v = (sine * points[k, 0] + cosine * points[k, 1] + y) * inverse_resolution
        if 0.0 <= u < columns and 0.0 <= v < rows and cells[int(v), int(u)] != 0:
            known += 1
    return float(known / max(points.shape[0], 1))
