"""How the intensity of a flat surface falls off on both sides of its normal."""

import math

import numpy as np

from detectors.accelerate import kernel
from detectors.detection import FloatArray, LabelArray
from detectors.labels import NO_RETURN, SOLID
from detectors.pane_lines import TOLERANCE, TOLERANCE_PER_METRE

# angles from the normal between which matte surfaces are as bright as ever and panes are not, rad
SHOULDER_FROM = math.radians(6.0)
SHOULDER_TO = math.radians(25.0)
# the mirror peak itself, which the fit of the lobe leaves out, rad
CORE = math.radians(1.5)
LOBE_TO = math.radians(30.0)
DIMMEST = 0.005
OUTLIER = 0.25
LOBE_ROUNDS = 4

# parts of the shoulders between which haze still falls, and a dark polished surface no longer does, rad
INNER_FROM = math.radians(12.0)
INNER_TO = math.radians(18.0)
OUTER_FROM = math.radians(21.0)
LEAST_OUTER = 4

# columns of the shoulder counts
TOTAL, ANSWERED, DIM, PASSED = range(4)


@kernel
def count_shoulders(
    ranges: FloatArray,
    labels: LabelArray,
    cosines: FloatArray,
    sines: FloatArray,
    levels: FloatArray,
    angle_min: float,
    angle_increment: float,
    first: int,
    last: int,
    normal: float,
    distance: float,
    faint: float,
    counts: FloatArray,
) -> float:
    """Count beams at the shoulders: all, answered by the surface, faint among these, passed behind it.

    `counts` has shape (2, 4): clockwise and counter-clockwise side. Faint is a level below `faint`. Returns
    the highest level of the core.
    """
    counts[:] = 0.0
    peak = 0.0
    c = math.cos(normal)
    s = math.sin(normal)
    tolerance = TOLERANCE + TOLERANCE_PER_METRE * distance
    for beam in range(first, last):
        phi = angle_min + angle_increment * beam - normal
        away = abs(phi)
        if away > SHOULDER_TO or CORE < away < SHOULDER_FROM:
            continue
        side = 1 if phi > 0.0 else 0
        if labels[beam] == NO_RETURN:
            if away >= SHOULDER_FROM:
                counts[side, TOTAL] += 1.0
                counts[side, PASSED] += 1.0
            continue
        if labels[beam] != SOLID:
            continue
        behind = ranges[beam] * (cosines[beam] * c + sines[beam] * s) - distance
        if away <= CORE:
            if abs(behind) < tolerance:
                peak = max(peak, levels[beam])
            continue
        counts[side, TOTAL] += 1.0
        if abs(behind) < tolerance:
            counts[side, ANSWERED] += 1.0
            counts[side, DIM] += levels[beam] < faint
        elif behind > 2.0 * tolerance:
            counts[side, PASSED] += 1.0
    return peak


@kernel
def least_fall(angles: FloatArray, logs: FloatArray, used: int, faint: float, room: FloatArray) -> float:
    """The smallest fall of the logarithm of the level over the shoulders; +inf where they are not seen.

    On either side haze falls from the begin of the shoulder to its end, as a dark wall beside a bright one
    does not, and still over its outer half, as a polished surface does not. Medians of the faint returns are
    compared: a bright wall in the plane of a pane is no shoulder of it. `angles` are signed; `room` holds as
    many values as there are beams.
    """
    limit = math.log(faint)
    fall = math.inf
    for sign in (-1.0, 1.0):
        begin = _median_between(angles, logs, used, sign, SHOULDER_FROM, INNER_FROM, limit, room)
        inner = _median_between(angles, logs, used, sign, INNER_FROM, INNER_TO, limit, room)
        outer = _median_between(angles, logs, used, sign, OUTER_FROM, LOBE_TO, limit, room)
        if math.isfinite(outer) and math.isfinite(begin):
            fall = min(fall, begin - outer)
        if math.isfinite(outer) and math.isfinite(inner):
            fall = min(fall, inner - outer)
    return fall


