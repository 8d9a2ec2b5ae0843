"""The finished map: every node entered once more at its optimised pose."""

from collections.abc import Sequence

import numpy as np

from glassslam.config import MapConfig
from glassslam.geometry import transform_points
from glassslam.glass.layer import GlassLayer, locked, wall_cells
from glassslam.grid.probability_grid import OddsModel, ProbabilityGrid
from glassslam.records import FloatArray
from glassslam.slam.node import Node
from glassslam.slam.result import OccupancyMap


def render(nodes: Sequence[Node], poses: FloatArray, config: MapConfig) -> OccupancyMap:
    """Map of all nodes at the given poses, shape (n, 3), in the map frame."""
    grid = ProbabilityGrid(config.resolution, OddsModel(config.hit_probability, config.miss_probability))
    for node, pose in zip(nodes, poses, strict=True):
        grid.insert(
            transform_points(pose, node.sensor[None])[0],
            transform_points(pose, node.returns.astype(np.float64)),
            transform_points(pose, node.free_ends.astype(np.float64)),
        )
    grid.finish()
    return OccupancyMap(grid.probability(), config.resolution, (float(grid.origin[0]), float(grid.origin[1])))


def with_glass(grid: OccupancyMap, layer: GlassLayer) -> OccupancyMap:
    """The map with the cells of its glass walls occupied."""
    shape = (grid.probability.shape[0], grid.probability.shape[1])
    mask = wall_cells(layer.walls, shape, grid.origin, grid.resolution)
    return OccupancyMap(locked(grid.probability, mask), grid.resolution, grid.origin)
