"""Submaps: short stretches of the run, each with its own grid (Hess et al. 2016, section IV-B)."""

from dataclasses import dataclass, field

import numpy as np

from glassslam.grid.odds import OddsModel
from glassslam.grid.probability_grid import ProbabilityGrid
from glassslam.records import FloatArray


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

    def insert(
        self, node: int, pose: FloatArray, sensor: FloatArray, hits: FloatArray, free_ends: FloatArray
    ) -> tuple[list[Submap], Submap | None]:
        """Enter one scan given in the local frame.

        Returns
        -------
        entered : list of Submap
            The submaps that hold the node, older first.
        finished : Submap or None
            The submap that this scan completed.
        """
        if not self.active or len(self.active[-1].nodes) >= self._num_range_data:
            grid = ProbabilityGrid(self._resolution, self._odds)
            self.active.append(Submap(self._created, np.array(pose), grid))
            self._created += 1
        entered = list(self.active)
        for submap in entered:
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
