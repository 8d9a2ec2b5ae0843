"""Stretches of a run after a break of the recording, and how loop closures join them again.

Where the clock is set, or the recording is silent for long, the robot may have been carried anywhere. A new
stretch begins there, held to the one before by a weak step only (cf. the new trajectory that Cartographer
starts); searches across it look all around. Such a wide search finds false places more easily than one that
the graph narrows down, so what it finds is believed only as far as several searches agree.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from glassslam.config import LoopClosureConfig
from glassslam.geometry import between, compose
from glassslam.posegraph import PoseGraph
from glassslam.posegraph.storage import LOOP
from glassslam.records import FloatArray
from glassslam.slam.closure import Closure, is_wide
from glassslam.slam.node import Node

WEAK_STEP = (3.0, 3.0, 1.05)
"""Standard deviation of the step over a break, m, m and rad: three times that is any direction."""
_SAME_PLACE, _SAME_HEADING = 1.0, 0.15
_FEW_SEARCHES, _LEAST_VOTES = 8, 3


def beginnings(nodes: Sequence[Node]) -> list[int]:
    """First nodes of the stretches after the first one."""
    return [node.index for node in nodes if node.begins]


def agreeing(closures: Sequence[Closure], nodes: Sequence[Node], config: LoopClosureConfig) -> list[Closure]:
    """The closures, of which wide ones that contradict the others are rejected as "inconsistent".

    Every wide closure tells where the stretch of its node begins, seen from the stretch of its anchor. Those
    that agree with most others stay; where all contradict each other, none does, and a lone find stays only
    where few searches were made: chance finds one place in many.

    Parameters
    ----------
    closures : sequence of Closure
        What one round of searches found.
    nodes : sequence of Node
        All nodes.
    config : LoopClosureConfig
        Windows of searches within a stretch.
    """
    out = list(closures)
    begins = np.array([0, *beginnings(nodes)])

    def stretches(k: int) -> tuple[int, int]:
        ends = closures[k].candidate.node, closures[k].candidate.anchor
        node, anchor = np.searchsorted(begins, ends, side="right") - 1
        return int(node), int(anchor)

    wide = [k for k, c in enumerate(closures) if is_wide(c.candidate, config)]
    for (stretch, _), group in groupby(sorted(wide, key=stretches), stretches):
        tried = list(group)
        found = [k for k in tried if not closures[k].rejected]
        start = nodes[begins[stretch]].pose_in_local
        places = np.array([_begin_seen_by(closures[k], nodes, start) for k in found]).reshape(-1, 3)
        least = 1 if len(tried) <= _FEW_SEARCHES else _LEAST_VOTES
        for k, stays in zip(found, _majority(places, least), strict=True):
            if not stays:
                out[k] = replace(closures[k], rejected="inconsistent")
    return out


def _begin_seen_by(closure: Closure, nodes: Sequence[Node], start: FloatArray) -> FloatArray:
    """Where a closure puts the first node of a stretch, in the local frame of the anchor."""
    candidate = closure.candidate
    node = compose(candidate.anchor_in_local, closure.anchor_from_node)
    return compose(node, between(nodes[candidate.node].pose_in_local, start))


def _majority(poses: FloatArray, least: int) -> NDArray[np.bool_]:
    """Which poses (k, 3) belong to the largest group around one of them, if it has `least` members."""
    if len(poses) == 0:
        return np.zeros(0, dtype=np.bool_)
    gap = between(poses[:, None], poses[None])
    near = (np.hypot(gap[..., 0], gap[..., 1]) < _SAME_PLACE) & (np.abs(gap[..., 2]) < _SAME_HEADING)
    votes = near.sum(axis=1)
    is_enough = votes.max() >= (least if len(poses) == 1 else max(least, 2))
    return np.asarray(near[votes.argmax()] & is_enough)


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
    begins = beginnings(nodes)
    edges = graph.edges
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
        goal = compose(poses[anchor], closure.anchor_from_node)
        bounds = [0, *begins, len(poses)]
        for k in np.flatnonzero(labels == mine):
            part = slice(bounds[k], bounds[k + 1])
            graph.set_poses(bounds[k], compose(goal, between(poses[node], poses[part])))
        ends = np.vstack((ends, [[anchor, node]]))
