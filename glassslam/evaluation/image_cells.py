"""Maps as classes of cells, and the truth drawn in the cells of a map."""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from glassslam.errors import EvaluationError
from glassslam.geometry import inverse, transform_points
from glassslam.outputs.map_server import FREE_THRESH, OCCUPIED_THRESH
from glassslam.records import FloatArray
from glassslam.slam.result import OccupancyMap

Mask: TypeAlias = NDArray[np.bool_]
Classes: TypeAlias = NDArray[np.uint8]

MARGIN = 1.0
"""How far the compared region reaches beyond what the truth knows, m."""

NO_CLASS, OPEN, SOLID, PANE = range(4)
"""Unknown, free, occupied, and occupied by glass."""


def classes_of(grid: OccupancyMap, glass: Mask | None, name: str) -> Classes:
    """Class of every cell, shape (rows, columns); `name` opens the error text.

    Raises
    ------
    EvaluationError
        The glass is of another shape than the map.
    """
    classes = np.zeros(grid.probability.shape, dtype=np.uint8)
    classes[grid.probability < FREE_THRESH] = OPEN
    classes[grid.probability > OCCUPIED_THRESH] = SOLID
    if glass is not None:
        if glass.shape != classes.shape:
            raise EvaluationError(f"{name} has {classes.shape} cells, its classes have {glass.shape}")
        classes[glass & (classes == SOLID)] = PANE
    return classes


def region_of(
    grid: OccupancyMap, truth: OccupancyMap, true_classes: Classes, motion: FloatArray
) -> tuple[NDArray[np.int64], tuple[int, int]]:
    """First cell (column, row) and shape of what is compared, in cells of the map.

    Raises
    ------
    EvaluationError
        The truth knows no cell.
    """
    rows, columns = np.nonzero(true_classes)
    if rows.size == 0:
        raise EvaluationError("the truth knows no cell", "is it the right file?")
    centres = np.asarray(truth.origin) + (np.stack((columns, rows), axis=1) + 0.5) * truth.resolution
    moved = (transform_points(motion, centres) - np.asarray(grid.origin)) / grid.resolution
    margin = MARGIN / grid.resolution
    low = np.floor(moved.min(axis=0) - margin).astype(np.int64)
    high = np.ceil(moved.max(axis=0) + margin).astype(np.int64)
    return low, (int(high[1] - low[1]), int(high[0] - low[0]))


def cut_out(classes: Classes, grid: OccupancyMap, low: NDArray[np.int64], shape: tuple[int, int]) -> Classes:
    """The classes of a map in the region compared; unknown where the map ends."""
    out = np.zeros(shape, dtype=np.uint8)
    rows, columns = grid.probability.shape
    top, left = max(0, -int(low[1])), max(0, -int(low[0]))
    part = classes[max(0, int(low[1])) : max(0, min(rows, int(low[1]) + shape[0])),
                   max(0, int(low[0])) : max(0, min(columns, int(low[0]) + shape[1]))]  # fmt: skip
    out[top : top + part.shape[0], left : left + part.shape[1]] = part[: shape[0] - top, : shape[1] - left]
    return out


def drawn_anew(
    true_classes: Classes,
    truth: OccupancyMap,
    motion: FloatArray,
    grid: OccupancyMap,
    low: NDArray[np.int64],
    shape: tuple[int, int],
) -> Classes:
    """The truth in cells of the map; of the finer cells within one, the occupied win, then the free."""
    finer = max(1, round(grid.resolution / truth.resolution))
    truth_from_map = inverse(motion)
    out = np.zeros(shape, dtype=np.uint8)
    for step in np.ndindex(finer, finer):
        within = (np.array(step) + 0.5) / finer
        columns, rows = np.meshgrid(np.arange(shape[1]) + within[0], np.arange(shape[0]) + within[1])
        places = np.stack((columns.ravel() + low[0], rows.ravel() + low[1]), axis=1) * grid.resolution
        cells = transform_points(truth_from_map, places + np.asarray(grid.origin)) - np.asarray(truth.origin)
        index = np.floor(cells / truth.resolution + 1e-9).astype(np.int64)
        inside = (index >= 0).all(axis=1) & (index < np.array(true_classes.shape)[::-1]).all(axis=1)
        found = np.zeros(len(index), dtype=np.uint8)
        found[inside] = true_classes[index[inside, 1], index[inside, 0]]
        out = np.maximum(out, found.reshape(shape))
    return out
