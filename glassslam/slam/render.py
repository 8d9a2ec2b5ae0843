"""The finished map: every node entered once more at its optimised pose, and the glass in its cells."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

from glassslam.config import MapConfig
from glassslam.geometry import compose, inverse, transform_points
from glassslam.glass.layer import GlassLayer, locked, wall_cells
from glassslam.grid.probability_grid import OddsModel, ProbabilityGrid
from glassslam.records import Float32Array, FloatArray
from glassslam.slam.ghost_rays import visible_rays
from glassslam.slam.glass_locks import locks_submaps
from glassslam.slam.node import Node
from glassslam.slam.paint import paint_submaps
from glassslam.slam.result import OccupancyMap
from glassslam.slam.silence import occupied_where_silent

if TYPE_CHECKING:  # runs that do not look for glass need not load what finds it
    from glassslam.glass.ghosts import Ghosts, Kept
    from glassslam.slam.settled import SettledRun

Rays: TypeAlias = tuple[Float32Array, Float32Array]

_OCCUPIED, _FREE = 0.65, 0.196


@dataclass(frozen=True, slots=True)
class Rendering:
    """A finished map.

    Attributes
    ----------
    map : OccupancyMap
        The map.
    lidar : OccupancyMap
        The map without what is known of glass.
    glass : GlassLayer or None
        Its glass, with the cells it occupies.
    closed : OccupancyMap or None
        The map in which no beam goes through glass.
    """

    map: OccupancyMap
    lidar: OccupancyMap
    glass: GlassLayer | None
    closed: OccupancyMap | None = None


def render_run(run: "SettledRun", glass: GlassLayer | None, *, closed: bool = False) -> Rendering:
    """Map of a finished run, with its glass locked as the scheme says.

    Parameters
    ----------
    run : SettledRun
        Nodes, submaps, optimised poses and configuration.
    glass : GlassLayer or None
        Glass found; None when it was not looked for.
    closed : bool
        Whether to draw the map in which no beam goes through glass as well.
    """
    config, nodes, poses = run.config, run.nodes, run.tracks.nodes.poses
    if glass is None:
        grid = render(nodes, poses, config.map)
        return Rendering(grid, grid, None)
    shut = None
    if closed:
        shut = _locked(_closed(run, glass), glass)
    if locks_submaps(config.glass.scheme):
        first = [submap.nodes[0] for submap in run.submaps]
        local = np.array([nodes[k].pose_in_local for k in first])
        moves = compose(poses[first], inverse(local))
        grid, cells = paint_submaps(run.submaps, moves, config.map.resolution)
        layer = _with_ghost_cells(replace(glass, locked_cells=cells), run, grid)
        return Rendering(grid, render(nodes, poses, config.map), layer, shut)
    grid = render(nodes, poses, config.map, glass.ghosts, config.glass.ghosts_in_map)
    layer = _with_ghost_cells(glass, run, grid)
    if config.glass.scheme == "off":
        return Rendering(grid, grid, layer, shut)
    mask = _wall_mask(grid, glass)
    held = OccupancyMap(locked(grid.probability, mask), grid.resolution, grid.origin)
    return Rendering(held, grid, replace(layer, locked_cells=_centres(mask, grid)), shut)


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
    return _drawn(nodes, poses, config, visible_rays(nodes, ghosts, kept))


def _drawn(nodes: Sequence[Node], poses: FloatArray, config: MapConfig, rays: Iterable[Rays]) -> OccupancyMap:
    """Map of what the nodes hit and clear."""
    odds = OddsModel(config.hit_probability, config.miss_probability)
    grid = ProbabilityGrid(config.resolution, odds, silent_stop=_OCCUPIED)
    for node, pose, (returns, free_ends) in zip(nodes, poses, rays, strict=True):
        grid.insert(
            transform_points(pose, node.sensor[None])[0],
            transform_points(pose, returns.astype(np.float64)),
            transform_points(pose, free_ends.astype(np.float64)),
        )
    grid.finish()
    return OccupancyMap(grid.probability(), config.resolution, (float(grid.origin[0]), float(grid.origin[1])))


def _closed(run: "SettledRun", glass: GlassLayer) -> OccupancyMap:
    """Map in which no beam goes through glass, and silence clears only where it tells of free space."""
    nodes, poses, config = run.nodes, run.tracks.nodes.poses, run.config.map
    rays = list(visible_rays(nodes, glass.ghosts, "none"))
    silent = [len(node.free_ends) for node in nodes]
    parts = [(free[:count], free[count:]) for count, (_, free) in zip(silent, rays, strict=True)]
    # what is opaque, and what silence means, does not depend on the odds the map is written with
    usual = MapConfig(resolution=config.resolution)
    bare = _drawn(nodes, poses, usual, [(hit, cut) for (hit, _), (_, cut) in zip(rays, parts, strict=True)])
    opaque = (bare.probability > _OCCUPIED) & ~_near(_wall_mask(bare, glass))
    heard = [(hit, quiet) for (hit, _), (quiet, _) in zip(rays, parts, strict=True)]
    if occupied_where_silent(nodes, poses, heard, bare, opaque) < _FREE:
        return _drawn(nodes, poses, config, rays)
    # silence says something only where glass explains it
    kept = _into_glass(silent, glass)
    clear = [np.concatenate((quiet[keep], cut)) for keep, (quiet, cut) in zip(kept, parts, strict=True)]
    return _drawn(nodes, poses, config, [(hit, free) for (hit, _), free in zip(rays, clear, strict=True)])


def _into_glass(silent: Sequence[int], glass: GlassLayer) -> list[NDArray[np.bool_]]:
    """Silent beams of every node that run into a glass wall."""
    if glass.ghosts is None:
        return [np.zeros(count, dtype=np.bool_) for count in silent]
    return np.split(glass.ghosts.silent_share < 1.0, np.cumsum(silent)[:-1])


def _near(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The cells of a mask and all within two cells of them."""
    from scipy.ndimage import binary_dilation  # noqa: PLC0415  (only runs with sonars need it)

    return np.asarray(binary_dilation(mask, iterations=2))


