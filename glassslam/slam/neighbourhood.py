"""What a node and its neighbours see together: the cloud that loop closures match.

One planar scan in a corridor fits everywhere along it. The scans of a few metres of travel hold the
doors, niches and corners that tell places apart, so closures match all of them at once.
"""

from dataclasses import dataclass

import numpy as np

from glassslam.geometry import between, transform_points
from glassslam.records import FloatArray
from glassslam.slam.node import Node
from glassslam.slam.range_data import thin

_MOST_NODES = 9
_WIDEST_SPAN = 40
_FINE_EDGE, _COARSE_EDGE = 0.07, 0.15
_FINE_POINTS, _COARSE_POINTS = 600, 250


@dataclass(frozen=True, slots=True)
class Neighbourhood:
    """Points around a node, in its frame.

    Attributes
    ----------
    fine, coarse : ndarray of float64, shape (n, 2), (m, 2)
        Points for the gradient match and for branch and bound, m.
    residual : float
        Mean residual of the local matches of the scans used.
    """

    fine: FloatArray
    coarse: FloatArray
    residual: float


def _at_most(points: FloatArray, count: int) -> FloatArray:
    if len(points) <= count:
        return points
    return points[np.linspace(0, len(points) - 1, count).astype(np.int64)]


def neighbours(travel: FloatArray, index: int, reach: float) -> list[int]:
    """Nodes within `reach` of travel (m) of a node: the node itself and at most nine, spread evenly.

    Parameters
    ----------
    travel : ndarray of float64, shape (n,)
        Distance travelled up to every node, m.
    index : int
        The node.
    reach : float
        Travel before and after, m.
    """
    first = max(int(np.searchsorted(travel, travel[index] - reach)), index - _WIDEST_SPAN)
    last = min(int(np.searchsorted(travel, travel[index] + reach, side="right")) - 1, index + _WIDEST_SPAN)
    spread = np.linspace(first, last, min(last - first + 1, _MOST_NODES)).astype(np.int64)
    return sorted({index, *spread.tolist()})


def neighbourhood(nodes: list[Node], chosen: list[int], index: int) -> Neighbourhood:
    """Union of the scans of the chosen nodes in the frame of node `index`, thinned."""
    pose = nodes[index].pose_in_local
    cloud = np.concatenate(
        [
            transform_points(between(pose, nodes[k].pose_in_local), nodes[k].returns.astype(np.float64))
            for k in chosen
        ]
    )
    fine = thin(cloud, _FINE_EDGE)
    coarse = _at_most(thin(fine, _COARSE_EDGE), _COARSE_POINTS)
    residual = float(np.mean([nodes[k].residual for k in chosen]))
    return Neighbourhood(_at_most(fine, _FINE_POINTS), coarse, residual)
