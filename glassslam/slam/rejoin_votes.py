"""What wide closures say of how two parts of a run lie to each other, and whether that is proven."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glassslam.geometry import between, compose, inverse
from glassslam.grid.submap import Submap
from glassslam.records import FloatArray
from glassslam.slam.closure import Closure
from glassslam.slam.conflict import Overlay, overlay
from glassslam.slam.node import Node

_SAME_PLACE, _SAME_HEADING = 1.0, 0.15
_LEAST_VOTES, _LEAST_NODES = 3, 2
_OVERLAY_REACH, _LEAST_SPAN, _LEAST_KNOWN, _MOST_CONFLICTS = 15.0, 3.0, 1000, 0.09


@dataclass(frozen=True, slots=True)
class Run:
    """What is known of a run when closures are weighed.

    Attributes
    ----------
    nodes : sequence of Node
        All nodes.
    poses : ndarray of float64, shape (n, 3)
        Their poses in the graph, m and rad; those of parts not joined mean nothing to each other.
    travel : ndarray of float64, shape (n,)
        Distance travelled up to every node, m.
    submaps : sequence of Submap
        Finished submaps.
    parts : ndarray of int64, shape (n,)
        Part of the run every node belongs to: stretches joined by closures are one part.
    """

    nodes: Sequence[Node]
    poses: FloatArray
    travel: FloatArray
    submaps: Sequence[Submap]
    parts: NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Votes:
    """What the closures between two parts of a run say.

    Attributes
    ----------
    earlier, later : ndarray of int64, shape (k,)
        Ends of the closures in the part with the lower and the higher number.
    moved : ndarray of float64, shape (k, 3)
        Where they put the frame of the later part, seen from the earlier one, m and rad.
    """

    earlier: NDArray[np.int64]
    later: NDArray[np.int64]
    moved: FloatArray

    @classmethod
    def of(cls, closures: Sequence[Closure], run: Run) -> "Votes":
        """Votes of closures that join the same two parts."""
        anchors = np.array([closure.candidate.anchor for closure in closures])
        found = np.array([closure.candidate.node for closure in closures])
        measured = np.array([closure.anchor_from_node for closure in closures])
        moved = compose(compose(run.poses[anchors], measured), inverse(run.poses[found]))
        if run.parts[found[0]] < run.parts[anchors[0]]:
            return cls(found, anchors, inverse(moved))
        return cls(anchors, found, moved)

    def agreement(self, poses: FloatArray) -> NDArray[np.bool_]:
        """Which votes put each other's nodes to the same place, shape (k, k)."""
        seats = poses[self.later]
        put = compose(self.moved[:, None], seats[None])
        own = compose(self.moved, seats)
        is_near = _is_same(put, own[None])
        return is_near & is_near.T

    def fits(self, poses: FloatArray) -> NDArray[np.bool_]:
        """Which votes leave the later part about where it is, shape (k,)."""
        seats = poses[self.later]
        return _is_same(seats, compose(self.moved, seats))


def strongest(votes: Votes, run: Run) -> tuple[int, NDArray[np.bool_]]:
    """The vote that most others agree with, and which do."""
    agree = votes.agreement(run.poses)
    best = int(agree.sum(axis=1).argmax())
    return best, agree[best]


def is_proven(votes: Votes, best: int, group: NDArray[np.bool_], run: Run) -> bool:
    """Whether the votes of a group are enough to join two parts of a run.

    Parameters
    ----------
    votes : Votes
        All votes on the two parts.
    best : int
        The vote in the middle of the group.
    group : ndarray of bool, shape (k,)
        Votes that agree with it.
    run : Run
        The run.
    """
    count = int(group.sum())
    if count < _LEAST_VOTES or 2 * (len(group) - count) >= count:
        return False
    if len(np.unique(votes.later[group])) < _LEAST_NODES:
        return False
    forth = _overlaid(votes.later[group], votes.earlier[group], votes.moved[best], run)
    if len(forth.seated) == 0 or np.ptp(run.travel[forth.seated]) < _LEAST_SPAN:
        return False
    back = _overlaid(votes.earlier[group], votes.later[group], inverse(votes.moved[best]), run)
    is_quiet = back.known < _LEAST_KNOWN or back.share < _MOST_CONFLICTS
    return is_quiet and forth.known >= _LEAST_KNOWN and forth.share < _MOST_CONFLICTS


def _overlaid(laid: NDArray[np.int64], under: NDArray[np.int64], moved: FloatArray, run: Run) -> Overlay:
    """The nodes of a part around `laid`, laid upon the submaps of the part of `under`."""
    away = np.abs(run.travel[:, None] - run.travel[laid]).min(axis=1)
    chosen = np.flatnonzero((run.parts == run.parts[laid[0]]) & (away < _OVERLAY_REACH))
    part = run.parts[under[0]]
    submaps = [submap for submap in run.submaps if run.parts[submap.nodes[-1]] == part]
    return overlay(chosen, moved, run.nodes, submaps, run.poses)


def _is_same(a: FloatArray, b: FloatArray) -> NDArray[np.bool_]:
    gap = between(a, b)
    is_same = (np.hypot(gap[..., 0], gap[..., 1]) < _SAME_PLACE) & (np.abs(gap[..., 2]) < _SAME_HEADING)
    return np.asarray(is_same)
