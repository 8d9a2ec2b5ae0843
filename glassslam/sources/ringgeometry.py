"""Rings of sonars that come as point clouds: the sensors behind the points."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from glassslam.records import Float32Array, FloatArray, SonarRing
from glassslam.sources.noecho import detect_no_echo
from glassslam.sources.rings import load_ring, ring_names

# The echoes of one sonar lie on its axis; more than this beside it (m), and the cloud is no ring.
_BESIDE = 0.02
# A sonar whose echoes spread less than this (m) says nothing of its direction.
_SPREAD = 0.05
# Fewer clouds than these lie on axes by chance; no ring has so many sonars.
_CLOUDS = 10
_SONARS = 64
# Float noise of a projection ends here, m; sonars resolve millimetres.
_ROUNDING = 1e-4
# Instrument grade ultrasonic transducers answer up to about 15 deg off their axis.
USUAL_FIELD_OF_VIEW = float(np.radians(30.0))


def ring_ranges(points: Float32Array, poses: FloatArray) -> Float32Array:
    """Distances of points along the axes of the sonars that saw them.

    Parameters
    ----------
    points : ndarray, shape (n, 2) or (n, 3)
        One echo per sonar in the base frame, m.
    poses : ndarray, shape (n, 3)
        The sonars in the base frame.

    Returns
    -------
    ndarray of float32, shape (n,)
        Ranges, m; points that are not finite give NaN.
    """
    axes = np.stack([np.cos(poses[:, 2]), np.sin(poses[:, 2])], axis=1)
    offsets = np.where(np.isfinite(points[:, :2]), points[:, :2], np.nan) - poses[:, :2]
    along = np.sum(offsets * axes, axis=1)
    return np.asarray(np.round(along / _ROUNDING) * _ROUNDING, dtype=np.float32)


def ring_behind(clouds: NDArray[np.float32]) -> SonarRing | None:
    """The ring of sonars whose echoes come as clouds of one point per sonar.

    A shipped ring is taken where the points lie on its axes. Otherwise the axis of every sonar is the line
    through its points, seen from the place on it that is nearest to the origin: end points are exact then,
    while the sonar itself may sit somewhere else on the line.

    Parameters
    ----------
    clouds : ndarray of float32, shape (m, n, 3)
        Clouds from all over the recording, base frame, m.

    Returns
    -------
    SonarRing or None
        None when the points do not lie on one axis per sonar, or are too few or too still to tell.
    """
    shipped = [(_misfit(ring.poses, clouds), ring) for ring in map(load_ring, ring_names())]
    misfit, known = min(shipped, key=lambda pair: pair[0])
    if misfit < np.inf:
        return known
    if len(clouds) < _CLOUDS or clouds.shape[1] > _SONARS or _is_still(clouds):
        return None
    poses = np.array([_axis(clouds[:, k, :2]) for k in range(clouds.shape[1])])
    if np.isinf(_misfit(poses, clouds)):
        return None
    ranges = [ring_ranges(cloud, poses) for cloud in clouds]
    ring = SonarRing(poses, USUAL_FIELD_OF_VIEW, 0.0, float(np.nanmax(ranges)))
    no_echo = detect_no_echo(ranges).value
    return replace(ring, range_max=no_echo) if no_echo is not None and np.isfinite(no_echo) else ring


def _misfit(poses: FloatArray, clouds: NDArray[np.float32]) -> float:
    """Mean distance of points from the axes of their sonars, m; inf where one is no echo of its sonar."""
    if len(poses) != clouds.shape[1] or not np.isfinite(clouds).any():
        return np.inf
    offsets = np.where(np.isfinite(clouds[..., :2]), clouds[..., :2], np.nan) - poses[:, :2]
    cosine, sine = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    along = offsets[..., 0] * cosine + offsets[..., 1] * sine
    beside = np.abs(offsets[..., 1] * cosine - offsets[..., 0] * sine)
    finite = np.isfinite(beside)
    if beside[finite].max() > _BESIDE or along[finite].min() < -_BESIDE or not _is_level(clouds):
        return np.inf
    return float(beside[finite].mean())


def _is_still(clouds: NDArray[np.float32]) -> bool:
    """Whether no point has moved."""
    places = np.where(np.isfinite(clouds[..., :2]), clouds[..., :2], np.nan)
    heard = places[:, np.isfinite(places).any(axis=(0, 2))]
    return not bool(np.any(np.nanmax(heard, axis=0) - np.nanmin(heard, axis=0) > _SPREAD))


def _is_level(clouds: NDArray[np.float32]) -> bool:
    """Whether the points of every sonar are of one height."""
    heights = np.where(np.isfinite(clouds[..., 2]), clouds[..., 2], np.nan)
    heard = heights[:, np.isfinite(heights).any(axis=0)]
    return bool(np.all(np.nanmax(heard, axis=0) - np.nanmin(heard, axis=0) < _BESIDE))


def _axis(points: NDArray[np.float32]) -> tuple[float, float, float]:
    """Pose of a sonar from its echoes, shape (m, 2)."""
    finite = points[np.all(np.isfinite(points), axis=1)].astype(np.float64)
    if len(finite) == 0:
        return 0.0, 0.0, 0.0
    middle = np.mean(finite, axis=0)
    _, spreads, axes = np.linalg.svd(finite - middle, full_matrices=False)
    axis = axes[0] if spreads[0] > _SPREAD * np.sqrt(len(finite)) else middle
    axis = axis / max(float(np.hypot(*axis)), 1e-9)
    if axis @ middle < 0.0:
        axis = -axis
    x, y = (middle - (middle @ axis) * axis).tolist()
    return x, y, float(np.arctan2(axis[1], axis[0]))
