"""How much a map looks like the true map: the image metrics of pi-map, and the overlap of its classes."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glassslam.errors import EvaluationError
from glassslam.evaluation.image_alignment import Outline, best_motions
from glassslam.evaluation.image_cells import (
    NO_CLASS,
    OPEN,
    PANE,
    SOLID,
    Mask,
    classes_of,
    cut_out,
    drawn_anew,
    region_of,
)
from glassslam.outputs.map_server import FREE, OCCUPIED, OCCUPIED_THRESH, UNKNOWN
from glassslam.records import FloatArray
from glassslam.slam.result import OccupancyMap

PIMAP_UNKNOWN = 128
"""Grey of unknown cells in the images of pi-map.

Where a map is nearly its truth, half of MSE / (1 - NCC) is the variance of the truth; the last column of
Table I gives 3111 and 4940. True maps have 1200 to 1900 with 205 for unknown, and 3700 to 4800 with 128.
"""
_SSIM_WINDOW = 7


@dataclass(frozen=True, slots=True)
class ImageErrors:
    """Likeness of a map and the truth.

    Attributes
    ----------
    mse : float
        Mean square difference of the grey values 0 (occupied), 254 (free) and that of unknown cells.
    ssim : float
        Structural similarity (Wang et al. 2004), windows of 7 x 7 cells; 1 for equal maps.
    ncc : float
        Zero-mean normalised cross-correlation; 1 for equal maps.
    iou_occupied, iou_free, iou_unknown : float or None
        Cells of a class in both maps over cells of that class in either; None where neither has any.
    iou_glass : float or None
        The same for glass; None as well where a map comes without classes.
    rows, columns : int
        Size of the compared region, cells.
    resolution : float
        Edge of a cell, m.
    map_from_truth : tuple of float
        Motion x, y, theta applied to the truth, m and rad.
    """

    mse: float
    ssim: float
    ncc: float
    iou_occupied: float | None
    iou_free: float | None
    iou_unknown: float | None
    iou_glass: float | None
    rows: int
    columns: int
    resolution: float
    map_from_truth: tuple[float, float, float]


def evaluate_image(
    grid: OccupancyMap,
    truth: OccupancyMap,
    *,
    glass: Mask | None = None,
    true_glass: Mask | None = None,
    map_from_truth: tuple[float, float, float] | None = None,
    seed: int = 0,
    unknown_grey: int = UNKNOWN,
) -> ImageErrors:
    """Compare a map with the true map after laying the truth onto it (pi-map, section IV-B).

    Both are reduced to occupied, free and unknown, and the truth is drawn anew in the cells of the map. The
    region compared is the rectangle, along the axes of the map, around all that the truth knows, and
    `MARGIN` beyond: it does not depend on the map, so that no map gains by reaching far or by ending early;
    what a map does not cover is unknown.

    Parameters
    ----------
    grid, truth : OccupancyMap
        The map and the true map; they may differ in frame, size and resolution.
    glass, true_glass : ndarray of bool, shape as the map and as the truth, optional
        Which of their cells are glass.
    map_from_truth : tuple of float, optional
        Motion x, y, theta, m and rad, where it is known; searched with `align_maps` when omitted.
    seed : int
        Seed of the search.
    unknown_grey : int
        Grey value of unknown cells in the images compared, 0 to 255; 205 as map_server writes it. The figures
        of pi-map fit 128 (see `PIMAP_UNKNOWN`).

    Raises
    ------
    EvaluationError
        A map has no occupied cell, the region is smaller than a window of SSIM, or glass or grey do not fit.

    Examples
    --------
    >>> import numpy as np
    >>> from glassslam.evaluation import evaluate_image
    >>> from glassslam.slam.result import OccupancyMap
    >>> room = np.zeros((20, 30), dtype=np.float32)
    >>> room[[0, -1]] = room[:, [0, -1]] = 1.0
    >>> errors = evaluate_image(OccupancyMap(room, 0.1, (0, 0)), OccupancyMap(room, 0.1, (0, 0)))
    >>> errors.mse, round(errors.ssim, 9), round(errors.ncc, 9)
    (0.0, 1.0, 1.0)
    """
    classes, true_classes = classes_of(grid, glass, "the map"), classes_of(truth, true_glass, "the truth")
    motion = np.array(map_from_truth or align_maps(grid, truth, seed=seed), dtype=np.float64)
    low, shape = region_of(grid, truth, true_classes, motion)
    mine = cut_out(classes, grid, low, shape)
    true = drawn_anew(true_classes, truth, motion, grid, low, shape)
    if min(shape) < _SSIM_WINDOW:
        raise EvaluationError(f"the truth covers {shape[1]} x {shape[0]} cells", "SSIM needs 7 x 7 cells")
    if not 0 <= unknown_grey <= 255:
        raise EvaluationError(f"no grey value is {unknown_grey}", "unknown_grey lies between 0 and 255")
    greys = np.array([unknown_grey, FREE, OCCUPIED, OCCUPIED], dtype=np.uint8)
    return ImageErrors(
        **_image_metrics(greys[mine], greys[true]),
        iou_occupied=_iou(mine >= SOLID, true >= SOLID),
        iou_free=_iou(mine == OPEN, true == OPEN),
        iou_unknown=_iou(mine == NO_CLASS, true == NO_CLASS),
        iou_glass=None if glass is None or true_glass is None else _iou(mine == PANE, true == PANE),
        rows=shape[0],
        columns=shape[1],
        resolution=grid.resolution,
        map_from_truth=(float(motion[0]), float(motion[1]), float(motion[2])),
    )


def align_maps(grid: OccupancyMap, truth: OccupancyMap, *, seed: int = 0) -> tuple[float, float, float]:
    """Motion x, y, theta (m, rad) that lays the truth onto the map.

    Among the motions under which the walls meet (see `best_motions`), it is the one under which most cells
    that are known in both maps agree: rooms that look alike from two sides differ in what is free.

    Raises
    ------
    EvaluationError
        A map has no occupied cell.
    """
    outlines = [_outline(part, name) for part, name in ((grid, "the map"), (truth, "the truth"))]
    motions = best_motions(outlines[0], outlines[1], seed)
    best = max(motions, key=lambda motion: agreement(grid, truth, motion))
    return float(best[0]), float(best[1]), float(best[2])


def agreement(grid: OccupancyMap, truth: OccupancyMap, map_from_truth: FloatArray) -> float:
    """Overlap of what is free plus overlap of what is occupied, between 0 and 2, on the cells of the map."""
    classes = classes_of(grid, None, "the map")
    true = drawn_anew(
        classes_of(truth, None, "the truth"),
        truth,
        map_from_truth,
        grid,
        np.zeros(2, dtype=np.int64),
        classes.shape,
    )
    shares = [_iou(classes == kind, true == kind) or 0.0 for kind in (OPEN, SOLID)]
    return sum(shares)


def normalised_cross_correlation(a: NDArray[np.uint8], b: NDArray[np.uint8]) -> float:
    """Zero-mean normalised cross-correlation of two images of one size, between -1 and 1.

    sum (a - mean a)(b - mean b) / sqrt(sum (a - mean a)^2 sum (b - mean b)^2). The MSE and NCC of Table I of
    pi-map fit each other in this form and in no other. An image of one grey correlates with nothing: 1 for
    equal images, else 0.

    Examples
    --------
    >>> import numpy as np
    >>> from glassslam.evaluation.image import normalised_cross_correlation
    >>> a = np.array([[0, 254], [254, 0]], dtype=np.uint8)
    >>> normalised_cross_correlation(a, 254 - a)
    -1.0
    """
    if np.array_equal(a, b):
        return 1.0
    x, y = a.astype(np.float64) - a.mean(), b.astype(np.float64) - b.mean()
    scale = float(np.sqrt((x * x).sum() * (y * y).sum()))
    return float((x * y).sum()) / scale if scale > 0.0 else 0.0


def _image_metrics(mine: NDArray[np.uint8], true: NDArray[np.uint8]) -> dict[str, float]:
    from skimage.metrics import structural_similarity  # noqa: PLC0415  (slow to import)

    ssim = structural_similarity(  # type: ignore[no-untyped-call]
        true, mine, win_size=_SSIM_WINDOW, data_range=255
    )
    difference = mine.astype(np.float64) - true
    return {
        "mse": float((difference**2).mean()),
        "ssim": float(ssim),
        "ncc": normalised_cross_correlation(mine, true),
    }


def _outline(grid: OccupancyMap, name: str) -> Outline:
    occupied = grid.probability > OCCUPIED_THRESH
    if not occupied.any():
        raise EvaluationError(f"{name} has no occupied cell", "there is nothing to align")
    return Outline.of(occupied, grid.origin, grid.resolution)


def _iou(a: Mask, b: Mask) -> float | None:
    either = int((a | b).sum())
    return float((a & b).sum() / either) if either else None
