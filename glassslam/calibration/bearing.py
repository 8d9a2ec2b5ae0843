"""Errors of a lidar's beams, estimated from any recording: walls must come out straight."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from detectors.beam_errors import BeamErrors
from glassslam.calibration.straight_walls import WallPoints, wall_points
from glassslam.records import FloatArray, LaserScan
from glassslam.slam.beam_errors import true_bearings, true_points

_ITERATIONS = 25
_CONVERGED = 1e-7
_ROBUST = 2.0
_STRETCHES = 16
_MEDIAN_TO_SIGMA = 1.4826
_LEAST_SIGMA = 1e-4
# what no lidar exceeds: holds errors at zero that the walls of a recording do not tell
_PRIOR_SIGMA = np.array([0.05, 0.05, 0.05, 0.05])


def estimate_beam_errors(
    scans: Iterable[LaserScan], *, max_range: float = 10.0, max_scans: int = 1500
) -> BeamErrors | None:
    """Estimate the errors of the beams from the straightness of the walls in single scans.

    No poses are needed: in every scan the straight walls are found, and the errors are those that bring
    the returns of each nearest to a line. The scans should be of a robot that moves, turns and sees walls
    at many angles; scans alike to the one before are passed over.

    Parameters
    ----------
    scans : iterable of LaserScan
        Scans of one lidar.
    max_range : float
        Returns beyond are not used, m.
    max_scans : int
        Scans used at most.

    Returns
    -------
    BeamErrors or None
        None where no wall is seen.

    Examples
    --------
    >>> import glassslam as gs
    >>> from glassslam.calibration.bearing import estimate_beam_errors
    >>> angles = np.radians(np.arange(-90.0, 91.0))
    >>> ranges = np.minimum(2.0 / np.maximum(np.abs(np.sin(angles)), 0.1), 5.0 / np.cos(angles))
    >>> scan = gs.LaserScan(0.0, ranges.astype(np.float32), -np.pi / 2, np.pi / 180, 0.1, 30.0)
    >>> found = estimate_beam_errors([scan])
    >>> found.walls, abs(found.bearing_cosine) < 1e-3
    (3, True)
    """
    points = wall_points(scans, max_range, max_scans)
    if points.walls == 0:
        return None
    errors = np.zeros(4)
    for _ in range(_ITERATIONS):
        step, covariance = _step(points, errors)
        errors = errors + step
        if np.abs(step).max() < _CONVERGED:
            break
    cosine, sine, lateral, offset = errors.tolist()
    sigma = np.sqrt(np.diag(covariance)).tolist()
    return BeamErrors(
        cosine, sine, lateral, offset,
        sigma=(sigma[0], sigma[1], sigma[2], sigma[3]),
        walls=points.walls,
        bend_before=_bend(points, np.zeros(4)),
        bend_after=_bend(points, errors),
    )  # fmt: skip


def _bend(points: WallPoints, errors: FloatArray) -> float:
    return float(np.median(np.abs(_lines(points, errors).residuals)))


@dataclass(frozen=True, slots=True)
class _Lines:
    """Lines through the returns of every wall; one entry per return.

    Attributes
    ----------
    residuals, along : ndarray of float64, shape (n,)
        Position across and along the line of the wall, from the weighted centre of its returns, m.
    normals : ndarray of float64, shape (n, 2)
        Normal of the line.
    weights : ndarray of float64, shape (n,)
        Weight of the return, 1/m^2.
    """

    residuals: FloatArray
    along: FloatArray
    normals: FloatArray
    weights: FloatArray


def _lines(points: WallPoints, errors: FloatArray) -> _Lines:
    """Robust lines: weights and lines take turns, from equal weights on."""
    xy = true_points(points.angles, points.ranges, errors)
    reach = 1.0 + points.ranges
    weights = 1.0 / reach**2
    for _ in range(4):
        lines = _fit(points, xy, weights)
        ratio = np.abs(lines.residuals) / reach
        sigma = max(_MEDIAN_TO_SIGMA * float(np.median(ratio)), _LEAST_SIGMA)
        weights = (1.0 / (sigma * reach * (1.0 + (ratio / (_ROBUST * sigma)) ** 2))) ** 2
    return _fit(points, xy, weights)


def _fit(points: WallPoints, xy: FloatArray, weights: FloatArray) -> _Lines:
    total = points.sums(weights)
    centred = xy - points.spread(points.sums(weights[:, None] * xy) / total[:, None])
    x, y = centred[:, 0], centred[:, 1]
    xx, xy_, yy = points.sums(weights * x * x), points.sums(weights * x * y), points.sums(weights * y * y)
    heading = points.spread(0.5 * np.arctan2(2.0 * xy_, xx - yy))
    c, s = np.cos(heading), np.sin(heading)
    return _Lines(c * y - s * x, c * x + s * y, np.stack((-s, c), axis=1), weights)


def _step(points: WallPoints, errors: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Gauss-Newton step of the errors, and their covariance."""
    lines = _lines(points, errors)
    jacobian = _jacobian(points, errors, lines.normals)
    w, along = lines.weights[:, None], lines.along[:, None]
    # position and direction of every wall are free: what they can explain says nothing about the beams
    mean = points.sums(w * jacobian) / points.sums(w)
    tilt = points.sums(w * along * jacobian) / points.sums(w * along**2)
    jacobian = jacobian - points.spread(mean) - along * points.spread(tilt)
    weighted = w * jacobian
    inverse = np.linalg.inv(weighted.T @ jacobian + np.diag(_PRIOR_SIGMA**-2))
    gradients = points.sums(weighted * lines.residuals[:, None])
    step = -inverse @ (gradients.sum(axis=0) + errors / _PRIOR_SIGMA**2)
    # the same wall in scan after scan errs the same way: only stretches of the recording are independent
    stretches = np.stack([part.sum(axis=0) for part in np.array_split(gradients, _STRETCHES)])
    scatter = stretches.T @ stretches + np.diag(_PRIOR_SIGMA**-2)
    return step, inverse @ scatter @ inverse


def _jacobian(points: WallPoints, errors: FloatArray, normals: FloatArray) -> FloatArray:
    """Change of the residuals with the errors, shape (n, 4)."""
    cosine, sine = np.cos(points.angles), np.sin(points.angles)
    bearing = true_bearings(points.angles, errors)
    forward = normals[:, 0] * np.cos(bearing) + normals[:, 1] * np.sin(bearing)
    across = normals[:, 1] * np.cos(bearing) - normals[:, 0] * np.sin(bearing)
    turn = (points.ranges + errors[3]) * across - errors[2] * forward
    return np.stack((turn * cosine, turn * sine, across, forward), axis=1)
