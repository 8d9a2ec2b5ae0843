"""Glass as a flat surface whose brightness falls off beside its normal, in units that fit any lidar."""

import math

import numpy as np
from numpy.typing import ArrayLike

from detectors.beams import checked_scan, closes, directions
from detectors.calibration import Calibration
from detectors.detection import COLUMNS, Detection, FloatArray, IntArray, LabelArray, from_table
from detectors.labels import GLASS, SOLID
from detectors.narrow_kernels import NEIGHBOURS, find_narrow
from detectors.narrow_return import FEATURES, RANGE_SIGMA, WALL_SIGMA
from detectors.pane_kernels import PANE_COLUMNS, find_panes
from detectors.pane_pieces import write_panes
from detectors.wall_directions import BINS

MOST_PANES = 32
# widest isolated spike: a pane that answers over more shows its lobe
SPIKE_WIDTH = math.radians(3.0)
CLEARANCE = 0.15
# brightness a spike needs beyond a matte surface at its range
SPIKE_LEVEL = 1.3
SPIKE_BASE = -6.5
SPIKE_PER_SHARE = 6.0
SPIKE_PER_SILENT = 1.5
SPIKE_PER_LOG_LEVEL = 2.0


def calibrated_peak(
    ranges: ArrayLike,
    intensities: ArrayLike,
    angle_min: float,
    angle_increment: float,
    *,
    calibration: Calibration,
    no_echo: float = math.inf,
    range_min: float = 0.05,
    range_limit: float = 10.0,
    min_probability: float = 0.3,
) -> Detection:
    """Find panes by the fall of their brightness beside the normal, and lone mirror peaks of panes far away.

    Intensities are divided by the diffuse level at their range. A flat surface whose returns are faint beside
    its normal, and ever fainter away from it, is a pane: matte and painted surfaces stay near 1 there,
    whatever shines in between; mullions and reflectors have no faint shoulders. Every return of such a
    surface belongs to the pane, at whatever incidence. Where nothing but the mirror peak comes back, it must
    be brighter than a matte surface, stand alone, and be parallel to other walls of the scan.

    Parameters
    ----------
    ranges, intensities : array_like, shape (n,)
        One scan, m and unit of the sensor.
    angle_min, angle_increment : float
        Angle of the first beam and step between beams, rad.
    calibration : Calibration
        Of the sensor.
    no_echo : float
        Ranges from here on mean that nothing came back, m; +inf always does.
    range_min : float
        Nearer readings are invalid, m.
    range_limit : float
        Panes beyond are not looked for, m.
    min_probability : float
        Less probable panes are left out.

    Returns
    -------
    Detection
        One observation per piece of up to 0.3 m of a pane. `strength` is the level of its brightest beam near
        the normal, in units of the diffuse level. Returns from behind a pane are labelled ghosts.

    Raises
    ------
    ValueError
        The arrays do not belong together.
    """
    values, echoes, labels = checked_scan(ranges, intensities, range_min, no_echo)
    least = math.log(min_probability / (1.0 - min_probability)) if 0.0 < min_probability < 1.0 else -math.inf
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):  # a calibration may be of any size
        levels = echoes / calibration.diffuse.level(values)
    if angle_increment < 0.0:
        found = _detect(
            values[::-1],
            labels[::-1],
            levels[::-1],
            angle_min + angle_increment * (values.size - 1),
            -angle_increment,
            calibration,
            range_limit,
            least,
        )
        return _reversed(found)
    return _detect(values, labels, levels, angle_min, angle_increment, calibration, range_limit, least)


def _detect(
    ranges: FloatArray,
    labels: LabelArray,
    levels: FloatArray,
    angle_min: float,
    angle_increment: float,
    calibration: Calibration,
    range_limit: float,
    least: float,
) -> Detection:
    scan = (np.ascontiguousarray(ranges), np.ascontiguousarray(labels), np.ascontiguousarray(levels))
    beams, table = _panes(*scan, angle_min, angle_increment, calibration, range_limit, least)
    spikes, rows = _spikes(*scan, angle_min, angle_increment, range_limit, least)
    return from_table(np.concatenate((beams, spikes)), np.concatenate((table, rows)), scan[1])


