"""Panes in one scan: candidates, evidence, and the beams that belong to them."""

import math

from detectors.accelerate import kernel
from detectors.detection import FloatArray, IntArray, LabelArray
from detectors.labels import SOLID
from detectors.lobe_kernels import ANSWERED, DIM, PASSED, TOTAL, count_shoulders, fit_lobe, least_fall
from detectors.pane_lines import FIRST_TOLERANCE, FIT_HALF_ANGLE, find_feet, fit_line

# columns of a pane
NORMAL, DISTANCE, SPREAD, AMPLITUDE, DECAY, ODDS, PEAK, USED = range(8)
PANE_COLUMNS = 8

SAME_NORMAL = math.radians(10.0)
SAME_DISTANCE = 0.12
# angle from the normal up to which near panes answer, rad
ANSWERS_TO = math.radians(50.0)
# a side counts as measured when this share of its beams was answered, as open when that share passed
MEASURED = 0.3
OPEN = 0.5
LEAST_FAINT = 8
# least angle over which a lobe is told from the edges of a post, rad
LEAST_SPAN = math.radians(4.0)
BRIGHTEST_HAZE = 1.5
DIMMEST_HAZE = 0.4
DIM_WEIGHT = 2.0
LEAST_FALL = 0.25
FLOOR_WEIGHT = 20.0
STEADY_COST = 6.0
# a pane this certain is not measured again from the other beams that lie on it
CERTAIN = 2.5
# far away only the mirror peak of a pane comes back, and what looks like haze is mostly something else, m
HAZE_REACH = 3.0
PER_METRE = 0.5


@kernel
def _count_faint(labels: LabelArray, levels: FloatArray, faint: float, dim: IntArray) -> None:
    """Number of faint returns before each beam: most scans have too few anywhere to go on."""
    dim[0] = 0
    for beam in range(levels.size):
        dim[beam + 1] = dim[beam] + (labels[beam] == SOLID and levels[beam] < faint)


@kernel
def _promising(
    ranges: FloatArray,
    labels: LabelArray,
    cosines: FloatArray,
    sines: FloatArray,
    levels: FloatArray,
    first: int,
    last: int,
    foot: int,
    distance: float,
    faint: float,
) -> bool:
    """Whether enough faint returns lie about where the surface through a foot would be."""
    c = cosines[foot]
    s = sines[foot]
    seen = 0
    for beam in range(first, last):
        if levels[beam] < faint and labels[beam] == SOLID:
            behind = ranges[beam] * (cosines[beam] * c + sines[beam] * s) - distance
            if abs(behind) < FIRST_TOLERANCE:
                seen += 1
                if seen >= LEAST_FAINT:
                    return True
    return False


@kernel
def lobe_odds(
    counts: FloatArray,
    distance: float,
    brightest: float,
    decay: float,
    deviation: float,
    spread: float,
    weakest: float,
) -> float:
    """Log odds that a flat surface is a pane, from its shoulders and its lobe.

    `brightest` is the fitted level at the normal, `decay` per rad, `deviation` that of the logarithm of the
    levels, `spread` that of the returns about the line, m; `weakest` is the decay below which a lobe is none.
    The weights are set by hand; docs/detectors.md tells how often they are right.
    """
    odds = -2.5
    measured = 0
    for side in range(2):
        total = max(counts[side, TOTAL], 1.0)
        if counts[side, ANSWERED] >= MEASURED * total and counts[side, ANSWERED] >= 3.0:
            dim = counts[side, DIM] / counts[side, ANSWERED]
            odds += 5.0 * dim - 2.5 if dim > 0.5 else 10.0 * dim - 5.0
            measured += 1
        elif counts[side, PASSED] >= OPEN * total:
            odds += 0.5
    if measured == 0:
        return -9.0
    odds += 1.5 if decay > weakest else 1.5 - 6.0 * (weakest - decay) / weakest
    odds -= 6.0 * max(0.0, deviation - 0.35)
    # a lobe that would shine brighter than any pane at its unseen centre is the edge of something else
    odds -= 3.0 * max(0.0, math.log(max(brightest, 1e-3) / BRIGHTEST_HAZE))
    odds -= 60.0 * max(0.0, spread - 0.03)
    odds -= PER_METRE * max(0.0, distance - HAZE_REACH)
    return odds


@kernel
def polish_odds(amplitude: float, fall: float) -> float:
    """Log odds against a pane that shines like polished metal, lacquer or a bright strip on a dark wall.

    The haze of a pane has `amplitude` at its normal and falls on to where it is no longer seen; a dark matte
    floor stays as it is. `fall` is that of the logarithm over the shoulders.
    """
    level = min(STEADY_COST, FLOOR_WEIGHT * max(0.0, LEAST_FALL - fall))
    return level + DIM_WEIGHT * max(0.0, math.log(DIMMEST_HAZE / max(amplitude, 1e-3)))


