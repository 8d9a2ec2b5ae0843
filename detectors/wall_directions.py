"""Directions of the flat surfaces seen in one scan."""

import math

from detectors.accelerate import kernel
from detectors.detection import FloatArray, LabelArray
from detectors.labels import SOLID

BINS = 180
PIECE_LENGTH = 0.25
PIECE_BEAMS = 4
FLATNESS = 0.02
JUMP = 0.15


@kernel
def wall_directions(
    ranges: FloatArray, labels: LabelArray, cosines: FloatArray, sines: FloatArray, histogram: FloatArray
) -> float:
    """Add up the length of flat pieces of surface, m, by the direction of their normals modulo half a turn.

    The scan is cut into pieces of at least `PIECE_LENGTH`; one that is not flat counts for nothing. Bin k of
    `histogram` (shape (BINS,)) holds normals around k degrees. Returns the total length, m.
    """
    histogram[:] = 0.0
    total = 0.0
    start = -1
    n = sx = sy = sxx = syy = sxy = 0.0
    for beam in range(ranges.size):
        if labels[beam] != SOLID:
            start = -1
            continue
        if start < 0 or abs(ranges[beam] - ranges[beam - 1]) > JUMP:
            start = beam
            n = sx = sy = sxx = syy = sxy = 0.0
        x = ranges[beam] * cosines[beam]
        y = ranges[beam] * sines[beam]
        n += 1.0
        sx += x
        sy += y
        sxx += x * x
        syy += y * y
        sxy += x * y
        dx = x - ranges[start] * cosines[start]
        dy = y - ranges[start] * sines[start]
        squared = dx * dx + dy * dy
        if squared < PIECE_LENGTH * PIECE_LENGTH or n < PIECE_BEAMS:
            continue
        cxx = sxx / n - (sx / n) ** 2
        cyy = syy / n - (sy / n) ** 2
        cxy = sxy / n - sx * sy / (n * n)
        spread = 0.5 * (cxx + cyy - math.hypot(cxx - cyy, 2.0 * cxy))
        if spread < FLATNESS * FLATNESS:
            normal = 0.5 * math.atan2(2.0 * cxy, cxx - cyy) + 0.5 * math.pi
            # a piece is never counted longer than twice the least: one long chord across few beams is a guess
            weight = min(math.sqrt(squared), 2.0 * PIECE_LENGTH)
            histogram[round(math.degrees(normal)) % BINS] += weight
            total += weight
        start = -1
    return total


@kernel
def share_along(
    histogram: FloatArray, total: float, direction: float, tolerance_deg: int
) -> tuple[float, float]:
    """Share of the flat surfaces whose normal is within `tolerance_deg` of `direction` (rad), and the normal.

    The second value is the mean of those normals relative to `direction`, rad; 0 when there are none.
    """
    if total <= 0.0:
        return 0.0, 0.0
    centre = round(math.degrees(direction))
    along = 0.0
    moment = 0.0
    for offset in range(-tolerance_deg, tolerance_deg + 1):
        weight = histogram[(centre + offset) % BINS]
        along += weight
        moment += weight * (math.radians(centre + offset) - direction)
    if along <= 0.0:
        return 0.0, 0.0
    return along / total, moment / along
