"""Which scans of a recording were taken at the same place, and so tell nothing new."""

from collections.abc import Iterable
from itertools import repeat
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from detectors.beams import FULL_TURN
from detectors.detection import FloatArray, IntArray

MOVED = 0.05
LEAST_COMMON = 10

Layout: TypeAlias = tuple[float, float]
"""Angle of the first beam and step between beams, rad; the step is not 0."""

_ALIKE: Layout = (0.0, 1e-9)
"""Beams so near to each other that any number of them stays within a turn."""


def places(scans: Iterable[ArrayLike], layouts: Iterable[Layout] | None = None) -> IntArray:
    """Number the places at which scans were taken, in the order of the recording.

    A new place begins where the ranges differ from those at the begin of the last one by more than
    `MOVED` (m) in the median, beams of the same bearing compared. Where hardly any beams can be compared,
    every scan is a place of its own.

    Parameters
    ----------
    scans : iterable of array_like
        Ranges of every scan, m.
    layouts : iterable of (angle_min, angle_increment), optional
        Those of every scan, rad, for lidars whose beams differ from turn to turn; the beams of all scans
        point the same way when left out.

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
    reference: tuple[FloatArray, Layout] | None = None
    for scan, layout in zip(scans, repeat(_ALIKE) if layouts is None else layouts, strict=False):
        ranges = np.asarray(scan, dtype=np.float64)
        if reference is None or _differ(*reference, ranges, layout):
            reference = ranges, layout
            numbers.append(numbers[-1] + 1 if numbers else 0)
        else:
            numbers.append(numbers[-1])
    return np.array(numbers, dtype=np.int64)


def _differ(one: FloatArray, layout: Layout, other: FloatArray, others: Layout) -> bool:
    beams = _nearest(layout, others, other.size)
    common = beams < one.size
    before, now = one[beams[common]], other[common]
    both = np.isfinite(before) & np.isfinite(now)
    if np.count_nonzero(both) < LEAST_COMMON:
        return True
    return float(np.median(np.abs(before[both] - now[both]))) > MOVED


def _nearest(layout: Layout, others: Layout, size: int) -> IntArray:
    """Beam of a layout that points most nearly where each of the first beams of another does."""
    (first, step), (start, increment) = layout, others
    ahead = (start + increment * np.arange(size) - first) * np.sign(step)
    # half a step more: what lies a little before the first beam is still that beam, not a turn behind it
    turned = np.mod(ahead + 0.5 * abs(step), FULL_TURN)
    return np.asarray(turned // abs(step), dtype=np.int64)