@kernel
def _keep(panes: FloatArray, count: int, row: FloatArray) -> int:
    """Add a pane, or let it replace the same pane found with weaker evidence; returns how many there are."""
    for k in range(count):
        turn = abs(panes[k, NORMAL] - row[NORMAL])
        if turn < SAME_NORMAL and abs(panes[k, DISTANCE] - row[DISTANCE]) < SAME_DISTANCE:
            if (row[ODDS], row[USED]) > (panes[k, ODDS], panes[k, USED]):
                panes[k] = row
            return count
    if count < panes.shape[0]:
        panes[count] = row
        return count + 1
    return count


@kernel
def _explained(panes: FloatArray, count: int, distance: float, bearing: float) -> bool:
    """Whether a return lies on a pane that is certain already."""
    for k in range(count):
        phi = bearing - panes[k, NORMAL]
        behind = distance * math.cos(phi) - panes[k, DISTANCE]
        if panes[k, ODDS] > CERTAIN and abs(phi) < ANSWERS_TO and abs(behind) < FIRST_TOLERANCE:
            return True
    return False


@kernel
def _measure(
    ranges: FloatArray,
    labels: LabelArray,
    cosines: FloatArray,
    sines: FloatArray,
    levels: FloatArray,
    angle_min: float,
    angle_increment: float,
    first: int,
    last: int,
    bearing: float,
    nearest: float,
    faint: float,
    weakest_decay: float,
    least_odds: float,
    angles: FloatArray,
    logs: FloatArray,
    room: FloatArray,
    counts: FloatArray,
    row: FloatArray,
) -> bool:
    """Fit a surface near a foot and write it into `row`; False where it is no pane by `least_odds`."""
    normal, distance, spread, used = fit_line(
        ranges, labels, cosines, sines, levels, first, last, bearing, nearest
    )
    if used * angle_increment < LEAST_SPAN:
        return False
    peak = count_shoulders(
        ranges, labels, cosines, sines, levels, angle_min, angle_increment, first, last, normal, distance,
        faint, counts,
    )  # fmt: skip
    # the fit of the lobe costs most: not worth it where even a perfect one would not do
    if lobe_odds(counts, distance, 1.0, 2.0 * weakest_decay, 0.0, spread, weakest_decay) < least_odds:
        return False
    amplitude, decay, deviation, beams = fit_lobe(
        ranges, labels, cosines, sines, levels, angle_min, angle_increment, first, last, normal, distance,
        angles, logs,
    )  # fmt: skip
    odds = lobe_odds(counts, distance, amplitude, decay, deviation, spread, weakest_decay)
    odds -= polish_odds(amplitude, least_fall(angles, logs, beams, faint, room))
    if odds < least_odds or beams < LEAST_FAINT:
        return False
    row[NORMAL], row[DISTANCE], row[SPREAD] = normal, distance, spread
    row[AMPLITUDE], row[DECAY], row[ODDS] = amplitude, decay, odds
    row[PEAK], row[USED] = max(peak, amplitude), used
    return True


@kernel
def find_panes(
    ranges: FloatArray,
    labels: LabelArray,
    cosines: FloatArray,
    sines: FloatArray,
    levels: FloatArray,
    angle_min: float,
    angle_increment: float,
    range_limit: float,
    faint: float,
    weakest_decay: float,
    least_odds: float,
    smooth: FloatArray,
    feet: IntArray,
    dim: IntArray,
    angles: FloatArray,
    logs: FloatArray,
    room: FloatArray,
    counts: FloatArray,
    row: FloatArray,
    panes: FloatArray,
) -> int:
    """Write the panes whose lobe is seen on at least one side; returns how many."""
    found = 0
    window = int(FIT_HALF_ANGLE / angle_increment)
    _count_faint(labels, levels, faint, dim)
    for k in range(find_feet(ranges, labels, angle_increment, smooth, feet)):
        foot = feet[k]
        first = max(0, foot - window)
        last = min(ranges.size, foot + window + 1)
        bearing = angle_min + angle_increment * foot
        nearest = smooth[foot]
        if dim[last] - dim[first] < LEAST_FAINT or nearest > range_limit:
            continue
        if _explained(panes, found, nearest, bearing):
            continue
        if not _promising(ranges, labels, cosines, sines, levels, first, last, foot, nearest, faint):
            continue
        if _measure(
            ranges, labels, cosines, sines, levels, angle_min, angle_increment, first, last, bearing, nearest,
            faint, weakest_decay, least_odds, angles, logs, room, counts, row,
        ):  # fmt: skip
            found = _keep(panes, found, row)
    return found
