"""Occupancy maps from sonar sweeps with known poses: ICL, ICo, DS and BFA (pi-map, section III-B).

What the paper leaves open is settled so: the cone has the profiles of Moravec and Elfes (1985); a reading
beyond `max_range` clears its cone up to there and marks nothing; silence clears `no_echo_free_length`,
by default nothing, as a smooth wall seen aslant is silent too; a NaN is no reading.
"""

import math

import numpy as np

from glassslam.config import SonarConfig
from glassslam.grid.probability_grid import check_size
from glassslam.records import FloatArray
from glassslam.slam.result import OccupancyMap
from glassslam.sonar.cone_kernels import enter_centre_lines, enter_masses, enter_means, enter_odds
from glassslam.sonar.sweeps import SonarSweeps

_LARGEST_LOG_ODDS = math.log(0.98 / 0.02)
_MARGIN_CELLS = 3


def build_sonar_map(sweeps: SonarSweeps, config: SonarConfig) -> OccupancyMap:
    """Map of all sweeps by the algorithm that `config` names.

    Parameters
    ----------
    sweeps : SonarSweeps
        Ranges and poses, in the order of the recording: ICL and ICo depend on it.
    config : SonarConfig
        Algorithm and cone model.

    Returns
    -------
    OccupancyMap
        P(occupied), NaN where no cone came; for ICL and ICo the value v of equation 7, for DS half of the
        ignorance counts as occupied (Smets' pignistic probability).
    """
    readings, metres = cone_readings(sweeps, config)
    origin, shape = _extent(readings, config.resolution)
    readings[:, :2] -= origin
    readings[:, [0, 1, 3, 4, 5]] /= config.resolution
    half_width = 0.5 * beam_width(sweeps, config)
    if config.algorithm == "DS":
        cells = _masses(readings, half_width, shape, config)
    elif config.algorithm == "BFA":
        cells = _odds(readings, half_width, shape, config)
    else:
        cells = _means(readings, metres, half_width, shape, config)
    return OccupancyMap(cells.astype(np.float32), config.resolution, (float(origin[0]), float(origin[1])))


def beam_width(sweeps: SonarSweeps, config: SonarConfig) -> float:
    """Full width of the cone in use, rad."""
    measured = math.radians(config.beam_width_deg)
    return min(measured, sweeps.ring.field_of_view) if measured > 0 else sweeps.ring.field_of_view


def cone_readings(sweeps: SonarSweeps, config: SonarConfig) -> tuple[FloatArray, FloatArray]:
    """Readings as cones, in the order of the sweeps.

    Returns
    -------
    readings : ndarray of float64, shape (k, 6)
        x, y, yaw of the sonar in the map frame, free length, range of the obstacle (negative: none) and half
        thickness of its arc, m and rad.
    ranges : ndarray of float64, shape (k,)
        Range of the obstacle, m; NaN where there is none.
    """
    ranges, ring = sweeps.ranges, sweeps.ring
    limit = min(config.max_range, ring.range_max)
    heard = np.isfinite(ranges) & (ranges >= max(ring.range_min, 1e-6))
    hit = heard & (ranges <= limit)
    silent = np.isposinf(ranges) & (config.no_echo_free_length > 0)
    used = heard | silent
    obstacle = np.where(hit, ranges, np.nan)[used]
    thickness = config.arc_thickness + config.arc_growth * obstacle
    beyond = np.where(heard[used], limit, min(config.no_echo_free_length, limit))
    table = np.empty((int(used.sum()), 6))
    table[:, :3] = sweeps.sensors[used]
    marks = np.isfinite(obstacle)
    table[:, 3] = np.where(marks, np.maximum(obstacle - thickness, 0.0), beyond)
    table[:, 4] = np.where(marks, obstacle, -1.0)
    table[:, 5] = np.where(marks, thickness, 0.0)
    return table, obstacle


def _extent(readings: FloatArray, resolution: float) -> tuple[FloatArray, tuple[int, int]]:
    """Lower left corner, a whole number of cells from (0, 0), and shape of a grid that holds all cones."""
    if not len(readings):
        return np.zeros(2), (0, 0)
    reach = np.maximum(readings[:, 3], readings[:, 4] + readings[:, 5])[:, None]
    low = np.floor((readings[:, :2] - reach).min(axis=0) / resolution) - _MARGIN_CELLS
    high = np.floor((readings[:, :2] + reach).max(axis=0) / resolution) + 1 + _MARGIN_CELLS
    width, height = (high - low).tolist()
    check_size(width, height, resolution)
    columns, rows = (high - low).astype(np.int64).tolist()
    return low * resolution, (rows, columns)


def _masses(
    readings: FloatArray, half_width: float, shape: tuple[int, int], config: SonarConfig
) -> FloatArray:
    doubt_of_full, doubt_of_empty = np.zeros(shape), np.zeros(shape)
    enter_masses(
        readings, half_width, config.occupied_belief, config.empty_belief, doubt_of_full, doubt_of_empty
    )
    return combined_masses(doubt_of_full, doubt_of_empty)


def combined_masses(doubt_of_full: FloatArray, doubt_of_empty: FloatArray) -> FloatArray:
    """Dempster's rule for the Full and the Empty map, as P(occupied) with half of the ignorance.

    Parameters
    ----------
    doubt_of_full, doubt_of_empty : ndarray of float64
        Natural logarithms of 1 - mass of Full and of Empty, at most 0.

    Returns
    -------
    ndarray of float64
        P(occupied); NaN where neither map has any mass.
    """
    # f (1 - e) + (1 - f)(1 - e) / 2, over 1 - f e, written so that masses near 1 do not cancel
    not_full = np.exp(doubt_of_full)
    ratio = np.exp(np.minimum(doubt_of_full - doubt_of_empty, 700.0))
    known = (doubt_of_full < 0) | (doubt_of_empty < 0)
    return np.where(known, (1.0 - 0.5 * not_full) / (1.0 + ratio - not_full), np.nan)


def _odds(readings: FloatArray, half_width: float, shape: tuple[int, int], config: SonarConfig) -> FloatArray:
    odds = np.full(shape, np.nan)
    enter_odds(readings, half_width, config.occupied_belief, config.empty_belief, _LARGEST_LOG_ODDS, odds)
    return np.asarray(1.0 / (1.0 + np.exp(-odds)))


def _means(
    readings: FloatArray,
    ranges: FloatArray,
    half_width: float,
    shape: tuple[int, int],
    config: SonarConfig,
) -> FloatArray:
    values = np.nan_to_num(np.exp(-((ranges / config.distance_threshold) ** 2)))
    cells = np.full(shape, np.nan)
    if config.algorithm == "ICL":
        enter_centre_lines(readings, values, config.old_weight, config.new_weight, cells)
    else:
        enter_means(readings, half_width, values, config.old_weight, config.new_weight, cells)
    return cells
