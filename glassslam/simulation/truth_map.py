"""The true map of a scene: what a perfect sensor carried everywhere would draw."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from glassslam.geometry import inverse, transform_points
from glassslam.records import Float32Array, FloatArray
from glassslam.simulation.raycast import SegmentGrid
from glassslam.simulation.sight_kernels import mark_rays
from glassslam.slam.result import OccupancyMap

Mask = NDArray[np.bool_]

_MARGIN = 10
_LARGEST_DOOR = 2.0
_LOOKS = 1440
_SPACING = 0.5


@dataclass(frozen=True, slots=True)
class TrueMap:
    """A floor plan as cells.

    Attributes
    ----------
    grid : OccupancyMap
        1 where there is a wall, a pane or a thing, 0 where the robot could have gone, NaN elsewhere.
    glass : ndarray of bool, shape (rows, columns)
        Occupied cells that a pane runs through.
    """

    grid: OccupancyMap
    glass: Mask

    @property
    def glass_share(self) -> float:
        """Cells of glass among the occupied ones, as pi-map counts it in its Table III."""
        return float(self.glass.sum() / max(1, int((self.grid.probability == 1.0).sum())))


def draw_true_map(segments: FloatArray, glass: Mask, path: FloatArray, resolution: float = 0.05) -> TrueMap:
    """Draw surfaces into cells and fill what can be reached from a path.

    Free space ends at the hull of the building: doors to the outside of at most 2 m are taken as shut.
    Surfaces that no free cell touches, as the far side of an outer wall, stay unknown.

    Parameters
    ----------
    segments : ndarray of float64, shape (n, 4)
        End points of all surfaces, m.
    glass : ndarray of bool, shape (n,)
        Which of them are panes.
    path : ndarray of float64, shape (m, 2)
        Places where the robot has been, in the same frame, m.
    resolution : float
        Edge of a cell, m.
    """
    from scipy import ndimage  # noqa: PLC0415  (only maps need it)

    low = np.floor(segments.reshape(-1, 2).min(axis=0) / resolution).astype(np.int64) - _MARGIN
    high = np.floor(segments.reshape(-1, 2).max(axis=0) / resolution).astype(np.int64) + _MARGIN + 1
    shape = (int(high[1] - low[1]), int(high[0] - low[0]))
    walls = _drawn(segments, shape, low, resolution)
    panes = _drawn(segments[glass], shape, low, resolution)
    free = _connected(~walls, _cells(path, low, resolution)) & ~_outside(walls, resolution)
    occupied = walls & ndimage.binary_dilation(free, np.ones((3, 3), dtype=np.bool_))
    probability = np.full(shape, np.nan, dtype=np.float32)
    probability[free] = 0.0
    probability[occupied] = 1.0
    origin = (float(low[0] * resolution), float(low[1] * resolution))
    return TrueMap(OccupancyMap(probability, resolution, origin), panes & occupied)


def in_sight(drawn: TrueMap, segments: FloatArray, path: FloatArray, reach: float = 30.0) -> TrueMap:
    """Keep what can be seen from a path; panes count as walls.

    For tours that leave whole parts of a building out, which no robot could have mapped.

    Parameters
    ----------
    drawn : TrueMap
        The map of all that can be reached.
    segments : ndarray of float64, shape (n, 4)
        The surfaces it was drawn from, m.
    path : ndarray of float64, shape (m, 2)
        Places where the robot has been, m; looked around from every half metre.
    reach : float
        How far is looked, m.
    """
    from scipy import ndimage  # noqa: PLC0415  (only maps need it)

    grid, surfaces = drawn.grid, SegmentGrid.build(segments)
    low = np.asarray(grid.origin, dtype=np.float64)
    seen = np.zeros(grid.probability.shape, dtype=np.bool_)
    angles: FloatArray = np.arange(_LOOKS, dtype=np.float64) * (2.0 * np.pi / _LOOKS)
    for place in _spaced(path):
        origins = np.broadcast_to(place, (_LOOKS, 2)).copy()
        lengths = np.minimum(surfaces.cast(origins, angles).distance, reach)
        mark_rays(origins, angles, lengths, low, grid.resolution, seen)
    # far from the robot there are gaps between the rays
    free = ndimage.binary_closing(seen, np.ones((5, 5), dtype=np.bool_)) & (grid.probability == 0.0)
    edge = ndimage.binary_dilation(free, np.ones((3, 3), dtype=np.bool_)) & (grid.probability == 1.0)
    probability = np.where(free | edge, grid.probability, np.nan).astype(np.float32)
    return TrueMap(replace(grid, probability=probability), drawn.glass & edge)


def _spaced(path: FloatArray) -> FloatArray:
    """Places of a path that are half a metre apart along it."""
    walked = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))))
    _, first = np.unique(np.floor(walked / _SPACING), return_index=True)
    return path[first]


def in_map_frame(segments: FloatArray, world_from_map: FloatArray) -> FloatArray:
    """Segments (n, 4) of the world in the frame of a run, which is the base at the first scan."""
    return transform_points(inverse(world_from_map), segments.reshape(-1, 2)).reshape(-1, 4)


def _cells(points: FloatArray, low: NDArray[np.int64], resolution: float) -> NDArray[np.int64]:
    """Column and row of the cells of points (n, 2)."""
    cells: NDArray[np.int64] = np.floor(points / resolution).astype(np.int64) - low
    return cells


def _drawn(segments: FloatArray, shape: tuple[int, int], low: NDArray[np.int64], resolution: float) -> Mask:
    """Cells that segments run through."""
    mask = np.zeros(shape, dtype=np.bool_)
    for segment in segments:
        a, b = segment[:2], segment[2:]
        share = np.linspace(0.0, 1.0, 2 + int(4.0 * np.hypot(*(b - a)) / resolution))[:, None]
        columns, rows = _cells(a + share * (b - a), low, resolution).T
        mask[rows, columns] = True
    return mask


def _connected(open_cells: Mask, cells: NDArray[np.int64]) -> Mask:
    """Open cells that hang together with any of the given ones, edge to edge."""
    from scipy import ndimage  # noqa: PLC0415

    parts, _ = ndimage.label(open_cells)
    inside = (cells >= 0).all(axis=1) & (cells < np.array(open_cells.shape)[::-1]).all(axis=1)
    reached = np.unique(parts[cells[inside, 1], cells[inside, 0]])
    return np.asarray(np.isin(parts, reached[reached > 0]))


def _outside(walls: Mask, resolution: float) -> Mask:
    """Cells that a disc too large for any door could reach from the border."""
    from scipy import ndimage  # noqa: PLC0415

    radius = 0.5 * _LARGEST_DOOR / resolution
    pad = int(radius) + 2
    wide = np.pad(walls, pad)
    parts, _ = ndimage.label(_distance(~wide) > radius)
    centres = parts == parts[0, 0]
    near = _distance(~centres) <= radius
    return near[pad:-pad, pad:-pad]


def _distance(cells: Mask) -> Float32Array:
    """Distance of every cell to the nearest one that is not set, cells."""
    import cv2  # noqa: PLC0415  (only maps need it; takes a fifth of the memory of scipy's)

    exact = cv2.distanceTransform(cells.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    return np.asarray(exact, dtype=np.float32)