def _locked(grid: OccupancyMap, layer: GlassLayer) -> OccupancyMap:
    """The map with the cells of its glass walls occupied."""
    return OccupancyMap(locked(grid.probability, _wall_mask(grid, layer)), grid.resolution, grid.origin)


def _wall_mask(grid: OccupancyMap, layer: GlassLayer) -> NDArray[np.bool_]:
    """Cells of the map that glass walls run through, shape (rows, columns)."""
    shape = (grid.probability.shape[0], grid.probability.shape[1])
    return wall_cells(layer.walls, shape, grid.origin, grid.resolution)


def _with_ghost_cells(layer: GlassLayer, run: "SettledRun", grid: OccupancyMap) -> GlassLayer:
    """The layer with the cells of the map in which nothing but ghosts ends."""
    if layer.ghosts is None:
        return layer
    from glassslam.glass.beams import Beams  # noqa: PLC0415  (only runs that look for glass need it)
    from glassslam.glass.ghosts import ghost_cells  # noqa: PLC0415

    returns = Beams.pack([node.sensor for node in run.nodes], [node.ends for node in run.nodes])
    shape = (grid.probability.shape[0], grid.probability.shape[1])
    mask = ghost_cells(
        layer.ghosts.labels, run.tracks.nodes.poses, returns, shape, grid.origin, grid.resolution
    )
    return replace(layer, ghost_cells=_centres(mask, grid))


def _centres(mask: NDArray[np.bool_], grid: OccupancyMap) -> FloatArray:
    """Centres of the marked cells of a map, shape (k, 2), m."""
    return np.asarray(np.asarray(grid.origin) + grid.resolution * (np.argwhere(mask)[:, ::-1] + 0.5))
