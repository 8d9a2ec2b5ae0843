"""Where a flat surface may stand square to a beam, and the line through it."""

import math

from detectors.accelerate import kernel
from detectors.detection import FloatArray, IntArray, LabelArray
from detectors.labels import SOLID

RUN_JUMP = 0.08
# half widths of the mean that quiets the ranges and of the window in which a foot is the nearest point, rad
SMOOTHING = math.radians(1.0)
NEAREST = math.radians(5.0)
FIT_HALF_ANGLE = math.radians(35.0)
FIRST_TOLERANCE = 0.12
TOLERANCE = 0.05
TOLERANCE_PER_METRE = 0.005
FIT_ROUNDS = 4
# a beam this bright (in units of the diffuse level) pulls at the line a quarter as much as a faint one
BRIGHT = 0.5


@kernel
def find_feet(
    ranges: FloatArray, labels: LabelArray, angle_increment: float, smooth: FloatArray, feet: IntArray
) -> int:
    """Write the beams at which the quieted range is the nearest of its surroundings; returns how many."""
    size = ranges.size
    half = max(1, round(SMOOTHING / angle_increment))
    window = max(2, round(NEAREST / angle_increment))
    count = 0
    start = 0
    while start < size:
        if labels[start] != SOLID:
            start += 1
            continue
        stop = start + 1
        while (
            stop < size
            and labels[stop] == SOLID
            and abs(ranges[stop] - ranges[stop - 1]) < RUN_JUMP + 0.01 * ranges[stop]
        ):
            stop += 1
        _smooth_run(ranges, start, stop, half, smooth)
        for beam in range(start, stop):
            if _is_nearest(smooth, beam, start, stop, window):
                feet[count] = beam
                count += 1
        start = stop
    return count


@kernel
def _smooth_run(ranges: FloatArray, start: int, stop: int, half: int, smooth: FloatArray) -> None:
    first = start
    last = start
    total = 0.0
    for beam in range(start, stop):
        while last < min(stop, beam + half + 1):
            total += ranges[last]
            last += 1
        while first < beam - half:
            total -= ranges[first]
            first += 1
        smooth[beam] = total / (last - first)


@kernel
def _is_nearest(smooth: FloatArray, beam: int, start: int, stop: int, window: int) -> bool:
    here = smooth[beam]
    for offset in range(1, window + 1):
        # on a tie the first of the two stands for both
        if beam - offset >= start and smooth[beam - offset] <= here:
            return False
        if beam + offset < stop and smooth[beam + offset] < here:
            return False
    return True


@kernel
def fit_line(
    ranges: FloatArray,
    labels: LabelArray,
    cosines: FloatArray,
    sines: FloatArray,
    levels: FloatArray,
    first: int,
    last: int,
    normal: float,
    distance: float,
) -> tuple[float, float, float, int]:
    """Refit a line to the faint returns on it: normal (rad), distance (m), spread (m) and beams used.

    A pane is faint where a mullion or a wall is bright, so faint beams count for more.
    """
    spread = TOLERANCE
    used = 0
    for step in range(FIT_ROUNDS):
        tolerance = TOLERANCE + TOLERANCE_PER_METRE * distance
        if step == 0:
            tolerance += FIRST_TOLERANCE - TOLERANCE
        c = math.cos(normal)
        s = math.sin(normal)
        n = su = sv = suu = suv = svv = 0.0
        used = 0
        for beam in range(first, last):
            if labels[beam] != SOLID:
                continue
            v = ranges[beam] * (cosines[beam] * c + sines[beam] * s)
            if abs(v - distance) > tolerance:
                continue
            u = ranges[beam] * (sines[beam] * c - cosines[beam] * s)
            ratio = levels[beam] / BRIGHT
            weight = 1.0 / (1.0 + ratio * ratio)
            n += weight
            su += weight * u
            sv += weight * v
            suu += weight * u * u
            suv += weight * u * v
            svv += weight * v * v
            used += 1
        if used < 3:
            return normal, distance, spread, used
        variance = suu / n - (su / n) ** 2
        slope = (suv / n - su * sv / (n * n)) / variance if variance > 1e-6 else 0.0
        intercept = (sv - slope * su) / n
        residual = svv / n - (sv / n) ** 2 - slope * slope * variance
        spread = math.sqrt(max(residual, 0.0))
        normal -= math.atan(slope)
        distance = intercept / math.sqrt(1.0 + slope * slope)
    return normal, distance, spread, used
