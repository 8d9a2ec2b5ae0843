"""Pictures of a volume: from above, coloured by height, and horizontal slices."""

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glassslam.errors import OutputError
from glassslam.records import Float32Array
from glassslam.slam.result import OccupancyMap
from glassslam.volume.colours import height_colours
from glassslam.volume.octree import CENTRE, Octree
from glassslam.volume.projection import Band, project, project_bands, top_heights

Image = NDArray[np.uint8]

_LARGEST_ZOOM, _READABLE, _READABLE_SLICE = 8, 900, 330
_MOST_SLICES, _LARGEST_SLICE = 12, 1000
_EMPTY = ("the volume is empty", "was there any echo, and a pose for it?")
_STRIP, _MARGIN, _GAP = 48, 12, 10
# blue, green, red: the order of OpenCV
_INK, _PAPER, _UNKNOWN, _FREE = (40, 40, 40), (255, 255, 255), (225, 225, 225), (255, 255, 255)
_SHADES = np.array([_UNKNOWN[0], _FREE[0], 0], dtype=np.uint8)


def write_top_view(tree: Octree, path: str | Path, band: Band | None = None) -> Path:
    """Draw the highest occupied voxel of every column in the colour of its height, as PNG.

    Columns that are free wherever they are known are white, unknown ones grey; a colour bar and a scale
    bar stand below.

    Parameters
    ----------
    tree : Octree
        The volume.
    path : str or Path
        The file to write.
    band : tuple of float, optional
        Only voxels whose centre lies between these heights, m.

    Raises
    ------
    OutputError
        The volume is empty, or too large for a PNG.
    OSError
        The file cannot be written.
    """
    occupied = tree.occupied().voxels()
    z = tree.centres(occupied)[:, 2]
    if band is not None:
        inside = (z >= band[0]) & (z <= band[1])
        occupied, z = occupied.where(inside), z[inside]
    low, high = tree.bounds()
    tops, _ = top_heights(tree, occupied)
    _check_size(tops)
    span = band or (float(low[2]), float(high[2]))
    known = ~np.isnan(project(tree, span).probability)
    if len(occupied):
        span = float(np.nanmin(tops)), float(np.nanmax(tops))
    zoom = _zoom(tops.shape, _READABLE)
    canvas = _framed(_enlarged(_coloured(tops, known, span), zoom))
    _draw_legend(canvas, zoom / tree.resolution, span)
    return _save(canvas, path)


def write_slices(tree: Octree, path: str | Path, band: Band | None = None) -> Path:
    """Draw horizontal slices side by side, as PNG: black occupied, white free, grey unknown.

    There are at most twelve: layers between which nothing is occupied are left out, the others are drawn
    singly or, where there are too many, in bands of equal height that show their most occupied voxel. Where
    nothing is occupied at all, one slice shows what is free. Large slices are drawn smaller: a pixel is
    occupied where anything in it is.

    Parameters
    ----------
    tree : Octree
        The volume.
    path : str or Path
        The file to write.
    band : tuple of float, optional
        Lowest and highest z drawn, m; all that is occupied when left out.

    Raises
    ------
    OutputError
        The volume is empty, or too large for a PNG.
    OSError
        The file cannot be written.
    """
    low, high = tree.bounds()
    if not low[2] < high[2]:
        raise OutputError(*_EMPTY)
    whole = band or (float(low[2]), float(high[2]))
    bands = slice_bands(tree, band) or [whole]
    grids = project_bands(tree, bands)
    panels = [_panel(grid, part, tree.clamp.threshold) for grid, part in zip(grids, bands, strict=True)]
    columns = math.ceil(math.sqrt(len(panels)))
    blank = np.full_like(panels[0], 255)
    panels += [blank] * (-len(panels) % columns)
    rows = [np.hstack(panels[k : k + columns]) for k in range(0, len(panels), columns)]
    return _save(np.vstack(rows), path)


