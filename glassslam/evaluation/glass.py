"""How much of the true glass a run has found, and how much it has made up."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

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
