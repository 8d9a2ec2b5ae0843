"""The finished map: every node entered once more at its optimised pose, and the glass in its cells."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from glassslam.config import Config, MapConfig
from glassslam.geometry import compose, inverse, transform_points
from glassslam.glass.layer import GlassLayer, locked, wall_cells
from glassslam.grid.probability_grid import OddsModel, ProbabilityGrid
from glassslam.records import FloatArray
from glassslam.slam.ghost_rays import visible_rays
from glassslam.slam.glass_locks import locks_submaps
from glassslam.slam.global_slam import GlobalSlam
from glassslam.slam.node import Node
from glassslam.slam.paint import paint_submaps
from glassslam.slam.result import OccupancyMap

if TYPE_CHECKING:  # runs that do not look for glass need not load what finds it
    from glassslam.glass.ghosts import Ghosts, Kept


@dataclass(frozen=True, slots=True)
class Rendering:
    """A finished map.

    Attributes
    ----------
    map : OccupancyMap
        The map.
    glass : GlassLayer or None
        Its glass, with the cells it occupies.
    """

    map: OccupancyMap
    glass: GlassLayer | None


def render_run(world: GlobalSlam, glass: GlassLayer | None, config: Config) -> Rendering:
    """Map of a finished run, with its glass locked as the scheme says.

    Parameters
    ----------
    world : GlobalSlam
        Nodes, submaps and optimised poses.
    glass : GlassLayer or None
        Glass found; None when it was not looked for.
    config : Config
        Resolution, odds and scheme.
    """
    if glass is not None and locks_submaps(config.glass.scheme):
        first = [submap.nodes[0] for submap in world.submaps]
        local = np.array([world.nodes[k].pose_in_local for k in first])
        moves = compose(world.poses[first], inverse(local))
        grid, cells = paint_submaps(world.submaps, moves, config.map.resolution)
        return Rendering(grid, _with_ghost_cells(replace(glass, locked_cells=cells), world, grid))
    ghosts = None if glass is None else glass.ghosts
    grid = render(world.nodes, world.poses, config.map, ghosts, config.glass.ghosts_in_map)
    if glass is None:
        return Rendering(grid, None)
    layer = _with_ghost_cells(glass, world, grid)
    return Rendering(grid, layer) if config.glass.scheme == "off" else with_glass(grid, layer)


def render(
    nodes: Sequence[Node],
    poses: FloatArray,
    config: MapConfig,
    ghosts: "Ghosts | None" = None,
    kept: "Kept" = "all",
) -> OccupancyMap:
    """Map of all nodes in the map frame.

    Parameters
    ----------
    nodes : sequence of Node
        All nodes.
    poses : ndarray of float64, shape (n, 3)
        Their poses, m and rad.
    config : MapConfig
        Resolution and odds.
    ghosts : Ghosts, optional
        Their returns from behind glass.
    kept : {"all", "seen_through", "none"}
        Which of these are shown; the rays of the others end as free space at the wall.
    """
    grid = ProbabilityGrid(config.resolution, OddsModel(config.hit_probability, config.miss_probability))
    for node, pose, (returns, free_ends) in zip(nodes, poses, visible_rays(nodes, ghosts, kept), strict=True):
        grid.insert(
            transform_points(pose, node.sensor[None])[0],
            transform_points(pose, returns.astype(np.float64)),
            transform_points(pose, free_ends.astype(np.float64)),
        )
    grid.finish()
    return OccupancyMap(grid.probability(), config.resolution, (float(grid.origin[0]), float(grid.origin[1])))


def with_glass(grid: OccupancyMap, layer: GlassLayer) -> Rendering:
    """The map with the cells of its glass walls occupied."""
    shape = (grid.probability.shape[0], grid.probability.shape[1])
    mask = wall_cells(layer.walls, shape, grid.origin, grid.resolution)
    held = OccupancyMap(locked(grid.probability, mask), grid.resolution, grid.origin)
    return Rendering(held, replace(layer, locked_cells=_centres(mask, grid)))


def _with_ghost_cells(layer: GlassLayer, world: GlobalSlam, grid: OccupancyMap) -> GlassLayer:
    """The layer with the cells of the map in which nothing but ghosts ends."""
    if layer.ghosts is None:
        return layer
    from glassslam.glass.beams import Beams  # noqa: PLC0415  (only runs that look for glass need it)
    from glassslam.glass.ghosts import ghost_cells  # noqa: PLC0415

    returns = Beams.pack([node.sensor for node in world.nodes], [node.ends for node in world.nodes])
    shape = (grid.probability.shape[0], grid.probability.shape[1])
    mask = ghost_cells(layer.ghosts.labels, world.poses, returns, shape, grid.origin, grid.resolution)
    return replace(layer, ghost_cells=_centres(mask, grid))


def _centres(mask: NDArray[np.bool_], grid: OccupancyMap) -> FloatArray:
    """Centres of the marked cells of a map, shape (k, 2), m."""
    return np.asarray(np.asarray(grid.origin) + grid.resolution * (np.argwhere(mask)[:, ::-1] + 0.5))
