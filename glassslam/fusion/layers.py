"""Decision layers: cell by cell, which sensor is believed.

Pessimistic and MinMax follow the study of mapping the Gates building with laser and sonar, which works with
P(free); here all maps are P(occupied). A cell that a sensor never saw has its prior 0.5, as in the study.
Overlay is approach B of Zhang et al., attaching the basic fusion of pi-map (section III-C).
"""

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from glassslam.config import FusionConfig
from glassslam.fusion.layer_kernels import count_ends
from glassslam.records import Float32Array, FloatArray
from glassslam.slam.result import OccupancyMap
from glassslam.sonar.sweeps import SonarSweeps

OCCUPIED = np.float32(0.9)
"""P(occupied) of cells that a rule without probabilities decides to be occupied."""
UNDECIDED = 0
"""Source of a cell that no sensor decided; sensor k of n is k + 1, and n + 1 stands for several alike."""

_EVEN = 1e-6  # the rounding of float32 must not decide

Sources: TypeAlias = NDArray[np.uint8]


def pessimistic(opinions: FloatArray) -> tuple[FloatArray, Sources]:
    """P(free) = min over the sensors: the sensor that says occupied most is believed.

    Parameters
    ----------
    opinions : ndarray of float, shape (n, rows, columns)
        P(occupied) by sensor; NaN where it never looked.

    Returns
    -------
    probability : ndarray of float64, shape (rows, columns)
        P(occupied); NaN where no sensor looked.
    source : ndarray of uint8, shape (rows, columns)
        Which sensor decided, as 1 ... n; n + 1 where several say the same; 0 where none looked.
    """
    p, unseen = _with_prior(opinions)
    return _decided(p, p.max(axis=0), unseen)


def minmax(opinions: FloatArray) -> tuple[FloatArray, Sources]:
    """The surest sensor on the side to which the mean leans is believed; a mean of 0.5 stays 0.5.

    Parameters
    ----------
    opinions : ndarray of float, shape (n, rows, columns)
        P(occupied) by sensor; NaN where it never looked.

    Returns
    -------
    probability : ndarray of float64, shape (rows, columns)
        P(occupied); NaN where no sensor looked.
    source : ndarray of uint8, shape (rows, columns)
        Which sensor decided, as 1 ... n; n + 1 where several say the same; 0 where none did.
    """
    p, unseen = _with_prior(opinions)
    mean = p.mean(axis=0)
    even = np.isclose(mean, 0.5, rtol=0.0, atol=_EVEN)
    chosen = np.where(even, 0.5, np.where(mean < 0.5, p.min(axis=0), p.max(axis=0)))
    probability, source = _decided(p, chosen, unseen)
    return probability, np.where(even, UNDECIDED, source).astype(np.uint8)


def attach(
    lidar: Float32Array, sonar: Float32Array, threshold: float, occupied: np.float32 = OCCUPIED
) -> tuple[Float32Array, Sources]:
    """The lidar map with the occupied cells of a second layer laid over it.

    Parameters
    ----------
    lidar, sonar : ndarray of float32, shape (rows, columns)
        P(occupied), or the occupancy of the layer; NaN where never observed.
    threshold : float
        Least value of the second layer that is laid over.
    occupied : float
        Least P(occupied) of such cells in the result.

    Returns
    -------
    probability : ndarray of float32, shape (rows, columns)
        P(occupied).
    source : ndarray of uint8, shape (rows, columns)
        1 for the lidar, 2 for the layer, 0 where neither looked.
    """
    laid = sonar >= np.float32(threshold)
    # only where the layer adds something: a wall that the lidar shows stays the lidar's
    added = laid & ~(lidar >= occupied)
    probability = np.where(added, occupied, lidar).astype(np.float32)
    source = np.where(added, 2, np.where(np.isnan(lidar), UNDECIDED, 1))
    return probability, source.astype(np.uint8)


def end_point_layer(sweeps: SonarSweeps, config: FusionConfig) -> OccupancyMap:
    """Layer of sonar end points (Zhang et al., approach B, algorithm 3).

    The occupancy of a cell is the share of the readings that end in it, of all that end in it or pass it
    along their axis; readings beyond `overlay_max_range` are not entered.

    Parameters
    ----------
    sweeps : SonarSweeps
        Readings with poses.
    config : FusionConfig
        Resolution and range limit of the layer.
    """
    ranges, ring = sweeps.ranges, sweeps.ring
    limit = min(config.overlay_max_range, ring.range_max)
    use = np.isfinite(ranges) & (ranges >= max(ring.range_min, 1e-6)) & (ranges <= limit)
    start, reach = sweeps.sensors[use], ranges[use][:, None]
    ends = start[:, :2] + reach * np.column_stack((np.cos(start[:, 2]), np.sin(start[:, 2])))
    if not len(ends):
        return OccupancyMap(np.empty((0, 0), np.float32), config.overlay_resolution, (0.0, 0.0))
    corners = np.concatenate((start[:, :2], ends)) / config.overlay_resolution
    low = np.floor(corners.min(axis=0)) - 1
    columns, rows = (np.floor(corners.max(axis=0)) + 2 - low).astype(np.int64).tolist()
    ended, passed = np.zeros((rows, columns), np.int64), np.zeros((rows, columns), np.int64)
    count_ends(
        start[:, :2] / config.overlay_resolution - low, ends / config.overlay_resolution - low, ended, passed
    )
    seen = ended + passed
    share = np.divide(ended, seen, out=np.full(seen.shape, np.nan), where=seen > 0)
    corner = low * config.overlay_resolution
    return OccupancyMap(
        share.astype(np.float32), config.overlay_resolution, (float(corner[0]), float(corner[1]))
    )


def stacked(maps: Sequence[OccupancyMap]) -> FloatArray:
    """Probabilities of maps on one grid, shape (n, rows, columns)."""
    return np.stack([grid.probability for grid in maps]).astype(np.float64)


def _with_prior(opinions: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
    p = np.asarray(opinions, dtype=np.float64)
    missing = np.isnan(p)
    return np.where(missing, 0.5, p), np.asarray(missing.all(axis=0))


def _decided(p: FloatArray, chosen: FloatArray, unseen: NDArray[np.bool_]) -> tuple[FloatArray, Sources]:
    """The chosen probability and the sensors that have it."""
    agrees = p == chosen
    source = np.where(agrees.sum(axis=0) > 1, len(p) + 1, agrees.argmax(axis=0) + 1)
    return np.where(unseen, np.nan, chosen), np.where(unseen, UNDECIDED, source).astype(np.uint8)
