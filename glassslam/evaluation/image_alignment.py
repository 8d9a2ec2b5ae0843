"""The rigid motion that lays a true map onto a map."""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from glassslam.evaluation import image_kernels as kernels
from glassslam.geometry import compose, inverse, wrap_angle
from glassslam.records import FloatArray

_HYPOTHESES = 20_000
_SCORED = 400
_REFINED_WITH = 4000
_CANDIDATES = 6
_COARSE = 0.3
_WIDTHS = (0.3, 0.1, 0.05, 0.025)
_APART = (0.3, 0.05)
_SMOOTHING = 1.5


@dataclass(frozen=True, slots=True)
class Outline:
    """The occupied cells of a map as points, and how far every place is from them.

    Attributes
    ----------
    points : ndarray of float64, shape (n, 2)
        Centres of the occupied cells, m.
    headings : ndarray of float64, shape (n,)
        Direction of the line each cell belongs to, modulo pi, rad.
    distances : ndarray of float64, shape (rows, columns)
        Distance of every cell from the nearest occupied one, m.
    low : ndarray of float64, shape (2,)
        Lower left corner of the cells, m.
    cell : float
        Edge of a cell, m.
    """

    points: FloatArray
    headings: FloatArray
    distances: FloatArray
    low: FloatArray
    cell: float

    @classmethod
    def of(cls, occupied: NDArray[np.bool_], origin: tuple[float, float], cell: float) -> Self:
        """Prepare occupied cells, shape (rows, columns), row 0 at the lowest y."""
        from scipy import ndimage  # noqa: PLC0415  (other evaluations need not wait for it)

        # a frame of empty cells: places off the map shall be far from its walls, not on its border
        pad = int(np.ceil(3.0 * _COARSE / cell))
        grid = np.pad(occupied, pad)
        low = np.asarray(origin) - pad * cell
        blurred = ndimage.gaussian_filter(grid.astype(np.float64), _SMOOTHING)
        dy, dx = np.gradient(blurred)
        tensor = [ndimage.gaussian_filter(part, _SMOOTHING) for part in (dx * dx, dx * dy, dy * dy)]
        rows, columns = np.nonzero(grid)
        xx, xy, yy = (part[rows, columns] for part in tensor)
        points = low + (np.stack((columns, rows), axis=1) + 0.5) * cell
        headings = 0.5 * np.arctan2(2.0 * xy, xx - yy) + 0.5 * np.pi
        distances = cell * np.asarray(ndimage.distance_transform_edt(~grid), dtype=np.float64)
        return cls(points, headings, distances, low, cell)

    def thinned(self, count: int, random: np.random.Generator) -> FloatArray:
        """At most so many of the points, chosen by chance."""
        if len(self.points) <= count:
            return self.points
        return self.points[np.sort(random.choice(len(self.points), count, replace=False))]


def best_motions(map_outline: Outline, true_outline: Outline, seed: int = 0) -> list[FloatArray]:
    """Motions from the frame of the truth to that of the map under which the walls of both meet, best first.

    RANSAC (Fischler and Bolles 1981) as in the evaluation of pi-map: a hypothesis lays one occupied cell of
    the truth onto one of the map so that their lines run alike, in either direction. The best that differ,
    and the frames as they are, are refined until the walls lie on each other; walls count in both directions,
    those of the truth on the map and those of the map on the truth.

    Parameters
    ----------
    map_outline, true_outline : Outline
        Walls of both maps.
    seed : int
        Same seed, same motions.

    Returns
    -------
    list of ndarray of float64, shape (3,)
        x, y, theta, m and rad.
    """
    random = np.random.default_rng(seed)
    motions = _hypotheses(map_outline, true_outline, random)
    quick = _Overlay(map_outline, true_outline, _SCORED, random)
    starts = _distinct(motions, quick.of_all(motions, _COARSE), quick.radius)
    overlay = _Overlay(map_outline, true_outline, _REFINED_WITH, random)
    refined = [overlay.refine(start) for start in (np.zeros(3), *starts)]
    return sorted(refined, key=lambda motion: -overlay(motion, _WIDTHS[-1]))


