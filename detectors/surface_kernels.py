"""Incidence of every beam on the surface around it."""

import math

from detectors.accelerate import kernel
from detectors.detection import FloatArray, LabelArray
from detectors.labels import SOLID

LEAST_BEAMS = 5
JUMP = 0.10


@kernel
def local_incidence(
    ranges: FloatArray,
    labels: LabelArray,
    cosines: FloatArray,
    sines: FloatArray,
    length: float,
    incidence: FloatArray,
    spread: FloatArray,
) -> None:
    """Fit a line to the returns within half of `length` (m) on both sides of every beam.

    Writes the angle between beam and surface normal, rad, and the spread of the returns about the line, m;
    NaN where the surface ends or has too few beams.
    """
    size = ranges.size
    for beam in range(size):
        incidence[beam] = math.nan
        spread[beam] = math.nan
        if labels[beam] != SOLID:
            continue
        first = _reach(ranges, labels, cosines, sines, beam, -1, 0.5 * length)
        last = _reach(ranges, labels, cosines, sines, beam, 1, 0.5 * length)
        if first < 0 or last < 0 or last - first + 1 < LEAST_BEAMS:
            continue
        n = sx = sy = sxx = syy = sxy = 0.0
        for k in range(first, last + 1):
            x = ranges[k] * cosines[k]
            y = ranges[k] * sines[k]
            n += 1.0
            sx += x
            sy += y
            sxx += x * x
            syy += y * y
            sxy += x * y
        cxx = sxx / n - (sx / n) ** 2
        cyy = syy / n - (sy / n) ** 2
        cxy = sxy / n - sx * sy / (n * n)
        along = 0.5 * math.atan2(2.0 * cxy, cxx - cyy)
        cosine = abs(cosines[beam] * math.sin(along) - sines[beam] * math.cos(along))
        incidence[beam] = math.acos(min(cosine, 1.0))
        spread[beam] = math.sqrt(max(0.5 * (cxx + cyy - math.hypot(cxx - cyy, 2.0 * cxy)), 0.0))


@kernel
def _reach(
    ranges: FloatArray,
    labels: LabelArray,
    cosines: FloatArray,
    sines: FloatArray,
    beam: int,
    step: int,
    length: float,
) -> int:
    """The first beam on one side that lies `length` away along an unbroken surface, or -1."""
    x = ranges[beam] * cosines[beam]
    y = ranges[beam] * sines[beam]
    k = beam + step
    while 0 <= k < ranges.size and labels[k] == SOLID and abs(ranges[k] - ranges[k - step]) < JUMP:
        dx = ranges[k] * cosines[k] - x
        dy = ranges[k] * sines[k] - y
        if dx * dx + dy * dy >= length * length:
            return k
        k += step
    return -1
