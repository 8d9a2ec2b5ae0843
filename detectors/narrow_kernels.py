"""Returns of one to a few beams with nothing around them."""

from detectors.accelerate import kernel
from detectors.detection import FloatArray, IntArray, LabelArray
from detectors.labels import INVALID, NO_RETURN, SOLID
from detectors.wall_directions import share_along, wall_directions

NEIGHBOURS = 3


@kernel
def _open_beams(
    ranges: FloatArray, labels: LabelArray, edge: int, step: int, depth: float, closed: bool
) -> tuple[int, int]:
    """Beams beside an edge before one meets something near: how many, and how many saw nothing."""
    passed = 0
    silent = 0
    size = ranges.size
    for k in range(1, NEIGHBOURS + 1):
        beam = edge + k * step
        if closed:
            beam %= size
        elif beam < 0 or beam >= size:
            break
        if labels[beam] == INVALID or (labels[beam] == SOLID and ranges[beam] < depth):
            break
        passed += 1
        silent += labels[beam] == NO_RETURN
    return passed, silent


@kernel
def find_narrow(
    ranges: FloatArray,
    labels: LabelArray,
    cosines: FloatArray,
    sines: FloatArray,
    angle_min: float,
    angle_increment: float,
    max_beams: int,
    clearance: float,
    closed: bool,
    histogram: FloatArray,
    first: IntArray,
    features: FloatArray,
) -> int:
    """Write the first beam and the features of every narrow return; returns how many there are.

    Features are the beams of the return, the fewer of the two counts of open beams beside it, the beams
    beside it that saw nothing at all, the share of the flat surfaces of the scan that are parallel to a pane
    there, and the mean direction of their normals relative to that of the return, rad.
    """
    total = wall_directions(ranges, labels, cosines, sines, histogram)
    size = ranges.size
    count = 0
    beam = 0
    while beam < size:
        if labels[beam] != SOLID:
            beam += 1
            continue
        width = 1
        while (
            beam + width < size
            and width <= max_beams
            and labels[beam + width] == SOLID
            and abs(ranges[beam + width] - ranges[beam + width - 1]) < 0.5 * clearance
        ):
            width += 1
        depth = ranges[beam] + clearance
        left, silent_left = _open_beams(ranges, labels, beam, -1, depth, closed)
        right, silent_right = _open_beams(ranges, labels, beam + width - 1, 1, depth, closed)
        if width <= max_beams and left >= 2 and right >= 2:
            first[count] = beam
            bearing = angle_min + angle_increment * (beam + 0.5 * (width - 1))
            features[count, 0] = width
            features[count, 1] = min(left, right)
            features[count, 2] = silent_left + silent_right
            features[count, 3], features[count, 4] = share_along(histogram, total, bearing, 5)
            count += 1
        beam += width
    return count
