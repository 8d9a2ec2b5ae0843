"""Submaps: short stretches of the run, each with its own grid (Hess et al. 2016, section IV-B)."""

from dataclasses import dataclass, field

import numpy as np

from glassslam.grid.odds import OddsModel
from glassslam.grid.probability_grid import ProbabilityGrid
from glassslam.records import FloatArray

_NO_POINTS = np.empty((0, 2))


@dataclass(slots=True)
class Submap:
    """A grid in local coordinates and the nodes entered into it.

    Attributes
    ----------
    index : int
        Number of the submap, in order of creation.
    local_pose : ndarray of float64, shape (3,)
        Pose of the submap frame in the local frame: that of its first node.
    grid : ProbabilityGrid
        The map, in coordinates of the local frame.
    nodes : list of int
        Nodes entered.
    finished : bool
        Whether no more nodes will be entered.
    """

    index: int
    local_pose: FloatArray
    grid: ProbabilityGrid
    nodes: list[int] = field(default_factory=list)
    finished: bool = False


class ActiveSubmaps:
    """The two overlapping submaps scans go into; the older one is matched against.

    Parameters
    ----------
    resolution : float
        Cell edge, m.
    odds : OddsModel
        Cell updates.
    num_range_data : int
        Scans after which the next submap starts; a submap is finished after twice as many.
    """

    def __init__(self, resolution: float, odds: OddsModel, num_range_data: int) -> None:
        self._resolution = resolution
        self._odds = odds
        self._num_range_data = num_range_data
        self._created = 0
        self.active: list[Submap] = []

    @property
    def matching(self) -> Submap | None:
        """The submap to match against; None before the first scan."""
        return self.active[0] if self.active else None

    @property
    def starts_next(self) -> bool:
        """Whether the next scan begins a submap."""
        return not self.active or len(self.active[-1].nodes) >= self._num_range_data

    def insert(
        self,
        node: int,
        pose: FloatArray,
        sensor: FloatArray,
        hits: FloatArray,
        free_ends: FloatArray,
        *,
        glass: FloatArray = _NO_POINTS,
        known_glass: FloatArray = _NO_POINTS,
    ) -> tuple[list[Submap], Submap | None]:
        """Enter one scan given in the local frame.

        Parameters
        ----------
        node : int
            Number of the node.
        pose : ndarray of float64, shape (3,)
            Pose of the base, m and rad.
        sensor : ndarray of float64, shape (2,)
            Position of the laser, m.
        hits, free_ends : ndarray of float64, shape (n, 2), (m, 2)
            Returns and ends of free space, m.
        glass : ndarray of float64, shape (k, 2)
            Points whose cells are locked in every submap the scan goes into, m.
        known_glass : ndarray of float64, shape (l, 2)
            Points whose cells are locked from the start in a submap that the scan begins, m.

        Returns
        -------
        entered : list of Submap
            The submaps that hold the node, older first.
        finished : Submap or None
            The submap that this scan completed.
        """
        if self.starts_next:
            grid = ProbabilityGrid(self._resolution, self._odds)
            grid.lock(known_glass)
            self.active.append(Submap(self._created, np.array(pose), grid))
            self._created += 1
        entered = list(self.active)
        for submap in entered:
            submap.grid.lock(glass)
            submap.grid.insert(sensor, hits, free_ends)
            submap.nodes.append(node)
        finished = None
        if len(self.active[0].nodes) >= 2 * self._num_range_data:
            finished = self._finish_oldest()
        return entered, finished

    def finish(self) -> list[Submap]:
        """Complete what is still active, at the end of a run or stretch."""
        return [self._finish_oldest() for _ in range(len(self.active))]

    def _finish_oldest(self) -> Submap:
        submap = self.active.pop(0)
        submap.grid.finish()
        submap.finished = True
        return submap