@kernel
def _median_between(
    angles: FloatArray,
    logs: FloatArray,
    used: int,
    sign: float,
    low: float,
    high: float,
    limit: float,
    room: FloatArray,
) -> float:
    count = 0
    for k in range(used):
        if low < sign * angles[k] < high and logs[k] < limit:
            room[count] = logs[k]
            count += 1
    if count < LEAST_OUTER:
        return math.inf
    return float(np.median(room[:count]))


@kernel
def _collect_lobe(
    ranges: FloatArray,
    labels: LabelArray,
    cosines: FloatArray,
    sines: FloatArray,
    levels: FloatArray,
    angle_min: float,
    angle_increment: float,
    first: int,
    last: int,
    normal: float,
    distance: float,
    angles: FloatArray,
    logs: FloatArray,
) -> int:
    """Write signed angles to the normal and logarithms of levels of returns on a line; returns how many."""
    used = 0
    c = math.cos(normal)
    s = math.sin(normal)
    tolerance = TOLERANCE + TOLERANCE_PER_METRE * distance
    for beam in range(first, last):
        if labels[beam] != SOLID:
            continue
        phi = angle_min + angle_increment * beam - normal
        behind = ranges[beam] * (cosines[beam] * c + sines[beam] * s) - distance
        if CORE <= abs(phi) <= LOBE_TO and abs(behind) <= tolerance:
            angles[used] = phi
            logs[used] = math.log(max(levels[beam], DIMMEST))
            used += 1
    return used


@kernel
def _weigh_lobe(
    angles: FloatArray, logs: FloatArray, used: int, intercept: float, decay: float, robust: bool
) -> tuple[float, float, float]:
    """One round of the fit of logs = intercept - decay * |angle|, weighted by the residuals of the last one.

    Returns the intercept, the decay and the spread about the last line; the spread is +inf where the angles
    do not tell a decay.
    """
    n = sx = sy = sxx = sxy = deviation = 0.0
    for k in range(used):
        weight = 1.0
        away = abs(angles[k])
        if robust:
            residual = abs(logs[k] - intercept + decay * away)
            deviation += min(residual, 1.0)
            weight = 1.0 / (1.0 + (residual / OUTLIER) ** 2)
        n += weight
        sx += weight * away
        sy += weight * logs[k]
        sxx += weight * away * away
        sxy += weight * away * logs[k]
    variance = sxx - sx * sx / n
    if variance < 1e-9:
        return 0.0, 0.0, math.inf
    slope = -(sxy - sx * sy / n) / variance
    return (sy + slope * sx) / n, slope, deviation / used


@kernel
def fit_lobe(
    ranges: FloatArray,
    labels: LabelArray,
    cosines: FloatArray,
    sines: FloatArray,
    levels: FloatArray,
    angle_min: float,
    angle_increment: float,
    first: int,
    last: int,
    normal: float,
    distance: float,
    angles: FloatArray,
    logs: FloatArray,
) -> tuple[float, float, float, int]:
    """Fit level = amplitude * exp(-decay * |angle|) robustly to the returns on a line.

    Returns the amplitude, the decay (1/rad), the spread of the logarithm and the number of beams. `angles`
    and `logs`, room for as many values as there are beams, receive the signed angles to the normal and the
    logarithms of the levels.
    """
    used = _collect_lobe(
        ranges, labels, cosines, sines, levels, angle_min, angle_increment, first, last, normal, distance,
        angles, logs,
    )  # fmt: skip
    if used < 4:
        return 0.0, 0.0, math.inf, used
    intercept = 0.0
    decay = 0.0
    spread = math.inf
    for step in range(LOBE_ROUNDS):
        intercept, decay, spread = _weigh_lobe(angles, logs, used, intercept, decay, step > 0)
        if math.isinf(spread):
            return 0.0, 0.0, math.inf, used
    return math.exp(min(intercept, 5.0)), decay, spread, used
