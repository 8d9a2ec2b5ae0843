"""Kernels that find straight surfaces in the successive readings of one sonar.

A smooth surface answers along its normal wherever that lies in the cone, so the range is the distance of the
sonar from the surface, not the distance along the axis (regions of constant depth, Leonard and
Durrant-Whyte 1992). A sonar that moves past a wall n . x = c therefore reads c - n . s at its positions s:
the change of the range with the motion tells the normal much better than the axis does.
"""

import math

from glassslam.accelerate import kernel
from glassslam.records import FloatArray

ROUNDS = 6
COLUMNS = 8
"""first, last, normal, distance c, root mean square, spread along the surface, low and high foot."""


@kernel
def fit_surface(readings: FloatArray, first: int, last: int, weight: float, out: FloatArray) -> None:
    """Line n . x = c through readings (stamp, x, y, axis, range) `first` to `last`, into a row of COLUMNS.

    Least squares with the mean axis of the sonar as prior of the normal: `weight` is the ratio of the
    variances of a reading and of the prior, (m/rad)^2.
    """
    count = last - first + 1
    mean_x = mean_y = mean_range = 0.0
    cosine = sine = 0.0
    for k in range(first, last + 1):
        mean_x += readings[k, 1] / count
        mean_y += readings[k, 2] / count
        mean_range += readings[k, 4] / count
        cosine += math.cos(readings[k, 3])
        sine += math.sin(readings[k, 3])
    axis = math.atan2(sine, cosine)
    normal = axis
    for _ in range(ROUNDS):
        c, s = math.cos(normal), math.sin(normal)
        gradient = weight * (normal - axis)
        curvature = weight
        for k in range(first, last + 1):
            dx, dy = readings[k, 1] - mean_x, readings[k, 2] - mean_y
            along = c * dy - s * dx
            gradient += along * (readings[k, 4] - mean_range + c * dx + s * dy)
            curvature += along * along
        normal -= gradient / curvature
    c, s = math.cos(normal), math.sin(normal)
    squares = spread = 0.0
    low, high = math.inf, -math.inf
    for k in range(first, last + 1):
        dx, dy = readings[k, 1] - mean_x, readings[k, 2] - mean_y
        along = c * dy - s * dx
        squares += (readings[k, 4] - mean_range + c * dx + s * dy) ** 2
        spread += along * along
        low, high = min(low, along), max(high, along)
    out[0], out[1] = first, last
    out[2], out[3] = normal, mean_range + c * mean_x + s * mean_y
    out[4] = math.sqrt(squares / count)
    out[5], out[6], out[7] = spread, low, high


@kernel
def surface_pieces(
    readings: FloatArray,
    weight: float,
    half_width: float,
    max_pause: float,
    max_span: float,
    max_residual: float,
    min_readings: int,
    pieces: FloatArray,
) -> int:
    """Cut the readings of one sonar into straight pieces, as long as they stay straight; return their number.

    A piece begins at the first reading that no piece holds and takes on readings in order while none comes
    later than `max_pause` after the one before, the feet span at most `max_span`, the root mean square stays
    below `max_residual` and the normal in the cone.
    """
    found = 0
    first = 0
    total = readings.shape[0]
    best, trial = pieces[total], pieces[total + 1]
    while first < total:
        last = first
        while last + 1 < total and readings[last + 1, 0] - readings[last, 0] <= max_pause:
            fit_surface(readings, first, last + 1, weight, trial)
            turned = abs(trial[2] - math.atan2(math.sin(readings[first, 3]), math.cos(readings[first, 3])))
            turned = min(turned, abs(2.0 * math.pi - turned))
            if trial[4] > max_residual or trial[7] - trial[6] > max_span or turned > half_width:
                break
            last += 1
            for column in range(COLUMNS):
                best[column] = trial[column]
        if last - first + 1 >= min_readings:
            for column in range(COLUMNS):
                pieces[found, column] = best[column]
            found += 1
            first = last + 1
        else:
            first += 1
    return found
