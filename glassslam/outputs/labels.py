"""labels.png: one colour per class of surface."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from glassslam.errors import OutputError
from glassslam.glass.layer import GlassLayer, wall_cells
from glassslam.outputs.image_file import read_image
from glassslam.slam.result import OccupancyMap

_OCCUPIED, _FREE = 0.65, 0.196
# blue, green, red
_COLOURS = np.array(
    [[205, 205, 205], [255, 255, 255], [0, 0, 0], [220, 120, 0], [80, 170, 255]], dtype=np.uint8
)
UNKNOWN, FREE, SOLID, GLASS, GHOST = range(5)


def label_cells(grid: OccupancyMap, layer: GlassLayer) -> NDArray[np.uint8]:
    """Class of every cell: unknown 0, free 1, solid 2, glass 3, ghost 4; row 0 at the lowest y.

    A ghost is what only beams through glass, or mirrored by it, have met.
    """
    rows, columns = grid.probability.shape
    labels = np.zeros((rows, columns), dtype=np.uint8)
    labels[grid.probability < _FREE] = FREE
    labels[grid.probability > _OCCUPIED] = SOLID
    index = np.floor((layer.ghost_cells - np.asarray(grid.origin)) / grid.resolution).astype(np.int64)
    behind = labels[index[:, 1], index[:, 0]] != FREE
    labels[index[behind, 1], index[behind, 0]] = GHOST
    labels[wall_cells(layer.walls, (rows, columns), grid.origin, grid.resolution)] = GLASS
    return labels


def write_labels(grid: OccupancyMap, layer: GlassLayer, path: Path) -> Path:
    """Write the classes as a picture, highest y on top.

    Unknown cells are grey, free ones white, solid ones black, glass blue, ghosts orange.
    """
    return write_label_image(label_cells(grid, layer), path)


def write_label_image(labels: NDArray[np.uint8], path: Path) -> Path:
    """Write classes (row 0 at the lowest y) in the colours of `write_labels`."""
    import cv2  # noqa: PLC0415  (only pictures need it)

    encoded, data = cv2.imencode(".png", _COLOURS[labels[::-1]])
    if not encoded:
        raise OutputError(f"the map of {labels.shape} cells cannot be drawn as PNG")
    path.write_bytes(data.tobytes())
    return path


def read_labels(path: Path) -> NDArray[np.uint8]:
    """Classes (row 0 at the lowest y) of a picture written by `write_labels`.

    Raises
    ------
    OutputError
        The file cannot be read, is no picture, or shows other colours.
    """
    image = read_image(path, colour=True)
    labels = np.full(image.shape[:2], 255, dtype=np.uint8)
    for label, colour in enumerate(_COLOURS):
        labels[(image == colour).all(axis=2)] = label
    if (labels == 255).any():
        raise OutputError(f"{path} shows other colours than those of labels.png")
    return labels[::-1].copy()