def _reversed(found: Detection) -> Detection:
    """The detection of a scan that was turned round before."""
    table = np.column_stack([getattr(found, name) for name in COLUMNS])
    return from_table(found.labels.size - 1 - found.beam, table, found.labels[::-1].copy())


def _panes(
    ranges: FloatArray,
    labels: LabelArray,
    levels: FloatArray,
    angle_min: float,
    angle_increment: float,
    calibration: Calibration,
    range_limit: float,
    least: float,
) -> tuple[IntArray, FloatArray]:
    cosines, sines = directions(ranges.size, angle_min, angle_increment)
    panes = np.zeros((MOST_PANES, PANE_COLUMNS))
    found = find_panes(
        ranges,
        labels,
        cosines,
        sines,
        levels,
        angle_min,
        angle_increment,
        range_limit,
        calibration.faint,
        calibration.weakest_decay,
        least,
        np.empty(ranges.size),
        np.empty(ranges.size, dtype=np.int64),
        np.empty(ranges.size + 1, dtype=np.int64),
        np.empty(ranges.size),
        np.empty(ranges.size),
        np.empty(ranges.size),
        np.empty((2, 4)),
        np.empty(PANE_COLUMNS),
        panes,
    )
    beams = np.empty(ranges.size, dtype=np.int64)
    table = np.empty((ranges.size, len(COLUMNS)))
    count = write_panes(ranges, labels, levels, angle_min, angle_increment, panes, found, beams, table)
    return beams[:count], table[:count]


def _spikes(
    ranges: FloatArray,
    labels: LabelArray,
    levels: FloatArray,
    angle_min: float,
    angle_increment: float,
    range_limit: float,
    least: float,
) -> tuple[IntArray, FloatArray]:
    cosines, sines = directions(ranges.size, angle_min, angle_increment)
    first = np.empty(ranges.size, dtype=np.int64)
    features = np.empty((ranges.size, FEATURES))
    count = find_narrow(
        ranges,
        labels,
        cosines,
        sines,
        angle_min,
        angle_increment,
        max(1, int(SPIKE_WIDTH / angle_increment)),
        CLEARANCE,
        closes(ranges.size, angle_increment),
        np.empty(BINS),
        first,
        features,
    )
    # most scans hold dozens of narrow returns along no wall at all: dropped before anything is computed
    keep = np.flatnonzero(features[:count, 3] > 0.0)
    rows = [
        row
        for k in keep
        if (row := _spike(ranges, labels, levels, int(first[k]), features[k], range_limit, least)) is not None
    ]
    if not rows:
        return np.empty(0, dtype=np.int64), np.empty((0, len(COLUMNS)))
    beams = np.array([row[0] for row in rows], dtype=np.int64)
    table = np.array([row[1] for row in rows])
    table[:, 1] = angle_min + angle_increment * beams
    table[:, 2] += table[:, 1]
    table[:, 8] *= angle_increment
    return beams, table


def _spike(
    ranges: FloatArray,
    labels: LabelArray,
    levels: FloatArray,
    first: int,
    features: FloatArray,
    range_limit: float,
    least: float,
) -> tuple[int, list[float]] | None:
    """One row for a narrow return brighter than any matte surface, or nothing; angles still relative."""
    beams = slice(first, first + int(features[0]))
    middle = first + int(np.argmax(levels[beams]))
    level, distance = float(levels[middle]), float(ranges[middle])
    if level < SPIKE_LEVEL or distance > range_limit or (labels[beams] != SOLID).any():
        return None
    odds = (
        SPIKE_BASE
        + SPIKE_PER_SHARE * features[3]
        + SPIKE_PER_SILENT * features[2] / (2 * NEIGHBOURS)
        + SPIKE_PER_LOG_LEVEL * math.log(level)
    )
    if odds < least:
        return None
    labels[beams] = GLASS
    turn = float(features[4])
    probability = 1.0 / (1.0 + math.exp(-odds))
    half_width = 0.5 * float(features[0]) * distance
    return middle, [distance, 0.0, turn, abs(turn), level, probability, RANGE_SIGMA, WALL_SIGMA, half_width]
