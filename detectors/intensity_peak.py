"""Glass as a narrow peak of the intensity, by thresholds in the unit and the beams of one sensor."""

import math

import numpy as np
from numpy.typing import ArrayLike

from detectors.beams import checked_scan
from detectors.detection import COLUMNS, Detection, FloatArray, IntArray, LabelArray, from_table
from detectors.labels import GLASS
from detectors.peak_kernels import peaks

RANGE_SIGMA = 0.03
# a peak says that its beam is nearly normal to the surface, within the few degrees in which panes answer
NORMAL_SIGMA = math.radians(3.0)


def intensity_peak(
    ranges: ArrayLike,
    intensities: ArrayLike,
    *,
    thresh: float,
    grad: float,
    width: int,
    angle_min: float,
    angle_increment: float,
    range_min: float = 0.0,
    no_echo: float = math.inf,
    probability: float = 0.7,
) -> Detection:
    """Find intensity peaks by height, steepness and width: Algorithm 1 of Cartographer_glass.

    An edge rises at beam p where the intensity is at least `thresh` and `grad` above that of beam p-1. It
    falls at p where beam p-1 is at least `thresh` and `grad` above beam p. When the fall comes within `width`
    beams of the rise h, beam floor((p + h) / 2) is glass. A rise is used once, and no edge is seen across
    invalid beams.

    Parameters
    ----------
    ranges, intensities : array_like, shape (n,)
        One scan, m and unit of the sensor.
    thresh, grad : float
        Least intensity of a peak and least step of its edges, unit of the sensor.
    width : int
        Largest width of a peak, beams.
    angle_min, angle_increment : float
        Angle of the first beam and step between beams, rad.
    range_min, no_echo : float
        Nearer readings are invalid; from `no_echo` on nothing came back, m, which counts as intensity 0.
    probability : float
        Probability given to every observation: thresholds alone cannot tell one peak from another.

    Returns
    -------
    Detection
        `strength` is the highest intensity of the peak, `extent` half its width, `normal` its centre beam.

    Raises
    ------
    ValueError
        The arrays do not belong together.

    Examples
    --------
    >>> found = intensity_peak([2.0] * 5, [900, 1000, 5000, 1000, 900], thresh=3000, grad=500, width=10,
    ...     angle_min=0.0, angle_increment=0.01)
    >>> found.beam.tolist(), found.labels.tolist()
    ([2], [1, 1, 2, 1, 1])
    """
    values, echoes, labels = checked_scan(ranges, intensities, range_min, no_echo)
    rises, falls = peaks(echoes, labels, thresh, grad, width)
    return _observations(values, echoes, labels, rises, falls, angle_min, angle_increment, probability)


def wang_wang(
    ranges: ArrayLike,
    intensities: ArrayLike,
    *,
    thresh: float,
    grad: float,
    width: int,
    angle_min: float,
    angle_increment: float,
    range_difference: float = 0.10,
    range_limit: float = 10.0,
    range_min: float = 0.0,
    no_echo: float = math.inf,
    probability: float = 0.7,
) -> Detection:
    """Find intensity peaks whose two edge beams lie at the same range: the rule of Wang & Wang (slam_glass).

    Parameters
    ----------
    ranges, intensities : array_like, shape (n,)
        One scan, m and unit of the sensor.
    thresh, grad, width, angle_min, angle_increment, range_min, no_echo, probability
        As in `intensity_peak`.
    range_difference : float
        The first and the last beam of a peak differ by less than this, m.
    range_limit : float
        Peaks beyond are ignored, m.

    Returns
    -------
    Detection
        As from `intensity_peak`.

    Raises
    ------
    ValueError
        The arrays do not belong together.
    """
    values, echoes, labels = checked_scan(ranges, intensities, range_min, no_echo)
    rises, falls = peaks(echoes, labels, thresh, grad, width)
    level = np.abs(values[rises] - values[falls - 1]) < range_difference
    near = np.maximum(values[rises], values[falls - 1]) <= range_limit
    keep = level & near
    return _observations(
        values, echoes, labels, rises[keep], falls[keep], angle_min, angle_increment, probability
    )


def _observations(
    ranges: FloatArray,
    intensities: FloatArray,
    labels: LabelArray,
    rises: IntArray,
    falls: IntArray,
    angle_min: float,
    angle_increment: float,
    probability: float,
) -> Detection:
    beams = (rises + falls) // 2
    half_width = 0.5 * (falls - rises) * abs(angle_increment)
    table = np.zeros((beams.size, len(COLUMNS)))
    table[:, 0] = ranges[beams]
    table[:, 1] = table[:, 2] = angle_min + angle_increment * beams
    table[:, 4] = [intensities[a:b].max() for a, b in zip(rises, falls, strict=True)]
    table[:, 5] = probability
    table[:, 6] = RANGE_SIGMA
    table[:, 7] = np.hypot(NORMAL_SIGMA, half_width)
    table[:, 8] = ranges[beams] * half_width
    labels[beams] = GLASS
    return from_table(beams, table, labels)
