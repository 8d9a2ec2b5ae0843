"""Whether scans were taken from one place, judged by the scans alone.

A robot that stands sees the same range in a direction most of the time, however many people walk by; one
that moves does not, but along bare walls. So odometry that stands still is known to be wrong.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from glassslam.records import Float32Array, FloatArray

_DIRECTIONS = 180
_SLACK, _SLACK_SHARE = 0.15, 0.03
_MOSTLY_SEEN, _MOSTLY_THERE = 0.8, 0.5
_LEAST_DIRECTIONS, _LEAST_SCANS = 10, 16


def by_direction(ranges: Float32Array, first: float, step: float, limits: tuple[float, float]) -> FloatArray:
    """One range for every two degrees around the laser, m, shape (180,); NaN where nothing echoed.

    Parameters
    ----------
    ranges : ndarray of float32, shape (n,)
        Ranges of a scan, m.
    first, step : float
        Direction of the first beam and angle between beams, rad.
    limits : tuple of float
        Least and largest range that is an echo, m.
    """
    around = np.full(_DIRECTIONS, np.nan)
    with np.errstate(invalid="ignore"):
        echoes = np.flatnonzero((ranges >= limits[0]) & (ranges <= limits[1]) & np.isfinite(ranges))
    turned = np.mod(first + echoes * step, 2.0 * math.pi) * (_DIRECTIONS / (2.0 * math.pi))
    around[np.minimum(turned.astype(np.int64), _DIRECTIONS - 1)] = ranges[echoes]
    return around


def restless_share(scans: Sequence[FloatArray]) -> float:
    """Share of the directions in which no range is seen for half of the time, in [0, 1].

    The largest share of the whole, its halves and its quarters: a robot may stand before it moves. On real
    lidars that stand it stays below 0.1; along a corridor it may be 0.2, elsewhere it is more.

    Parameters
    ----------
    scans : sequence of ndarray of float64, shape (180,)
        Scans in their order, by direction.

    Returns
    -------
    float
        The share; 0 for less than 16 scans, and for scans that show too little.
    """
    parts = [part for count in (1, 2, 4) for part in np.array_split(np.arange(len(scans)), count)]
    rows = np.array(scans).reshape(len(scans), _DIRECTIONS)
    return max((_restless(rows[part]) for part in parts if len(part) >= _LEAST_SCANS), default=0.0)


def _restless(rows: FloatArray) -> float:
    is_echo: NDArray[np.bool_] = np.isfinite(rows)
    chosen = is_echo.mean(axis=0) >= _MOSTLY_SEEN
    if chosen.sum() < _LEAST_DIRECTIONS:
        return 0.0
    ranges, is_echo = rows[:, chosen], is_echo[:, chosen]
    usual = np.nanmedian(ranges, axis=0)
    with np.errstate(invalid="ignore"):
        is_usual = np.abs(ranges - usual) <= _SLACK + _SLACK_SHARE * usual
    return float((is_usual.sum(axis=0) < _MOSTLY_THERE * is_echo.sum(axis=0)).mean())
