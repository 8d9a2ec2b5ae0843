"""Which scans of a recording were taken at the same place, and so tell nothing new."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from detectors.detection import FloatArray, IntArray

MOVED = 0.05
LEAST_COMMON = 10


def places(scans: Iterable[ArrayLike]) -> IntArray:
    """Number the places at which scans were taken, in the order of the recording.

    A new place begins where the ranges differ from those at the begin of the last one by more than
    `MOVED` (m) in the median. Where hardly any beams can be compared, every scan is a place of its own.

    Parameters
    ----------
    scans : iterable of array_like
        Ranges of every scan, m.

    Returns
    -------
    ndarray of int64, shape (n,)
        Place of every scan, from 0 on, never decreasing.

    Examples
    --------
    >>> import numpy as np
    >>> still, moved = np.full(50, 2.0), np.full(50, 2.2)
    >>> places([still, still, moved, moved]).tolist()
    [0, 0, 1, 1]
    """
    numbers: list[int] = []
    reference: FloatArray | None = None
    for scan in scans:
        ranges = np.asarray(scan, dtype=np.float64)
        if reference is None or _differ(reference, ranges):
            reference = ranges
            numbers.append(numbers[-1] + 1 if numbers else 0)
        else:
            numbers.append(numbers[-1])
    return np.array(numbers, dtype=np.int64)


def _differ(one: FloatArray, other: FloatArray) -> bool:
    size = min(one.size, other.size)
    both = np.isfinite(one[:size]) & np.isfinite(other[:size])
    if np.count_nonzero(both) < LEAST_COMMON:
        return True
    return float(np.median(np.abs(one[:size][both] - other[:size][both]))) > MOVED
