"""A scan made ready for kernels: checked arrays, labels, and the direction of every beam."""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from detectors.detection import FloatArray, LabelArray
from detectors.labels import base_labels

FULL_TURN = 2.0 * math.pi


def checked_scan(
    ranges: ArrayLike, intensities: ArrayLike | None, range_min: float, no_echo: float
) -> tuple[FloatArray, FloatArray, LabelArray]:
    """Ranges, intensities and base labels of a scan as arrays of one length.

    Raises
    ------
    ValueError
        The arrays are not flat, or differ in length.
    """
    with np.errstate(invalid="ignore"):  # damaged recordings hold signalling NaNs, of which casts complain
        values = np.ascontiguousarray(ranges, dtype=np.float64)
        echoes = (
            np.zeros_like(values)
            if intensities is None
            else np.ascontiguousarray(intensities, dtype=np.float64)
        )
    if values.ndim != 1:
        raise ValueError(f"ranges of one scan are needed, not an array of shape {values.shape}")
    if echoes.shape != values.shape:
        raise ValueError(f"{echoes.size} intensities do not fit {values.size} ranges")
    return values, echoes, base_labels(values, range_min=range_min, no_echo=no_echo)


@lru_cache(maxsize=16)
def directions(count: int, angle_min: float, angle_increment: float) -> tuple[FloatArray, FloatArray]:
    """Cosine and sine of every beam's angle; kept, since the scans of a recording share them."""
    bearings = angle_min + angle_increment * np.arange(count)
    cosines, sines = np.cos(bearings), np.sin(bearings)
    cosines.flags.writeable = sines.flags.writeable = False
    return cosines, sines


def closes(count: int, angle_increment: float) -> bool:
    """Whether the last beam is a neighbour of the first one."""
    step = abs(angle_increment)
    return abs(count * step - FULL_TURN) < 1.5 * step
