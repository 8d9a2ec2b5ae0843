"""Glass as an isolated return at normal incidence, from lidars whose intensity shows no peak."""

import math

import numpy as np
from numpy.typing import ArrayLike

from detectors.beams import checked_scan, closes, directions
from detectors.detection import COLUMNS, Detection, FloatArray, IntArray, from_table
from detectors.labels import GLASS
from detectors.narrow_kernels import NEIGHBOURS, find_narrow
from detectors.wall_directions import BINS

FEATURES = 5
RANGE_SIGMA = 0.03
# spread of the bearings of true returns around the normal of the pane, and of the normals of parallel walls
BEARING_SIGMA = math.radians(2.5)
WALL_SIGMA = math.radians(1.5)
# closer than this, a pane answers over more than a few beams and dust or the robot itself is likelier
NEAR = 0.5
# log odds fitted to the returns of a real glass wall, see docs/detectors.md
BASE = -9.6
PER_PARALLEL_SHARE = 9.4
PER_SILENT_SHARE = 2.4
SINGLE_BEAM = 1.4
TOO_NEAR = -1.0


def narrow_return(
    ranges: ArrayLike,
    intensities: ArrayLike | None,
    angle_min: float,
    angle_increment: float,
    *,
    no_echo: float = math.inf,
    range_min: float = 0.05,
    range_limit: float = 5.0,
    max_beams: int = 3,
    clearance: float = 0.15,
    min_probability: float = 0.1,
) -> Detection:
    """Find returns of few beams with open space on both sides, where a pane would be parallel to other walls.

    Seen from afar or by a weak lidar, a pane answers only within a few degrees of its normal, and everything
    beside is looked through. Dust, posts and mixed pixels give such returns too, but at any angle: what tells
    them apart is that the walls of a building are parallel.

    Parameters
    ----------
    ranges : array_like, shape (n,)
        Ranges of one scan, m.
    intensities : array_like of shape (n,) or None
        Not used beyond the check of its length: weak returns of a pane have no telling intensity.
    angle_min, angle_increment : float
        Angle of the first beam and step between beams, rad.
    no_echo : float
        Ranges from here on mean that nothing came back, m; +inf always does.
    range_min : float
        Nearer readings are invalid, m.
    range_limit : float
        Returns beyond are not looked at, m.
    max_beams : int
        Largest width of a return, beams.
    clearance : float
        The beams beside go at least this much farther, m.
    min_probability : float
        Less probable returns are left out.

    Returns
    -------
    Detection
        `strength` is the evidence as log odds, `extent` half the width of the beams of the return. `normal`
        is the mean normal of the walls parallel to the pane.

    Raises
    ------
    ValueError
        The arrays do not belong together.

    Examples
    --------
    A wall to the right, and a single return to the left:

    >>> bearings = np.radians(np.arange(-180.0, 180.0))
    >>> with np.errstate(divide="ignore"):
    ...     ranges = np.where(np.abs(bearings + np.pi / 2) < 1.0, 1.0 / np.abs(np.sin(bearings)), np.inf)
    >>> ranges[270] = 1.2
    >>> found = narrow_return(ranges, None, -np.pi, np.radians(1.0))
    >>> found.beam.tolist(), round(float(np.degrees(found.normal[0])))
    ([270], 90)
    """
    values, _, labels = checked_scan(ranges, intensities, range_min, no_echo)
    cosines, sines = directions(values.size, angle_min, angle_increment)
    first = np.empty(values.size, dtype=np.int64)
    features = np.empty((values.size, FEATURES))
    count = find_narrow(
        values,
        labels,
        cosines,
        sines,
        angle_min,
        angle_increment,
        max_beams,
        clearance,
        closes(values.size, angle_increment),
        np.empty(BINS),
        first,
        features,
    )
    found = features[:count]
    middle = first[:count] + (found[:, 0].astype(np.int64) - 1) // 2
    odds = log_odds(found, values[middle])
    probability = 1.0 / (1.0 + np.exp(-odds))
    keep = (probability >= min_probability) & (values[middle] <= range_limit)
    for start, width in zip(first[:count][keep], found[keep, 0].astype(int), strict=True):
        labels[start : start + width] = GLASS
    table = _table(values, middle, found, odds, probability, angle_min, angle_increment)
    return from_table(middle[keep], table[keep], labels)


def log_odds(features: FloatArray, ranges: FloatArray) -> FloatArray:
    """Log odds of glass for narrow returns.

    Parameters
    ----------
    features : ndarray, shape (k, 5)
        As `detectors.narrow_kernels.find_narrow` writes them.
    ranges : ndarray, shape (k,)
        Ranges of the returns, m.
    """
    odds: FloatArray = (
        BASE
        + PER_PARALLEL_SHARE * features[:, 3]
        + PER_SILENT_SHARE * features[:, 2] / (2 * NEIGHBOURS)
        + SINGLE_BEAM * (features[:, 0] == 1)
        + TOO_NEAR * (ranges < NEAR)
    )
    return odds


def _table(
    ranges: FloatArray,
    beams: IntArray,
    features: FloatArray,
    odds: FloatArray,
    probability: FloatArray,
    angle_min: float,
    angle_increment: float,
) -> FloatArray:
    table = np.empty((beams.size, len(COLUMNS)))
    parallel = features[:, 3] > 0.0
    table[:, 0] = ranges[beams]
    table[:, 1] = angle_min + angle_increment * beams
    table[:, 2] = table[:, 1] + np.where(parallel, features[:, 4], 0.0)
    table[:, 3] = np.abs(table[:, 2] - table[:, 1])
    table[:, 4] = odds
    table[:, 5] = probability
    table[:, 6] = RANGE_SIGMA
    table[:, 7] = np.where(parallel, WALL_SIGMA, BEARING_SIGMA)
    table[:, 8] = 0.5 * features[:, 0] * abs(angle_increment) * ranges[beams]
    return table
