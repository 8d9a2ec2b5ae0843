"""labels.png: one colour per class of surface."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from glassslam.errors import OutputError
from glassslam.glass.layer import GlassLayer, wall_cells
from glassslam.slam.result import OccupancyMap

_OCCUPIED, _FREE = 0.65, 0.196
# blue, green, red
_COLOURS = np.array([[205, 205, 205], [255, 255, 255], [0, 0, 0], [220, 120, 0]], dtype=np.uint8)
UNKNOWN, FREE, SOLID, GLASS = 0, 1, 2, 3


def label_cells(grid: OccupancyMap, layer: GlassLayer) -> NDArray[np.uint8]:
    """Class of every cell: unknown 0, free 1, solid 2, glass 3; row 0 at the lowest y."""
    rows, columns = grid.probability.shape
    labels = np.zeros((rows, columns), dtype=np.uint8)
    labels[grid.probability < _FREE] = FREE
    labels[grid.probability > _OCCUPIED] = SOLID
    labels[wall_cells(layer.walls, (rows, columns), grid.origin, grid.resolution)] = GLASS
    return labels


def write_labels(grid: OccupancyMap, layer: GlassLayer, path: Path) -> Path:
    """Write the classes as a picture, highest y on top: grey unknown, white free, black solid, blue glass."""
    import cv2  # noqa: PLC0415  (only pictures need it)

    encoded, data = cv2.imencode(".png", _COLOURS[label_cells(grid, layer)[::-1]])
    if not encoded:
        raise OutputError(f"the map of {grid.probability.shape} cells cannot be drawn as PNG")
    path.write_bytes(data.tobytes())
    return path