class _Overlay:
    """How well the walls of two maps lie on each other under a motion."""

    def __init__(self, map_outline: Outline, true_outline: Outline, count: int, random: Any) -> None:
        self._map, self._truth = map_outline, true_outline
        self._map_points = map_outline.thinned(count, random)
        self._true_points = true_outline.thinned(count, random)
        self._centre = np.append(true_outline.points.mean(axis=0), 0.0)
        self.radius = max(1.0, float(np.hypot(*(true_outline.points - self._centre[:2]).T).max()))

    def __call__(self, motion: FloatArray, width: float) -> float:
        """Between 0 and 2 for a motion, when a distance of `width` (m) counts as 0.6."""
        a, b = self._map, self._truth
        there = kernels.closeness(motion, self._true_points, a.distances, a.low, a.cell, width)
        back = kernels.closeness(inverse(motion), self._map_points, b.distances, b.low, b.cell, width)
        return there + back

    def of_all(self, motions: FloatArray, width: float) -> FloatArray:
        """The same for motions (m, 3)."""
        a, b = self._map, self._truth
        out = np.zeros(len(motions))
        kernels.closeness_of_all(motions, self._true_points, a.distances, a.low, a.cell, width, out)
        kernels.closeness_of_all(inverse(motions), self._map_points, b.distances, b.low, b.cell, width, out)
        return out

    def refine(self, motion: FloatArray) -> FloatArray:
        """The best motion near by, searched with narrowing widths about the middle of the truth."""
        from scipy.optimize import minimize  # noqa: PLC0415

        turned = compose(motion, self._centre)
        for width in _WIDTHS:

            def missing(trial: FloatArray, width: float = width) -> float:
                return -self(compose(trial, inverse(self._centre)), width)

            # turning about the middle keeps turn and shift apart; the simplex is as large as the width
            simplex = turned + np.vstack((np.zeros(3), np.diag([width, width, width / self.radius])))
            options: Any = {"initial_simplex": simplex, "xatol": 1e-4, "fatol": 1e-6, "maxiter": 200}
            turned = np.asarray(minimize(missing, turned, method="Nelder-Mead", options=options).x)
        return compose(turned, inverse(self._centre))


def _hypotheses(map_outline: Outline, true_outline: Outline, random: np.random.Generator) -> FloatArray:
    """Motions (m, 3), each from one pair of cells."""
    mine = random.integers(len(map_outline.points), size=_HYPOTHESES)
    true = random.integers(len(true_outline.points), size=_HYPOTHESES)
    turn = map_outline.headings[mine] - true_outline.headings[true]
    theta = np.concatenate((turn, turn + np.pi))
    c, s = np.cos(theta), np.sin(theta)
    target = np.tile(map_outline.points[mine], (2, 1))
    x, y = np.tile(true_outline.points[true], (2, 1)).T
    motions = (target[:, 0] - c * x + s * y, target[:, 1] - s * x - c * y, wrap_angle(theta))
    return np.ascontiguousarray(np.stack(motions, axis=1))


def _distinct(motions: FloatArray, scores: FloatArray, radius: float) -> list[FloatArray]:
    """The best motions of which no two are nearly the same."""
    chosen: list[FloatArray] = []
    for k in np.argsort(-scores, kind="stable")[: 50 * _CANDIDATES]:
        near = [
            np.hypot(*(motions[k, :2] - other[:2])) < _APART[0] * max(1.0, 0.1 * radius)
            and abs(float(wrap_angle(motions[k, 2] - other[2]))) < _APART[1]
            for other in chosen
        ]
        if not any(near):
            chosen.append(motions[k])
        if len(chosen) == _CANDIDATES:
            break
    return chosen
