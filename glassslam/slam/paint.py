"""The map as Cartographer writes it: finished submaps painted over each other at their optimised poses."""

from collections.abc import Sequence

import numpy as np

from glassslam.geometry import inverse, transform_points
from glassslam.grid.odds import log_odds
from glassslam.grid.submap import Submap
from glassslam.records import Float32Array, FloatArray
from glassslam.slam.paint_kernels import paint
from glassslam.slam.result import OccupancyMap

_FULL_SHADE = 0.9  # P(occupied) that darkens a cell by half; 1 minus it brightens a cell as much
_OCCUPIED = 0.65


def paint_submaps(
    submaps: Sequence[Submap], map_from_local: FloatArray, resolution: float
) -> tuple[OccupancyMap, FloatArray]:
    """Paint submaps in their order, and tell which locked cells are still occupied at the end.

    Later submaps count more: what they see as free fades what earlier ones hold, locked or not.

    Parameters
    ----------
    submaps : sequence of Submap
        At least one, finished, with grids in the local frame.
    map_from_local : ndarray of float64, shape (s, 3)
        Where the local frame of each submap lies in the map, m and rad.
    resolution : float
        Cell edge of the map, m.

    Returns
    -------
    map : OccupancyMap
        The picture as P(occupied).
    locked : ndarray of float64, shape (k, 2)
        Centres of occupied cells that some submap had locked, m.
    """
    boxes = np.array([_box(s, pose) for s, pose in zip(submaps, map_from_local, strict=True)])
    low = np.floor(boxes[:, 0].min(axis=0) / resolution).astype(np.int64)
    high = np.ceil(boxes[:, 1].max(axis=0) / resolution).astype(np.int64)
    corner, (columns, rows) = low * resolution, (high - low).tolist()
    brightness = np.full((rows, columns), 0.5, dtype=np.float32)
    state = np.zeros((rows, columns), dtype=np.uint8)
    for submap, pose, box in zip(submaps, map_from_local, boxes, strict=True):
        first = np.maximum(np.floor(box[0] / resolution).astype(np.int64) - low, 0)
        stop = np.minimum(np.ceil(box[1] / resolution).astype(np.int64) - low, (columns, rows))
        paint(
            submap.grid.cells, submap.grid.origin, submap.grid.resolution, inverse(pose),
            _shades(submap.grid.table), submap.grid.odds.locked, corner, resolution,
            first[1], first[0], stop[1], stop[0], brightness, state,
        )  # fmt: skip
    probability = np.where(state == 0, np.float32(np.nan), np.float32(1.0) - brightness)
    held = np.argwhere((state == 2) & (probability > _OCCUPIED))[:, ::-1]
    grid = OccupancyMap(probability, resolution, (float(corner[0]), float(corner[1])))
    return grid, corner + resolution * (held + 0.5)


def _box(submap: Submap, map_from_local: FloatArray) -> FloatArray:
    """Lower and upper corner of a submap in the map, shape (2, 2), m."""
    size = submap.grid.resolution * np.array(submap.grid.cells.shape[::-1])
    corners = submap.grid.origin + size * np.array([[0, 0], [1, 0], [0, 1], [1, 1]])
    placed = transform_points(map_from_local, corners)
    return np.stack((placed.min(axis=0), placed.max(axis=0)))


def _shades(table: Float32Array) -> Float32Array:
    """Light that a cell of each value adds or takes away, in [-0.5, 0.5]."""
    known = np.clip(table.astype(np.float64), 1.0 - _FULL_SHADE, _FULL_SHADE)
    return (-np.log(known / (1.0 - known)) / (2.0 * log_odds(_FULL_SHADE))).astype(np.float32)
