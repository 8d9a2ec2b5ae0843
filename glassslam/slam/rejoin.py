"""Stretches of a run after a break of the recording, and how loop closures join them again.

Where the clock is set, or the recording is silent for long, the robot may have been carried anywhere. A new
stretch begins there, held to the one before by a weak step only (cf. the new trajectory that Cartographer
starts); searches across it look all around. What they find waits until enough of it agrees and the maps of
both sides bear it out: a run left in two pieces is told, a wrong join could not be.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from glassslam.config import LoopClosureConfig
from glassslam.geometry import compose, inverse
from glassslam.grid.submap import Submap
from glassslam.posegraph import PoseGraph
from glassslam.posegraph.storage import LOOP
from glassslam.records import FloatArray
from glassslam.slam.closure import Closure, is_wide
from glassslam.slam.node import Node
from glassslam.slam.rejoin_votes import Run, Votes, is_proven, strongest

WEAK_STEP = (3.0, 3.0, 1.05)
"""Standard deviation of the step over a break, m, m and rad: three times that is any direction."""


def beginnings(nodes: Sequence[Node]) -> list[int]:
    """First nodes of the stretches after the first one."""
    return [node.index for node in nodes if node.begins]


class Rejoining:
    """Wide closures that wait until others confirm them.

    A wide closure tells how all that is joined with its node lies to all that is joined with its anchor. It
    is believed when three or more agree, of more than one node; when fewer than half as many say otherwise;
    and when each side, laid upon the other for 15 m of travel around the places found, has few walls in the
    free space of the other, over 3 m or more of travel on ground that is known.

    Parameters
    ----------
    config : LoopClosureConfig
        Windows of searches within a stretch.

    Attributes
    ----------
    waiting : list of Closure
        Wide closures not decided on.
    """

    def __init__(self, config: LoopClosureConfig) -> None:
        self._config = config
        self.waiting: list[Closure] = []

    def settle(
        self,
        closures: Sequence[Closure],
        graph: PoseGraph,
        nodes: Sequence[Node],
        travel: FloatArray,
        submaps: Sequence[Submap],
    ) -> list[Closure]:
        """Closures that are decided on: narrow ones as they are, wide ones believed or "inconsistent".

        Parameters
        ----------
        closures : sequence of Closure
            What one round of searches found.
        graph : PoseGraph
            Vertex i is node i.
        nodes : sequence of Node
            All nodes.
        travel : ndarray of float64, shape (n,)
            Distance travelled up to every node, m.
        submaps : sequence of Submap
            Finished submaps.
        """
        decided: list[Closure] = []
        for closure in closures:
            waits = is_wide(closure.candidate, self._config) and not closure.rejected
            (self.waiting if waits else decided).append(closure)
        return [*decided, *self._weighed(graph, nodes, travel, submaps)] if self.waiting else decided

    def give_up(self) -> list[Closure]:
        """All that still waits, rejected as "unconfirmed"."""
        waiting, self.waiting = self.waiting, []
        return [replace(closure, rejected="unconfirmed") for closure in waiting]

    def _weighed(
        self, graph: PoseGraph, nodes: Sequence[Node], travel: FloatArray, submaps: Sequence[Submap]
    ) -> list[Closure]:
        begins, edges = beginnings(nodes), graph.edges
        labels = joined(begins, edges.ends[(edges.kinds == LOOP) & edges.enabled])
        parts = labels[np.searchsorted(begins, np.arange(len(nodes)), side="right")]
        run = Run(nodes, graph.poses, travel, submaps, parts)
        by_pair: dict[tuple[int, int], list[Closure]] = {}
        for closure in self.waiting:
            ends = int(parts[closure.candidate.node]), int(parts[closure.candidate.anchor])
            by_pair.setdefault((min(ends), max(ends)), []).append(closure)
        self.waiting = []
        decided: list[Closure] = []
        changed: set[int] = set()
        for (low, high), closures in sorted(by_pair.items()):
            believed = None
            if low == high:
                believed = Votes.of(closures, run).fits(run.poses)
            elif not {low, high} & changed:
                believed = _believed(closures, run)
            if believed is None:
                self.waiting += closures
                continue
            changed |= {low, high} if low != high else set()
            decided += [
                closure if stays else replace(closure, rejected="inconsistent")
                for closure, stays in zip(closures, believed, strict=True)
            ]
        return decided


def _believed(closures: Sequence[Closure], run: Run) -> NDArray[np.bool_] | None:
    """Which closures between two parts are right; None as long as too little is known."""
    votes = Votes.of(closures, run)
    best, group = strongest(votes, run)
    return group if is_proven(votes, best, group, run) else None


def joined(begins: Sequence[int], ends: NDArray[np.int64]) -> NDArray[np.int64]:
    """Label of every stretch, the number of the first one it is joined with by loop closures.

    Parameters
    ----------
    begins : sequence of int
        First nodes of the stretches after the first one, ascending.
    ends : ndarray of int64, shape (m, 2)
        Nodes of the closures in use.

    Examples
    --------
    >>> joined([10, 20], np.array([[3, 25]])).tolist()
    [0, 1, 0]
    """
    labels = np.arange(len(begins) + 1)
    for a, b in np.searchsorted(np.asarray(begins), np.reshape(ends, (-1, 2)), side="right"):
        low, high = sorted((int(labels[a]), int(labels[b])))
        labels[labels == high] = low
    return labels


def move_stretches(
    graph: PoseGraph, closures: Sequence[Closure], nodes: Sequence[Node], config: LoopClosureConfig
) -> None:
    """Carry stretches to where wide closures put them, before these are entered into the graph.

    The optimiser would turn a long stretch only by many small steps, each of which bends it.

    Parameters
    ----------
    graph : PoseGraph
        Vertex i is node i; its poses are changed.
    closures : sequence of Closure
        Closures to be entered.
    nodes : sequence of Node
        All nodes.
    config : LoopClosureConfig
        Windows of searches within a stretch.
    """
    begins, edges = beginnings(nodes), graph.edges
    ends = edges.ends[(edges.kinds == LOOP) & edges.enabled]
    for closure in closures:
        if not is_wide(closure.candidate, config):
            continue
        labels = joined(begins, ends)
        node, anchor = closure.candidate.node, closure.candidate.anchor
        mine, other = labels[np.searchsorted(begins, (node, anchor), side="right")]
        if mine == other:
            continue
        poses = graph.poses
        moved = compose(compose(poses[anchor], closure.anchor_from_node), inverse(poses[node]))
        if mine < other:
            # what holds the beginning of the run stays
            mine, moved = other, inverse(moved)
        bounds = [0, *begins, len(poses)]
        for k in np.flatnonzero(labels == mine):
            graph.set_poses(bounds[k], compose(moved, poses[bounds[k] : bounds[k + 1]]))
        ends = np.vstack((ends, [[anchor, node]]))
