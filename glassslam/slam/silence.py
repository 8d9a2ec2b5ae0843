"""What it means when a beam has no echo: free space with one lidar, next to nothing with another."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from glassslam.geometry import transform_points
from glassslam.records import Float32Array, FloatArray
from glassslam.slam.node import Node
from glassslam.slam.result import OccupancyMap
from glassslam.slam.silence_kernels import count_meetings

_BEYOND = 2.0


def occupied_where_silent(
    nodes: Sequence[Node],
    poses: FloatArray,
    rays: Sequence[tuple[Float32Array, Float32Array]],
    grid: OccupancyMap,
    walls: NDArray[np.bool_],
) -> float:
    """Probability that a place is occupied to which only silent beams came.

    Of the beams that head for known opaque walls a share s is silent; by Bayes' rule, at even odds before, it
    is s / (1 + s). Further silent beams do not change it: a surface that gives no echo once, being dark,
    smooth or seen aslant, gives none the next time.

    Parameters
    ----------
    nodes : sequence of Node
        All nodes.
    poses : ndarray of float64, shape (n, 3)
        Their poses, m and rad.
    rays : sequence of pairs of ndarray of float32, shapes (h, 2) and (f, 2)
        Returns, and ends of silent beams, of every node, frame of its base, m.
    grid : OccupancyMap
        A map made from returns.
    walls : ndarray of bool, shape as the map
        Its opaque walls.
    """
    met = [0, 0]
    for node, pose, ends in zip(nodes, poses, rays, strict=True):
        start = _cells(transform_points(pose, node.sensor[None]), grid)[0]
        for kind, beyond in enumerate((_BEYOND, 0.0)):
            there = _cells(transform_points(pose, ends[kind].astype(np.float64)), grid)
            met[kind] += count_meetings(start, there, walls, beyond)
    answered, silent = met
    return silent / max(answered + 2 * silent, 1)


def _cells(points: FloatArray, grid: OccupancyMap) -> FloatArray:
    return np.asarray((points - np.asarray(grid.origin)) / grid.resolution)
