"""Straight lines through oriented surface pieces."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from glassslam.records import FloatArray

_NODES_TOGETHER = 10


@dataclass(frozen=True, slots=True)
class Line:
    """A straight line with its uncertainty.

    Attributes
    ----------
    foot : ndarray of float64, shape (2,)
        Weighted mean of the pieces, m.
    angle : float
        Direction of the line, rad.
    position_sigma : float
        Standard deviation across the line at the foot, m.
    angle_sigma : float
        Standard deviation of the direction, rad.
    """

    foot: FloatArray
    angle: float
    position_sigma: float
    angle_sigma: float

    @property
    def direction(self) -> FloatArray:
        """Unit vector along the line, shape (2,)."""
        return np.array([math.cos(self.angle), math.sin(self.angle)])

    @property
    def across(self) -> FloatArray:
        """Unit vector across the line, shape (2,)."""
        return np.array([-math.sin(self.angle), math.cos(self.angle)])

    def along(self, points: FloatArray) -> FloatArray:
        """Position of points (n, 2) along the line from the foot, m."""
        return np.asarray((points - self.foot) @ self.direction)

    def gap(self, points: FloatArray) -> FloatArray:
        """Signed distance of points (n, 2) from the line, m."""
        return np.asarray((points - self.foot) @ self.across)


def axial_difference(a: FloatArray | float, b: FloatArray | float) -> FloatArray:
    """Angle between undirected lines, in [0, pi / 2], rad."""
    difference: FloatArray = (np.asarray(a) - np.asarray(b) + 0.5 * np.pi) % np.pi - 0.5 * np.pi
    return np.abs(difference)


def fit_line(
    positions: FloatArray, normals: FloatArray, position_sigma: FloatArray, normal_sigma: FloatArray
) -> Line:
    """Line of least squares through pieces whose positions and normals both carry information.

    The spread of the positions tells the direction of a long wall; the normals tell that of a short
    one. Both estimates are joined by their variances.

    Parameters
    ----------
    positions : ndarray of float64, shape (n, 2)
        Points on the surface, m.
    normals : ndarray of float64, shape (n,)
        Directions of the surface normal, rad.
    position_sigma, normal_sigma : ndarray of float64, shape (n,)
        Standard deviations, m and rad.
    """
    weights = 1.0 / position_sigma**2
    foot = weights @ positions / weights.sum()
    by_normals, normal_variance = _mean_axis(normals + 0.5 * np.pi, 1.0 / normal_sigma**2)
    offsets = positions - foot
    along = offsets @ np.array([math.cos(by_normals), math.sin(by_normals)])
    across = offsets @ np.array([-math.sin(by_normals), math.cos(by_normals)])
    spread = float(weights @ along**2)
    slope = float(weights @ (along * across)) / spread if spread > 0 else 0.0
    # the weighted spread is the information on the slope: the inverse of its variance
    information = spread + 1.0 / normal_variance
    angle = by_normals + spread / information * math.atan(slope)
    return Line(foot, angle, 1.0 / math.sqrt(float(weights.sum())), 1.0 / math.sqrt(information))


def with_scatter(
    line: Line,
    positions: FloatArray,
    normals: FloatArray,
    position_sigma: FloatArray,
    normal_sigma: FloatArray,
    nodes: NDArray[np.int64],
) -> Line:
    """The line with the uncertainty that the scatter of its pieces tells.

    What one node sees, and what its neighbours see from nearly the same place with nearly the same error of
    their poses, errs in one way: ten nodes in a row are one witness. The deviations of the witnesses give the
    covariance of the least squares (the sandwich estimator, grouped by witness); it is never below what as
    many independent pieces would have. Errors that all nodes share are not in it.

    Parameters
    ----------
    line : Line
        As fitted to the pieces.
    positions, normals, position_sigma, normal_sigma : ndarray
        The pieces, as in `fit_line`.
    nodes : ndarray of int64, shape (n,)
        The node that saw each piece.
    """
    by_position, by_normal = 1.0 / position_sigma**2, 1.0 / normal_sigma**2
    along, gaps = line.along(positions), line.gap(positions)
    turns = (normals + 0.5 * np.pi - line.angle + 0.5 * np.pi) % np.pi - 0.5 * np.pi
    _, witness = np.unique(nodes // _NODES_TOGETHER, return_inverse=True)
    count = int(witness.max()) + 1
    pulls = np.stack(
        (
            np.bincount(witness, by_position * gaps, count),
            np.bincount(witness, by_position * gaps * along + by_normal * turns, count),
        )
    )
    lever = float(by_position @ along)
    information = np.array([[by_position.sum(), lever], [lever, by_position @ along**2 + by_normal.sum()]])
    inverse = np.linalg.inv(information)
    scatter = inverse @ (pulls @ pulls.T) @ inverse * (count / max(count - 1, 1))
    least = inverse * (len(nodes) / count)
    position, angle = np.sqrt(np.maximum(np.diag(scatter), np.diag(least))).tolist()
    return replace(line, position_sigma=position, angle_sigma=angle)


def _mean_axis(angles: FloatArray, weights: FloatArray) -> tuple[float, float]:
    """Weighted mean of undirected angles and its variance."""
    c, s = float(weights @ np.cos(2.0 * angles)), float(weights @ np.sin(2.0 * angles))
    return 0.5 * math.atan2(s, c), float(1.0 / weights.sum())


def members(
    line: Line, positions: FloatArray, normals: FloatArray, distance: float, angle: float
) -> NDArray[np.bool_]:
    """Pieces within `distance` (m) of a line whose normal is within `angle` (rad) of perpendicular to it."""
    near = np.abs(line.gap(positions)) < distance
    return np.asarray(near & (axial_difference(normals + 0.5 * np.pi, line.angle) < angle))