def slice_bands(tree: Octree, band: Band | None = None) -> list[Band]:
    """Heights at which a volume is cut: where something is occupied, at most twelve, bottom first."""
    occupied = tree.occupied().voxels()
    layers = np.unique(occupied.keys[:, 2]) - CENTRE
    heights = (layers + 0.5) * tree.resolution
    if band is not None:
        layers = layers[(heights >= band[0]) & (heights <= band[1])]
    if layers.size == 0:
        return []
    thick = math.ceil((layers[-1] + 1 - layers[0]) / _MOST_SLICES) if layers.size > _MOST_SLICES else 1
    starts = np.unique(layers[0] + (layers - layers[0]) // thick * thick)
    return [(float(k * tree.resolution), float((k + thick) * tree.resolution)) for k in starts]


def _panel(grid: OccupancyMap, part: Band, threshold: float) -> Image:
    known = np.zeros(grid.probability.shape, dtype=np.uint8)
    known[grid.probability < threshold] = 1
    known[grid.probability >= threshold] = 2
    shade = _SHADES[_shrunk(known, math.ceil(max(known.shape) / _LARGEST_SLICE))]
    picture = _enlarged(np.repeat(shade[::-1, :, None], 3, axis=2), _zoom(shade.shape, _READABLE_SLICE))
    framed = _bordered(picture, top=22, side=_GAP // 2)
    _write_text(framed, f"z {part[0]:.2f} to {part[1]:.2f} m", (_GAP // 2, 15))
    return framed


def _coloured(tops: Float32Array, known: NDArray[np.bool_], span: Band) -> Image:
    """Picture (rows, columns, 3), highest y on top."""
    picture = np.full((*tops.shape, 3), _UNKNOWN, dtype=np.uint8)
    picture[known] = _FREE
    filled = ~np.isnan(tops)
    picture[filled] = height_colours(tops[filled], *span)[:, ::-1]
    return picture[::-1]


def _draw_legend(canvas: Image, pixels_per_metre: float, span: Band) -> None:
    """Scale bar on the left, colour bar with the heights on the right."""
    import cv2  # noqa: PLC0415  (only pictures need it)

    height, width = canvas.shape[:2]
    base = height - _MARGIN
    length = _round_length(0.3 * width / pixels_per_metre)
    right = _MARGIN + round(length * pixels_per_metre)
    cv2.rectangle(canvas, (_MARGIN, base - 4), (right, base), _INK, -1)
    _write_text(canvas, f"{length:g} m", (_MARGIN, base - 10))
    shown = np.linspace(*span, max(width // 3, 2))[None, :]
    ramp = height_colours(shown, *span)[:, :, ::-1]
    left = width - _MARGIN - ramp.shape[1]
    canvas[base - 8 : base + 1, left : left + ramp.shape[1]] = ramp
    _write_text(canvas, f"{span[0]:.2f}", (left, base - 12))
    _write_text(canvas, f"{span[1]:.2f} m", (max(left + ramp.shape[1] - 58, left + 44), base - 12))


def _round_length(longest: float) -> float:
    """The largest of 1, 2, 5, 10, 20 ... that does not exceed a length."""
    power = 10.0 ** math.floor(math.log10(longest))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= longest * (1.0 + 1e-9))


def _shrunk(cells: Image, factor: int) -> Image:
    """The largest value of every square of cells, those at the far ends filled up with 0."""
    if factor == 1:
        return cells
    rows, columns = (-(-side // factor) for side in cells.shape)
    padded = np.zeros((rows * factor, columns * factor), dtype=np.uint8)
    padded[: cells.shape[0], : cells.shape[1]] = cells
    return np.asarray(padded.reshape(rows, factor, columns, factor).max(axis=(1, 3)))


def _check_size(cells: Float32Array) -> None:
    if cells.size == 0:
        raise OutputError(*_EMPTY)


def _zoom(shape: tuple[int, ...], readable: int) -> int:
    return min(_LARGEST_ZOOM, max(1, readable // max(shape[:2])))


def _enlarged(picture: Image, zoom: int) -> Image:
    return np.ascontiguousarray(picture.repeat(zoom, axis=0).repeat(zoom, axis=1))


def _framed(picture: Image) -> Image:
    """The picture with a strip below for the legend, wide enough for its words."""
    missing = max(0, 320 - picture.shape[1])
    return np.pad(picture, ((0, _STRIP), (0, missing), (0, 0)), constant_values=_PAPER[0])


def _bordered(picture: Image, top: int, side: int) -> Image:
    missing = max(0, 150 - picture.shape[1])
    return np.pad(picture, ((top, side), (side, side + missing), (0, 0)), constant_values=_PAPER[0])


def _write_text(canvas: Image, text: str, place: tuple[int, int]) -> None:
    import cv2  # noqa: PLC0415

    cv2.putText(canvas, text, place, cv2.FONT_HERSHEY_SIMPLEX, 0.42, _INK, 1, cv2.LINE_AA)


def _save(canvas: Image, path: str | Path) -> Path:
    import cv2  # noqa: PLC0415

    encoder: Any = cv2.imencode
    encoded, data = encoder(".png", canvas)
    if not encoded:
        raise OutputError(f"a volume of {canvas.shape} pixels cannot be drawn as PNG")
    target = Path(path)
    target.write_bytes(data.tobytes())
    return target
