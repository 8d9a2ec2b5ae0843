"""The rigid motion that lays the glass of a run onto the truth."""

import itertools
import math
from typing import Any

import numpy as np

from glassslam.evaluation.glass_lines import Segments, distances, midpoints
from glassslam.geometry import compose, inverse, transform_points, wrap_angle
from glassslam.records import FloatArray

_LONGEST = 8
_REFINED = 3
_STEP = 0.1
_WIDTHS = (0.5, 0.15, 0.05)
_CLEARLY = 1.25


def best_alignment(walls: Segments, truth: Segments) -> FloatArray:
    """Pose of the frame of the walls in that of the truth in which both cover each other best.

    Every long wall is laid onto every long pane by start, middle and end, in both directions; the best
    of these motions are refined. Corridors look alike from both ends, so a motion found from the frames as
    they are is kept unless another covers a quarter more. Where the glass does not tell, as along a single
    line, any of the equally good motions is returned.

    Parameters
    ----------
    walls, truth : ndarray of float64, shape (n, 2, 2)
        Segments, m.

    Returns
    -------
    ndarray of float64, shape (3,)
        Motion x, y, theta from the frame of the walls to that of the truth, m and rad; zero where there is
        nothing to align.
    """
    if len(walls) == 0 or len(truth) == 0:
        return np.zeros(3)
    # turning about the middle of the walls keeps turn and shift apart, which the search needs
    centre = walls.reshape(-1, 2).mean(axis=0)
    centred = walls - centre
    coarse, fine = _Cover(centred, truth, 5.0 * _STEP), _Cover(centred, truth, _STEP)
    starts = sorted(_starts(centred, truth), key=lambda motion: -coarse(motion, _WIDTHS[0]))[:_REFINED]
    near = _best(fine, [np.array([*centre, 0.0])])
    far = _best(fine, starts)
    best = far if fine(far, _WIDTHS[-1]) > _CLEARLY * fine(near, _WIDTHS[-1]) else near
    return compose(best, np.array([*-centre, 0.0]))


class _Cover:
    """Length of walls and panes that have each other near by, softly counted."""

    def __init__(self, walls: Segments, truth: Segments, step: float) -> None:
        self._walls, self._truth = walls, truth
        self._wall_points, self._wall_lengths = midpoints(walls, step)
        self.radius = max(1.0, float(np.hypot(*self._wall_points.T).max()))
        self._true_points, self._true_lengths = midpoints(truth, step)

    def __call__(self, motion: FloatArray, width: float) -> float:
        """Length covered by a motion when a distance of `width` (m) counts as 0.6 of it."""
        to_truth = distances(transform_points(motion, self._wall_points), self._truth)
        to_walls = distances(transform_points(inverse(motion), self._true_points), self._walls)
        near = self._wall_lengths @ np.exp(-0.5 * (to_truth / width) ** 2)
        return float(near + self._true_lengths @ np.exp(-0.5 * (to_walls / width) ** 2))


def _starts(walls: Segments, truth: Segments) -> list[FloatArray]:
    motions = []
    for wall, pane in itertools.product(_longest(walls), _longest(truth)):
        turn = _heading(pane) - _heading(wall)
        for angle, end in itertools.product((turn, turn + math.pi), (pane, pane[::-1])):
            motions += [
                _onto(share * wall[0] + (1 - share) * wall[1], share * end[0] + (1 - share) * end[1], angle)
                for share in (0.0, 0.5)
            ]
    return motions


def _longest(segments: Segments) -> Segments:
    lengths = np.hypot(*(segments[:, 1] - segments[:, 0]).T)
    return segments[np.argsort(-lengths, kind="stable")[:_LONGEST]]


def _heading(segment: FloatArray) -> float:
    return math.atan2(segment[1, 1] - segment[0, 1], segment[1, 0] - segment[0, 0])


def _onto(point: FloatArray, target: FloatArray, angle: float) -> FloatArray:
    """Motion that turns by an angle (rad) and takes a point to its target."""
    c, s = math.cos(angle), math.sin(angle)
    x, y = target[0] - c * point[0] + s * point[1], target[1] - s * point[0] - c * point[1]
    return np.array([x, y, float(wrap_angle(angle))])


def _best(cover: _Cover, starts: list[FloatArray]) -> FloatArray:
    """The best motion reached from any start, by a search that begins wide or narrow."""
    ends = [_refine(cover, start, _WIDTHS[k:]) for start in starts for k in range(len(_WIDTHS))]
    return max(ends, key=lambda motion: cover(motion, _WIDTHS[-1]))


def _refine(cover: _Cover, motion: FloatArray, widths: tuple[float, ...]) -> FloatArray:
    from scipy.optimize import minimize  # noqa: PLC0415  (other evaluations need not wait for it)

    for width in widths:

        def missing(trial: FloatArray, width: float = width) -> float:
            return -cover(trial, width)

        # a simplex as large as the width: the cover is flat where the glass is far from the truth
        simplex = motion + np.vstack((np.zeros(3), np.diag([width, width, width / cover.radius])))
        options: Any = {"initial_simplex": simplex, "xatol": 1e-4, "fatol": 1e-4, "maxiter": 200}
        motion = np.asarray(minimize(missing, motion, method="Nelder-Mead", options=options).x)
    return np.array([motion[0], motion[1], float(wrap_angle(motion[2]))])
