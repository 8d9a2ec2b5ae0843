"""Kernel that tells from a scan alone whether it shows bare walls: whether all its walls run one way."""

import math

import numpy as np

from glassslam.accelerate import kernel
from glassslam.records import Float32Array

_CHORD = 0.6
_WIDEST = 0.5
_STRAIGHT = 0.05


@kernel
def wall_spread(
    ranges: Float32Array, first: float, step: float, nearest: float, farthest: float
) -> tuple[float, float]:
    """How far the walls of a scan differ in direction, and the direction of most of them.

    An echo on one straight line with its neighbours on both sides, the first ones that are 0.6 m apart, tells
    a direction. Others with such neighbours are corners, posts or edges: they count as all directions at
    once. `ranges` (n,) are in m, `first` and `step` the direction of the first beam and the angle between
    beams in rad, `nearest` and `farthest` the limits of ranges that are echoes, m.

    The first result is the mean squared sine of the angle between walls and the direction of most, in
    [0, 0.5]: 0 where all are parallel, 0.5 where nothing tells. The second is that direction in the frame of
    the laser, rad, in (-pi/2, pi/2].
    """
    count = ranges.shape[0]
    xs, ys = np.empty(count), np.empty(count)
    is_echo = np.empty(count, dtype=np.bool_)
    for k in range(count):
        is_echo[k] = nearest <= ranges[k] <= farthest
        xs[k] = ranges[k] * math.cos(first + k * step)
        ys[k] = ranges[k] * math.sin(first + k * step)
    most = max(1, int(min(float(count), _WIDEST / abs(step))))
    even = odd = 0.0
    asked = 0
    for k in range(count):
        if not is_echo[k]:
            continue
        for width in range(int(min(float(most), max(1.0, 0.5 * _CHORD / (abs(step) * ranges[k])))), most + 1):
            i, j = k - width, k + width
            if i < 0 or j >= count or not (is_echo[i] and is_echo[j]):
                break
            dx, dy = xs[j] - xs[i], ys[j] - ys[i]
            length = math.hypot(dx, dy)
            if length < _CHORD and width < most:
                continue
            asked += 1
            if length > 0.0 and abs((xs[k] - xs[i]) * dy - (ys[k] - ys[i]) * dx) <= _STRAIGHT * length:
                even += (dx * dx - dy * dy) / (length * length)
                odd += 2.0 * dx * dy / (length * length)
            break
    if asked == 0:
        return 0.5, 0.0
    return 0.5 * (1.0 - math.hypot(even, odd) / asked), 0.5 * math.atan2(odd, even)
