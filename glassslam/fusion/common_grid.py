"""Maps of different origins and resolutions brought onto one grid."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from glassslam.errors import GridError
from glassslam.records import Float32Array
from glassslam.slam.result import OccupancyMap

_SAME = 1e-6


def on_common_grid(maps: Sequence[OccupancyMap]) -> list[OccupancyMap]:
    """The maps on one grid that covers them all, at the finest of their resolutions.

    A cell takes the value of the source cell that holds its centre; outside of its source it is NaN. A map
    that already lies a whole number of cells from the grid keeps its values unchanged.

    Parameters
    ----------
    maps : sequence of OccupancyMap
        Maps of the same frame.

    Raises
    ------
    GridError
        No map, or a resolution that is not positive.
    """
    if not maps:
        raise GridError("no maps to bring onto one grid", "give at least one")
    for grid in maps:
        if not (math.isfinite(grid.resolution) and grid.resolution > 0):
            raise GridError(f"resolution of a map is {grid.resolution} m", "it must be positive")
    resolution = min(grid.resolution for grid in maps)
    anchor = next(grid.origin for grid in maps if grid.resolution == resolution)
    # a map without cells must not stretch the grid to its origin
    held = [grid for grid in maps if grid.probability.size] or list(maps)
    first, last = zip(*(_span(grid, anchor, resolution) for grid in held), strict=True)
    low, high = np.min(first, axis=0), np.max(last, axis=0)
    origin = (float(anchor[0] + low[0] * resolution), float(anchor[1] + low[1] * resolution))
    columns, rows = (high - low).tolist()
    return [
        OccupancyMap(_sampled(grid, origin, resolution, (rows, columns)), resolution, origin) for grid in maps
    ]


def _span(
    grid: OccupancyMap, anchor: tuple[float, float], resolution: float
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First cell (column, row) of the common grid that a map touches, and the one after its last."""
    corner = np.array(grid.origin) - anchor
    size = np.array(grid.probability.shape[::-1]) * grid.resolution
    return (
        np.floor(corner / resolution + _SAME).astype(np.int64),
        np.ceil((corner + size) / resolution - _SAME).astype(np.int64),
    )


def _sampled(
    grid: OccupancyMap, origin: tuple[float, float], resolution: float, shape: tuple[int, int]
) -> Float32Array:
    rows, columns = (
        np.floor(
            (origin[axis] + (np.arange(shape[1 - axis]) + 0.5) * resolution - grid.origin[axis])
            / grid.resolution
        ).astype(np.int64)
        for axis in (1, 0)
    )
    out = np.full(shape, np.nan, dtype=np.float32)
    inside_rows = np.flatnonzero((rows >= 0) & (rows < grid.probability.shape[0]))
    inside_columns = np.flatnonzero((columns >= 0) & (columns < grid.probability.shape[1]))
    out[np.ix_(inside_rows, inside_columns)] = grid.probability[
        np.ix_(rows[inside_rows], columns[inside_columns])
    ]
    return out
