"""How wide the cone of a sonar really is, from its readings and a lidar map."""

import math
from dataclasses import dataclass

import numpy as np

from glassslam.records import FloatArray
from glassslam.slam.result import OccupancyMap
from glassslam.sonar.ray_kernels import nearest_in_cones
from glassslam.sonar.sweeps import SonarSweeps

_HALF_WIDTHS = np.radians(np.arange(1.0, 46.0))
_RAYS_BETWEEN = 2
_OCCUPIED = 0.65
_FEWEST = 50
_MOST = 5000


@dataclass(frozen=True, slots=True)
class BeamWidth:
    """Effective width of a sonar cone.

    Attributes
    ----------
    width : float
        Full width that explains most readings, rad; NaN when too few could be compared.
    low, high : float
        Full widths between which the data do not decide (95 % of the bootstrap samples), rad.
    half_widths, agreement : ndarray of float64, shape (h,)
        Half widths tried, rad, and the share of the readings that each explains.
    readings : int
        Readings that some cone explains, from which all was measured.
    bias, spread : float
        Median of reading - lidar distance in the best cone, m, and its spread (1.48 times the median
        absolute deviation), m.
    """

    width: float
    low: float
    high: float
    half_widths: FloatArray
    agreement: FloatArray
    readings: int
    bias: float
    spread: float


def measure_beam_width(
    sweeps: SonarSweeps,
    lidar_map: OccupancyMap,
    max_range: float = 3.0,
    tolerance: float = 0.1,
    seed: int = 0,
) -> BeamWidth:
    """Effective cone width: the one whose nearest lidar surface agrees with most readings.

    Readings that no cone up to 45 degrees to each side explains (glass, things below the plane of the
    lidar, cross-talk) say nothing about the width and are left out. Of very many readings 5000 are looked at.

    Parameters
    ----------
    sweeps : SonarSweeps
        Readings at optimised poses.
    lidar_map : OccupancyMap
        Map of the same frame.
    max_range : float
        Longest reading used, m.
    tolerance : float
        Largest difference of a reading from the lidar distance that counts as agreement, m.
    seed : int
        Of the bootstrap.
    """
    use = np.isfinite(sweeps.ranges) & (sweeps.ranges >= sweeps.ring.range_min) & (sweeps.ranges <= max_range)
    stride = 1 + int(np.count_nonzero(use)) // _MOST
    ranges, rays = sweeps.ranges[use][::stride], sweeps.sensors[use][::stride].copy()
    rays[:, :2] = (rays[:, :2] - np.asarray(lidar_map.origin)) / lidar_map.resolution
    nearest = np.empty((len(rays), len(_HALF_WIDTHS)))
    reach = (max_range + 2.0 * tolerance) / lidar_map.resolution
    nearest_in_cones(lidar_map.probability, rays, _HALF_WIDTHS, _RAYS_BETWEEN, reach, _OCCUPIED, nearest)
    difference = ranges[:, None] - nearest * lidar_map.resolution
    agrees = np.abs(difference) < tolerance
    explained = agrees.any(axis=1)
    agrees, difference = agrees[explained], difference[explained]
    if len(agrees) < _FEWEST:
        nothing = np.full(len(_HALF_WIDTHS), math.nan)
        return BeamWidth(math.nan, math.nan, math.nan, _HALF_WIDTHS, nothing, len(agrees), math.nan, math.nan)
    agreement = agrees.mean(axis=0)
    best = int(agreement.argmax())
    widths = 2.0 * _HALF_WIDTHS[_bootstrap(agrees, seed)]
    low, high = np.percentile(widths, (2.5, 97.5)).tolist()
    left = difference[agrees[:, best], best]
    bias = float(np.median(left))
    return BeamWidth(
        2.0 * float(_HALF_WIDTHS[best]), low, high, _HALF_WIDTHS, agreement, len(agrees),
        bias, 1.48 * float(np.median(np.abs(left - bias))),
    )  # fmt: skip


def _bootstrap(agrees: np.ndarray, seed: int, samples: int = 200) -> np.ndarray:
    """Best half width, by index, in samples of the readings drawn with replacement."""
    random = np.random.default_rng(seed)
    weights = random.multinomial(len(agrees), np.full(len(agrees), 1.0 / len(agrees)), samples)
    return np.asarray((weights @ agrees).argmax(axis=1))
