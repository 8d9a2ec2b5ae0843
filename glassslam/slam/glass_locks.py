"""Glass locked in the submaps while they are built: the schemes of Weerakoon et al. 2021, section III."""

import numpy as np

from glassslam.config import Config
from glassslam.geometry import inverse, transform_points
from glassslam.records import FloatArray

LITE_MISS_PROBABILITY = 0.499
_IN_SUBMAPS = ("local", "global", "lite")


def locks_submaps(scheme: str) -> bool:
    """Whether a scheme locks cells of submaps rather than of the finished map."""
    return scheme in _IN_SUBMAPS


def miss_probability(config: Config) -> float:
    """P(occupied) after a ray through a cell of a submap: nearly even for `lite`: glass fades late."""
    return LITE_MISS_PROBABILITY if config.glass.scheme == "lite" else config.submap.miss_probability


class GlassLocks:
    """Points of glass whose cells are locked in submaps (Algorithms 2 and 3).

    The global scheme stores points in map coordinates once and for all. When a later loop closure moves
    the place they were seen from, they stay behind: that is the scheme as published.

    Parameters
    ----------
    config : Config
        The scheme, and the range of the sensor, which spans a submap.

    Attributes
    ----------
    is_on : bool
        Whether the scheme locks cells of submaps at all.
    map_from_local : ndarray of float64, shape (3,)
        Where the local frame lies in the map by the last optimisation (H_k), m and rad.
    """

    def __init__(self, config: Config) -> None:
        self.is_on = locks_submaps(config.glass.scheme)
        self._is_global = config.glass.scheme == "global"
        self._span = config.sensor.max_range
        self._cell = config.submap.resolution
        self._known = np.empty((0, 2))
        self.map_from_local = np.zeros(3)

    def seen(self, points: FloatArray) -> FloatArray:
        """Points of a scan to lock in its submaps, local frame, m, shape (k, 2); Algorithm 2."""
        if not self.is_on:
            return points[:0]
        if self._is_global and len(points):
            self._known = self._thinned(
                np.concatenate((self._known, transform_points(self.map_from_local, points)))
            )
        return points

    def known(self, pose: FloatArray) -> FloatArray:
        """Points to lock in a submap begun at a local pose, local frame, m, shape (k, 2); Algorithm 3."""
        points: FloatArray = transform_points(inverse(self.map_from_local), self._known)
        near = np.hypot(points[:, 0] - pose[0], points[:, 1] - pose[1]) < self._span
        return np.asarray(points[near])

    def _thinned(self, points: FloatArray) -> FloatArray:
        """One point per cell of the map, the earliest: more would lock nothing else."""
        cells = np.floor(points / self._cell).astype(np.int64)
        _, first = np.unique(cells, axis=0, return_index=True)
        return np.asarray(points[np.sort(first)])
