"""Where a map of the hallway of pi-map is wrong: its cells beside those of the truth, sorted by place."""

from dataclasses import replace

import numpy as np
from fusion_rows import Mapped
from numpy.typing import NDArray
from scipy import ndimage

from glassslam.evaluation.image_cells import (
    NO_CLASS,
    OPEN,
    PANE,
    SOLID,
    classes_of,
    cut_out,
    drawn_anew,
    region_of,
)
from glassslam.geometry import inverse, transform_points
from glassslam.records import FloatArray
from glassslam.slam.result import OccupancyMap

REGIONS = ("2 cells from walls", "3 cells from glass", "free inside", "behind the long glass", "elsewhere")


def by_region(true: NDArray[np.uint8], places: FloatArray) -> list[NDArray[np.bool_]]:
    """Cells that belong to each of `REGIONS`, the first that fits."""
    x, y = places[..., 0], places[..., 1]
    wall = ndimage.distance_transform_edt(true != SOLID) < 2.3
    glass = ndimage.distance_transform_edt(true != PANE) < 3.3
    behind = (true == NO_CLASS) & (x > 3.5) & (x < 28.6) & (y > 1.2)
    masks = [wall, glass, true == OPEN, behind, np.ones(true.shape, dtype=np.bool_)]
    taken = np.zeros(true.shape, dtype=np.bool_)
    out = []
    for mask in masks:
        out.append(mask & ~taken)
        taken |= mask
    return out


def perfect_sonar_map(one: Mapped) -> OccupancyMap:
    """The truth as a map of sonars that make no mistake, in the cells of the lidar map."""
    rows, columns = one.lidar.probability.shape
    drawn = drawn_anew(
        classes_of(one.truth.grid, None, "the truth"), one.truth.grid, np.array(one.motion),
        one.lidar, np.zeros(2, dtype=np.int64), (rows, columns),
    )  # fmt: skip
    probability = np.where(drawn >= SOLID, 0.9, 0.1).astype(np.float32)
    return replace(one.lidar, probability=probability)


def compared_cells(
    one: Mapped, grid: OccupancyMap
) -> tuple[NDArray[np.uint8], NDArray[np.uint8], FloatArray]:
    """Classes of a map and of the truth in the region compared, and its places in the frame of the plan."""
    motion = np.array(one.motion)
    true_classes = classes_of(one.truth.grid, one.truth.glass, "the truth")
    low, shape = region_of(grid, one.truth.grid, true_classes, motion)
    mine = cut_out(classes_of(grid, None, "the map"), grid, low, shape)
    true = drawn_anew(true_classes, one.truth.grid, motion, grid, low, shape)
    rows, columns = np.indices(shape)
    cells = np.stack((columns + low[0], rows + low[1]), axis=-1).reshape(-1, 2) + 0.5
    places = transform_points(inverse(motion), np.asarray(grid.origin) + cells * grid.resolution)
    return mine, true, places.reshape(*shape, 2)
