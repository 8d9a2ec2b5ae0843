"""How a map of the hallway of pi-map is bowed against the floor plan, told by its opaque walls alone.

A trajectory of lidar SLAM through 30 m of hallway is not straight to a cell. The plan bowed alike lies on the
walls of the map; panes go with the walls beside them, whatever the sonars say.
"""

from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from glassslam.geometry import inverse, transform_points
from glassslam.outputs.map_server import OCCUPIED_THRESH
from glassslam.records import FloatArray
from glassslam.slam.result import OccupancyMap

if TYPE_CHECKING:
    from pimap_truth import Plan

Bow: TypeAlias = tuple[FloatArray, FloatArray]
"""x along the hallway, and how far the map has left the plan there, to the north, m."""

KNOT_SPACING = 3.0
_PIECE = 0.5
_REACH = 0.15
_CLEAR_OF_ENDS = 0.05
_STIFFNESS = 3.0
_SCATTER = 0.03
_ROUNDS = 10


def bow_of(plan: "Plan", lidar_map: OccupancyMap, map_from_plan: tuple[float, float, float]) -> Bow:
    """Fit a line with knots every three metres to where the map has the walls that run along the hallway.

    Parameters
    ----------
    plan : Plan
        The floor plan; only opaque walls that the lidar has measured are used.
    lidar_map : OccupancyMap
        The map of the lidar alone.
    map_from_plan : tuple of float
        Motion x, y, theta that lays the straight plan onto the map, m and rad.
    """
    cells = np.argwhere(lidar_map.probability > OCCUPIED_THRESH)[:, ::-1]
    points = np.asarray(lidar_map.origin) + (cells + 0.5) * lidar_map.resolution
    x, offset = wall_offsets(plan, transform_points(inverse(np.array(map_from_plan)), points))
    ends = plan.lines(straight=True)[:, 0::2]
    knots: FloatArray = np.arange(ends.min(), ends.max() + KNOT_SPACING, KNOT_SPACING)
    hats = np.array([np.interp(x, knots, hat) for hat in np.eye(len(knots))]).T
    bends = _STIFFNESS * np.diff(np.eye(len(knots)), 2, axis=0)
    weight: FloatArray = np.ones(len(x))
    at_knots: FloatArray = np.zeros(len(knots))
    for _ in range(_ROUNDS):
        left = np.vstack((hats * weight[:, None], bends))
        right = np.append(offset * weight, np.zeros(len(bends)))
        at_knots = np.asarray(np.linalg.lstsq(left, right, rcond=None)[0], dtype=np.float64)
        # things that stand before a wall must not bend it
        weight = 1.0 / np.hypot(1.0, (offset - hats @ at_knots) / _SCATTER)
    return knots, at_knots


def wall_offsets(plan: "Plan", points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Where along the hallway points (n, 2) lie near one of its long walls, and how far north of it, m."""
    along, aside = [np.empty(0)], [np.empty(0)]
    for line, ends in zip(plan.segments, plan.lines(straight=True), strict=True):
        step = ends[2:] - ends[:2]
        length = float(np.hypot(*step))
        u = step / length * np.sign(step[0])
        if line.kind != "wall" or line.by != "lidar" or length < 0.3 or abs(u[0]) < 0.9:
            continue
        first = points - ends[:2] if step[0] > 0 else points - ends[2:]
        t, offset = first @ u, first @ np.array([-u[1], u[0]])
        near = (t > _CLEAR_OF_ENDS) & (t < length - _CLEAR_OF_ENDS) & (np.abs(offset) < _REACH)
        along.append(points[near, 0])
        aside.append(offset[near])
    return np.concatenate(along), np.concatenate(aside)


def bowed(lines: FloatArray, bow: Bow) -> tuple[FloatArray, FloatArray]:
    """Lines (n, 4) in short pieces (m, 4) that follow a bow, and the line each piece is of (m,)."""
    pieces, of_line = [], []
    for k, ends in enumerate(lines):
        count = max(1, int(np.ceil(np.hypot(*(ends[2:] - ends[:2])) / _PIECE)))
        share = np.linspace(0.0, 1.0, count + 1)[:, None]
        points = ends[:2] + share * (ends[2:] - ends[:2])
        points[:, 1] += np.interp(points[:, 0], *bow)
        pieces.append(np.hstack((points[:-1], points[1:])))
        of_line.append(np.full(count, k))
    return np.concatenate(pieces), np.concatenate(of_line)
