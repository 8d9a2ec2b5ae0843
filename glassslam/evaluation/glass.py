"""How much of the true glass a run has found, and how much it has made up."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from glassslam.evaluation.cell_lines import drawn_length
from glassslam.evaluation.glass_alignment import best_alignment
from glassslam.evaluation.glass_lines import Segments, distances, midpoints
from glassslam.geometry import transform_points
from glassslam.records import FloatArray

TOLERANCES = (0.10, 0.15, 0.25)
"""Distances within which glass counts as found, m."""

_STEP = 0.01
_MOSTLY = 0.5


@dataclass(frozen=True, slots=True)
class GlassWithin:
    """Agreement of glass and truth within one tolerance.

    Attributes
    ----------
    tolerance : float
        Largest distance that counts as agreement, m.
    found, found_percent : float
        Length of true glass with a wall that near, m, and its share of all true glass; the share is None
        where there is no true glass.
    panes_found : int
        True panes found for at least half of their length.
    false : float
        Length of walls without true glass that near, m.
    """

    tolerance: float
    found: float
    found_percent: float | None
    panes_found: int
    false: float


@dataclass(frozen=True, slots=True)
class GlassErrors:
    """Agreement of the glass of a run with the truth.

    Attributes
    ----------
    panes, walls : int
        Number of true panes, and of walls the run has found.
    true_length, wall_length : float
        Their lengths, m.
    false_length : float
        Length of walls farther than the largest tolerance from all true glass, m.
    within : tuple of GlassWithin
        By tolerance, the smallest first.
    true_from_map : tuple of float, or None
        Alignment (x, y, theta) applied to the walls before the comparison, m and rad.
    """

    panes: int
    walls: int
    true_length: float
    wall_length: float
    false_length: float
    within: tuple[GlassWithin, ...]
    true_from_map: tuple[float, float, float] | None


def evaluate_glass(
    walls: Sequence[Segments],
    truth: Sequence[Segments],
    *,
    align: bool = False,
    tolerances: Sequence[float] = TOLERANCES,
) -> GlassErrors:
    """Compare walls with true panes, by points every centimetre along both.

    Parameters
    ----------
    walls, truth : sequence of ndarray of float64, shape (n, 2, 2)
        Segments of every wall and of every pane, m; see `read_glass_walls` and `read_true_glass`.
    align : bool
        Move the walls rigidly to where they agree best with the truth, for a truth in another frame. It
        hides a displacement of the whole map; what it has moved is part of the result.
    tolerances : sequence of float
        Distances within which glass counts as found, m.

    Examples
    --------
    >>> import numpy as np
    >>> from glassslam.evaluation import evaluate_glass
    >>> pane = np.array([[[0.0, 0.0], [2.0, 0.0]]])
    >>> wall = np.array([[[0.0, 0.05], [1.0, 0.05]]])
    >>> round(evaluate_glass([wall], [pane]).within[0].found, 2)
    1.09
    """
    moved = _joined(walls)
    motion = best_alignment(moved, _joined(truth)) if align else None
    if motion is not None:
        moved = transform_points(motion, moved.reshape(-1, 2)).reshape(-1, 2, 2)
    points, lengths = midpoints(moved, _STEP)
    gaps = distances(points, _joined(truth))
    panes = [_sampled(pane, moved) for pane in truth]
    limits = sorted(tolerances)
    return GlassErrors(
        panes=len(truth),
        walls=len(walls),
        true_length=float(sum(pieces.sum() for _, pieces in panes)),
        wall_length=float(lengths.sum()),
        false_length=float(lengths[gaps > limits[-1]].sum()),
        within=tuple(_within(limit, panes, float(lengths[gaps > limit].sum())) for limit in limits),
        true_from_map=None if motion is None else (float(motion[0]), float(motion[1]), float(motion[2])),
    )


@dataclass(frozen=True, slots=True)
class CellsWithin:
    """Length of true glass that has a cell within a tolerance, m, and its share; None without true glass."""

    tolerance: float
    found: float
    found_percent: float | None


@dataclass(frozen=True, slots=True)
class GlassCellErrors:
    """Agreement of the glass cells of a map with the truth.

    Attributes
    ----------
    cells : int
        Cells of the map that are glass.
    true_length : float
        Length of the true glass, m.
    within : tuple of CellsWithin
        By tolerance, the smallest first.
    false_cells : int
        Cells farther than the largest tolerance from all true glass.
    false_length : float
        Length of the lines that these make, m.
    """

    cells: int
    true_length: float
    within: tuple[CellsWithin, ...]
    false_cells: int
    false_length: float


def evaluate_glass_cells(
    cells: FloatArray,
    truth: Sequence[Segments],
    *,
    resolution: float,
    true_from_map: FloatArray | None = None,
    tolerances: Sequence[float] = TOLERANCES,
) -> GlassCellErrors:
    """Compare the glass cells of a map with true panes, as Table II of Weerakoon et al. 2021 does.

    A piece of a centimetre of true glass is detected when the centre of a cell is within the tolerance.
    What is false is a length as well, so that thick lines do not count more than thin ones: that of the lines
    false cells draw, in whatever direction (see `cell_lines.drawn_length`).

    Parameters
    ----------
    cells : ndarray of float64, shape (k, 2)
        Centres of the cells, map frame, m.
    truth : sequence of ndarray of float64, shape (n, 2, 2)
        Segments of every true pane, m.
    resolution : float
        Cell edge, m.
    true_from_map : ndarray of float64, shape (3,), optional
        Pose of the map in the frame of the truth, m and rad; both are the same when left out.
    tolerances : sequence of float
        Distances within which glass counts as detected, m.

    Examples
    --------
    >>> import numpy as np
    >>> from glassslam.evaluation import evaluate_glass_cells
    >>> pane = np.array([[[0.0, 0.0], [1.0, 0.0]]])
    >>> cells = np.column_stack((np.arange(0.025, 1.0, 0.05), np.full(20, 0.025)))
    >>> errors = evaluate_glass_cells(cells, [pane], resolution=0.05)
    >>> round(errors.within[0].found, 2), errors.false_length
    (1.0, 0.0)
    """
    limits = sorted(tolerances)
    placed = cells if true_from_map is None else transform_points(true_from_map, cells)
    points, lengths = midpoints(_joined(truth), _STEP)
    gaps = cKDTree(placed).query(points)[0] if len(placed) else np.full(len(points), np.inf)
    wrong = distances(placed, _joined(truth)) > limits[-1]
    total = float(lengths.sum())
    found = [float(lengths[gaps <= limit].sum()) for limit in limits]
    percent = [100.0 * part / total if total > 0.0 else None for part in found]
    return GlassCellErrors(
        cells=len(cells),
        true_length=total,
        within=tuple(CellsWithin(*row) for row in zip(limits, found, percent, strict=True)),
        false_cells=int(wrong.sum()),
        false_length=drawn_length(cells[wrong], resolution),
    )


def _joined(lines: Sequence[Segments]) -> Segments:
    return np.concatenate([np.empty((0, 2, 2)), *lines])


def _sampled(pane: Segments, walls: Segments) -> tuple[FloatArray, FloatArray]:
    """Distances of the pieces of a pane from the walls, and their lengths, m."""
    points, lengths = midpoints(pane, _STEP)
    return distances(points, walls), lengths


def _within(limit: float, panes: Sequence[tuple[FloatArray, FloatArray]], false: float) -> GlassWithin:
    found = [float(lengths[gaps <= limit].sum()) for gaps, lengths in panes]
    total = [float(lengths.sum()) for _, lengths in panes]
    mostly = sum(part >= _MOSTLY * whole for part, whole in zip(found, total, strict=True))
    percent = 100.0 * sum(found) / sum(total) if sum(total) > 0.0 else None
    return GlassWithin(limit, sum(found), percent, mostly, false)
