"""The map as a picture: grey-level probabilities, the trajectory, a scale bar."""

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glassslam.errors import GridError, OutputError
from glassslam.glass.layer import GlassLayer
from glassslam.records import Float32Array, FloatArray, Trajectory
from glassslam.slam.result import OccupancyMap

_READABLE, _LARGEST_ZOOM = 900, 4
_UNKNOWN_GREY = 205.0
_ROWS_AT_ONCE = 256
_STRIP, _MARGIN = 44, 12
# Colours are blue, green, red: the order of OpenCV.
_PATH, _START, _END, _INK = (214, 98, 20), (60, 160, 30), (40, 40, 220), (40, 40, 40)
_GLASS = (170, 190, 0)

Image = NDArray[np.uint8]


def grey_levels(probability: Float32Array) -> Image:
    """Grey of every cell: white at P <= 0.1, black at P >= 0.9; 0.5 and never observed share one grey.

    Parameters
    ----------
    probability : ndarray of float32, shape (rows, columns)
        P(occupied); NaN where never observed.

    Returns
    -------
    ndarray of uint8, shape (rows, columns)
        Grey levels, in the order of the rows given.
    """
    shades = np.rint(np.interp(np.linspace(0.0, 1.0, 251), (0.1, 0.5, 0.9), (255.0, _UNKNOWN_GREY, 0.0)))
    table, grey = shades.astype(np.uint8), np.empty(probability.shape, dtype=np.uint8)
    # A block of rows at a time: a large map must not cost several more of its size in floats.
    for first in range(0, probability.shape[0], _ROWS_AT_ONCE):
        rows = slice(first, first + _ROWS_AT_ONCE)
        level = np.nan_to_num(probability[rows], nan=0.5) * np.float32(250.0)
        grey[rows] = table[np.rint(level).astype(np.uint8)]
    return grey


def write_picture(
    grid: OccupancyMap, trajectory: Trajectory, path: str | Path, glass: GlassLayer | None = None
) -> Path:
    """Draw the map with the trajectory, its start (green), its end (red) and a scale bar, as PNG.

    Parameters
    ----------
    grid : OccupancyMap
        The map; small maps are enlarged by a whole factor.
    trajectory : Trajectory
        Poses in the map frame.
    path : str or Path
        The PNG file to write.
    glass : GlassLayer, optional
        Its walls are drawn in blue-green.

    Returns
    -------
    Path
        The file written.

    Raises
    ------
    GridError
        The map has no cells.
    OutputError
        It is too large for a PNG.
    OSError
        The file cannot be written.
    """
    import cv2  # noqa: PLC0415  (only pictures need it)

    if grid.probability.size == 0:
        raise GridError("the map has no cells", "was there any scan with a range in it?")
    zoom = min(_LARGEST_ZOOM, max(1, math.ceil(_READABLE / max(grid.probability.shape))))
    canvas = _blank(cv2, grid, zoom)
    if glass is not None:
        _draw_walls(cv2, canvas[:-_STRIP], grid, glass, zoom)
    _draw_path(cv2, canvas[:-_STRIP], path_pixels(grid, trajectory.poses, zoom))
    _draw_scale(cv2, canvas, pixels_per_metre=zoom / grid.resolution)
    encoded, data = cv2.imencode(".png", canvas)
    if not encoded:
        raise OutputError(f"the map of {grid.probability.shape} cells cannot be drawn as PNG")
    target = Path(path)
    target.write_bytes(data.tobytes())
    return target


def path_pixels(grid: OccupancyMap, poses: FloatArray, zoom: int = 1) -> FloatArray:
    """Image coordinates (column, row) of poses, shape (n, 2); whole numbers are centres of pixels.

    Parameters
    ----------
    grid : OccupancyMap
        The map that is drawn, row 0 of the image at its highest y.
    poses : ndarray of float64, shape (n, 3)
        Poses in the map frame, m and rad.
    zoom : int
        Pixels per cell.
    """
    scale = zoom / grid.resolution
    column = (poses[:, 0] - grid.origin[0]) * scale - 0.5
    row = grid.probability.shape[0] * zoom - (poses[:, 1] - grid.origin[1]) * scale - 0.5
    return np.stack((column, row), axis=1)


def scale_bar_length(longest: float) -> float:
    """The largest of 1, 2, 5, 10, 20 ... that does not exceed `longest`, m."""
    power = 10.0 ** math.floor(math.log10(longest))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= longest * (1.0 + 1e-9))


def _blank(cv2: Any, grid: OccupancyMap, zoom: int) -> Image:
    grey = grey_levels(grid.probability)[::-1]
    if zoom > 1:
        grey = cv2.resize(grey, None, fx=zoom, fy=zoom, interpolation=cv2.INTER_NEAREST)
    grey = cv2.copyMakeBorder(grey, 0, _STRIP, 0, 0, cv2.BORDER_CONSTANT, value=255)
    return np.asarray(cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR))


def _draw_path(cv2: Any, canvas: Image, pixels: FloatArray) -> None:
    if not len(pixels):
        return
    # OpenCV takes sixteenths of a pixel as integers.
    points = np.rint(pixels * 16.0).astype(np.int32)
    cv2.polylines(canvas, [points], False, _PATH, 1, cv2.LINE_AA, shift=4)
    for point, colour in ((points[0], _START), (points[-1], _END)):
        cv2.circle(canvas, (int(point[0]), int(point[1])), 5 * 16, colour, -1, cv2.LINE_AA, shift=4)


def _draw_walls(cv2: Any, canvas: Image, grid: OccupancyMap, glass: GlassLayer, zoom: int) -> None:
    for wall in glass.walls:
        ends = path_pixels(grid, np.stack((wall.start, wall.end)), zoom)
        first, last = (tuple(int(v) for v in np.rint(end * 16.0)) for end in ends)
        cv2.line(canvas, first, last, _GLASS, 2 if zoom < 3 else 4, cv2.LINE_AA, shift=4)


def _draw_scale(cv2: Any, canvas: Image, pixels_per_metre: float) -> None:
    height, width = canvas.shape[:2]
    length = scale_bar_length(max(width / 4.0, 1.0) / pixels_per_metre)
    base, right = height - _MARGIN, _MARGIN + round(length * pixels_per_metre)
    cv2.rectangle(canvas, (_MARGIN, base - 4), (right, base), _INK, -1)
    cv2.putText(
        canvas, f"{length:g} m", (_MARGIN, base - 10), cv2.FONT_HERSHEY_SIMPLEX, 0.5, _INK, 1, cv2.LINE_AA
    )
