"""The beams of a pane, and the pieces of it that they prove."""

import math

from detectors.accelerate import kernel
from detectors.detection import FloatArray, IntArray, LabelArray
from detectors.labels import GHOST, GLASS, SOLID
from detectors.pane_kernels import (
    AMPLITUDE,
    ANSWERS_TO,
    DECAY,
    DISTANCE,
    NORMAL,
    ODDS,
    PEAK,
    SPREAD,
    USED,
)
from detectors.pane_lines import TOLERANCE, TOLERANCE_PER_METRE

# around the mirror direction every brightness is possible, rad
MIRROR = math.radians(2.5)
# a return this many times as bright as the lobe, plus a floor, belongs to something in front of the pane
ABOVE_LOBE = 3.0
FLOOR = 0.05
# a pane goes on across a mullion, but not across an open door or a stretch of wall, m
BRIDGE = 0.30
# beams of one piece lie closer together than this, and a piece is cut at this length, m
PIECE_GAP = 0.08
PIECE_LENGTH = 0.30
LEAST_SIGMA = 0.005


@kernel
def _answers(
    ranges: FloatArray, labels: LabelArray, levels: FloatArray, beam: int, phi: float, pane: FloatArray
) -> bool:
    """Whether a return lies on the pane and is as bright as the pane may be there."""
    if labels[beam] != SOLID and labels[beam] != GLASS:
        return False
    tolerance = TOLERANCE + TOLERANCE_PER_METRE * pane[DISTANCE]
    if abs(ranges[beam] * math.cos(phi) - pane[DISTANCE]) > tolerance:
        return False
    if abs(phi) < MIRROR:
        return True
    expected = pane[AMPLITUDE] * math.exp(-pane[DECAY] * abs(phi))
    return bool(levels[beam] < ABOVE_LOBE * expected + FLOOR)


@kernel
def _walk(
    ranges: FloatArray,
    labels: LabelArray,
    levels: FloatArray,
    angle_min: float,
    angle_increment: float,
    pane: FloatArray,
    step: int,
) -> int:
    """Mark the glass beams on one side of the foot; returns the last beam of the pane, or the foot itself."""
    foot = int(round((pane[NORMAL] - angle_min) / angle_increment))  # noqa: RUF046  (numpy floats round to floats)
    last = foot
    # from a foot that the scan does not show, the pane may begin anywhere up to the shoulders
    reached = 0.0
    started = False
    beam = foot if step > 0 else foot - 1
    while True:
        phi = angle_min + angle_increment * beam - pane[NORMAL]
        if abs(phi) > ANSWERS_TO:
            break
        along = pane[DISTANCE] * math.tan(abs(phi))
        if started and along - reached > BRIDGE:
            break
        if 0 <= beam < ranges.size and _answers(ranges, labels, levels, beam, phi, pane):
            labels[beam] = GLASS
            reached = along
            started = True
            last = beam
        beam += step
    return last


@kernel
def mark_pane(
    ranges: FloatArray,
    labels: LabelArray,
    levels: FloatArray,
    angle_min: float,
    angle_increment: float,
    pane: FloatArray,
) -> tuple[int, int]:
    """Label the beams of a pane glass, and returns from behind it ghost; returns its first and last beam."""
    first = _walk(ranges, labels, levels, angle_min, angle_increment, pane, -1)
    last = _walk(ranges, labels, levels, angle_min, angle_increment, pane, 1)
    first = max(first, 0)
    last = min(last, ranges.size - 1)
    tolerance = 2.0 * (TOLERANCE + TOLERANCE_PER_METRE * pane[DISTANCE])
    for beam in range(first, last + 1):
        phi = angle_min + angle_increment * beam - pane[NORMAL]
        if labels[beam] == SOLID and ranges[beam] * math.cos(phi) - pane[DISTANCE] > tolerance:
            labels[beam] = GHOST
    return first, last


@kernel
def cut_pieces(
    labels: LabelArray,
    angle_min: float,
    angle_increment: float,
    pane: FloatArray,
    first: int,
    last: int,
    count: int,
    beams: IntArray,
    table: FloatArray,
) -> int:
    """Append one row per piece of pane, columns as in `detectors.detection`; returns the number of rows."""
    begin = -1
    end = -1
    for beam in range(first, last + 1):
        if labels[beam] != GLASS:
            continue
        if begin >= 0:
            reached = _along(pane, angle_min + angle_increment * end)
            here = _along(pane, angle_min + angle_increment * beam)
            start = _along(pane, angle_min + angle_increment * begin)
            if here - reached > PIECE_GAP or here - start > PIECE_LENGTH:
                count = _write(angle_min, angle_increment, pane, begin, end, count, beams, table)
                begin = -1
        if begin < 0:
            begin = beam
        end = beam
    if begin >= 0:
        count = _write(angle_min, angle_increment, pane, begin, end, count, beams, table)
    return count


@kernel
def _along(pane: FloatArray, bearing: float) -> float:
    return float(pane[DISTANCE] * math.tan(bearing - pane[NORMAL]))


@kernel
def _write(
    angle_min: float,
    angle_increment: float,
    pane: FloatArray,
    begin: int,
    end: int,
    count: int,
    beams: IntArray,
    table: FloatArray,
) -> int:
    if count >= beams.size:
        return count
    left = _along(pane, angle_min + angle_increment * (begin - 0.5))
    right = _along(pane, angle_min + angle_increment * (end + 0.5))
    centre = pane[NORMAL] + math.atan(0.5 * (left + right) / pane[DISTANCE])
    middle = min(max(round((centre - angle_min) / angle_increment), begin), end)
    bearing = angle_min + angle_increment * middle
    roots = math.sqrt(max(pane[USED], 1.0))
    # beams spread evenly over a length w have a standard deviation of w / sqrt(12)
    width = pane[USED] * angle_increment * pane[DISTANCE]
    phi = bearing - pane[NORMAL]
    normal_sigma = min(pane[SPREAD] * math.sqrt(12.0) / (roots * max(width, 0.02)), 0.2) + math.radians(0.5)
    beams[count] = middle
    table[count, 0] = pane[DISTANCE] / math.cos(phi)
    table[count, 1] = bearing
    table[count, 2] = pane[NORMAL]
    table[count, 3] = abs(phi)
    table[count, 4] = pane[PEAK]
    table[count, 5] = 1.0 / (1.0 + math.exp(-pane[ODDS]))
    table[count, 6] = math.hypot(pane[SPREAD] / roots, LEAST_SIGMA) + normal_sigma * abs(
        _along(pane, bearing)
    )
    table[count, 7] = normal_sigma
    table[count, 8] = 0.5 * (right - left)
    return count + 1


@kernel
def write_panes(
    ranges: FloatArray,
    labels: LabelArray,
    levels: FloatArray,
    angle_min: float,
    angle_increment: float,
    panes: FloatArray,
    found: int,
    beams: IntArray,
    table: FloatArray,
) -> int:
    """Label the beams of all panes, the likeliest first, and write their pieces; returns how many."""
    count = 0
    for _ in range(found):
        best = 0
        for k in range(1, found):
            if panes[k, ODDS] > panes[best, ODDS]:
                best = k
        first, last = mark_pane(ranges, labels, levels, angle_min, angle_increment, panes[best])
        count = cut_pieces(labels, angle_min, angle_increment, panes[best], first, last, count, beams, table)
        panes[best, ODDS] = -math.inf
    return count
