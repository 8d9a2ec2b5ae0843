"""Rising and falling edges of the intensity along a scan."""

import numpy as np

from detectors.accelerate import kernel
from detectors.detection import FloatArray, IntArray, LabelArray
from detectors.labels import INVALID, NO_RETURN


@kernel
def find_peaks(
    intensities: FloatArray,
    labels: LabelArray,
    thresh: float,
    grad: float,
    width: int,
    rises: IntArray,
    falls: IntArray,
) -> int:
    """Write the first beam of every peak and the first beam after it; returns the number of peaks.

    A beam without return counts as intensity 0, an invalid one ends everything.
    """
    count = 0
    rise = -1
    for beam in range(1, intensities.size):
        if labels[beam] == INVALID or labels[beam - 1] == INVALID:
            rise = -1
            continue
        before = 0.0 if labels[beam - 1] == NO_RETURN else intensities[beam - 1]
        here = 0.0 if labels[beam] == NO_RETURN else intensities[beam]
        if here >= thresh and here - before >= grad:
            rise = beam
        elif rise >= 0 and before >= thresh and before - here >= grad:
            if beam - rise <= width:
                rises[count] = rise
                falls[count] = beam
                count += 1
            rise = -1
    return count


def peaks(
    intensities: FloatArray, labels: LabelArray, thresh: float, grad: float, width: int
) -> tuple[IntArray, IntArray]:
    """First beams of the peaks, and first beams after them."""
    rises = np.empty(intensities.size, dtype=np.int64)
    falls = np.empty(intensities.size, dtype=np.int64)
    count = find_peaks(intensities, labels, thresh, grad, width, rises, falls)
    return rises[:count], falls[:count]
