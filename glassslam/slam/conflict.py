"""Whether two stretches of a run, laid upon each other, show the same building."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glassslam.geometry import between, compose
from glassslam.grid.submap import Submap
from glassslam.records import FloatArray
from glassslam.slam.conflict_kernels import count_conflicts
from glassslam.slam.node import Node

_STRIDE, _NEAR, _MOST = 4, 3.0, 0.5
_MARGIN, _FREE_BELOW = 2, 0.4


@dataclass(frozen=True, slots=True)
class Overlay:
    """How nodes look in the submaps of another stretch.

    Attributes
    ----------
    known : int
        Returns that fall on what the submaps have observed.
    conflicts : int
        Those of them that stand in the free space of the submaps.
    seated : ndarray of int64, shape (k,)
        Nodes of which most returns fall on observed ground in one of the submaps, ascending.
    """

    known: int
    conflicts: int
    seated: NDArray[np.int64]

    @property
    def share(self) -> float:
        """Share of the returns on known ground that stand in free space; 0 without any."""
        return self.conflicts / self.known if self.known else 0.0


def overlay(
    chosen: NDArray[np.int64],
    moved: FloatArray,
    nodes: Sequence[Node],
    submaps: Sequence[Submap],
    poses: FloatArray,
) -> Overlay:
    """Lay nodes over submaps of another stretch, and count the walls that stand in its free space.

    Parameters
    ----------
    chosen : ndarray of int64, shape (n,)
        Nodes to lay down; every fourth is.
    moved : ndarray of float64, shape (3,)
        Pose of the graph of their stretch in that of the submaps, m and rad.
    nodes : sequence of Node
        All nodes.
    submaps : sequence of Submap
        Finished submaps of the other stretch.
    poses : ndarray of float64, shape (k, 3)
        Poses of all nodes in the graph.
    """
    taken = chosen[::_STRIDE]
    seats = compose(moved, poses[taken])
    returns = [nodes[k].returns.astype(np.float64) for k in taken]
    known = conflicts = 0
    is_seated = np.zeros(len(taken), dtype=np.bool_)
    for submap in submaps:
        members = np.asarray(submap.nodes)
        gap = seats[:, None, :2] - poses[members][None, :, :2]
        distances = np.hypot(gap[..., 0], gap[..., 1])
        for k in np.flatnonzero(distances.min(axis=1) < _NEAR):
            nearest = int(members[distances[k].argmin()])
            pose = compose(nodes[nearest].pose_in_local, between(poses[nearest], seats[k]))
            grid = submap.grid
            on_known, in_free = count_conflicts(
                grid.cells, grid.table, grid.origin, 1.0 / grid.resolution, returns[k], pose,
                _MARGIN, _FREE_BELOW,
            )  # fmt: skip
            known, conflicts = known + on_known, conflicts + in_free
            is_seated[k] |= on_known > _MOST * len(returns[k])
    return Overlay(known, conflicts, taken[is_seated])
