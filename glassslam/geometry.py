"""Planar rigid motions: poses are float64 arrays (..., 3) of x, y, theta in m and rad."""

import math

import numpy as np

from glassslam.records import FloatArray


def wrap_angle(angle: FloatArray | float) -> FloatArray:
    """Angle brought into [-pi, pi), rad."""
    return np.asarray((np.asarray(angle) + np.pi) % (2.0 * np.pi) - np.pi)


def compose(a_from_b: FloatArray, b_from_c: FloatArray) -> FloatArray:
    """Poses a_from_c, shape (..., 3), of frames chained through b."""
    a, b = np.asarray(a_from_b, dtype=np.float64), np.asarray(b_from_c, dtype=np.float64)
    if a.ndim == b.ndim == 1:
        return _compose_two(a, b)
    c, s = np.cos(a[..., 2]), np.sin(a[..., 2])
    return np.stack(
        (
            a[..., 0] + c * b[..., 0] - s * b[..., 1],
            a[..., 1] + s * b[..., 0] + c * b[..., 1],
            wrap_angle(a[..., 2] + b[..., 2]),
        ),
        axis=-1,
    )


def _compose_two(a: FloatArray, b: FloatArray) -> FloatArray:
    """`compose` of single poses: several times faster than through arrays."""
    ax, ay, at = a.tolist()
    bx, by, bt = b.tolist()
    c, s = math.cos(at), math.sin(at)
    turn = (at + bt + math.pi) % (2.0 * math.pi) - math.pi
    return np.array((ax + c * bx - s * by, ay + s * bx + c * by, turn))


def inverse(a_from_b: FloatArray) -> FloatArray:
    """Poses b_from_a, shape (..., 3)."""
    a = np.asarray(a_from_b, dtype=np.float64)
    if a.ndim == 1:
        x, y, theta = a.tolist()
        cosine, sine = math.cos(theta), math.sin(theta)
        turn = (math.pi - theta) % (2.0 * math.pi) - math.pi
        return np.array((-cosine * x - sine * y, sine * x - cosine * y, turn))
    c, s = np.cos(a[..., 2]), np.sin(a[..., 2])
    return np.stack(
        (-c * a[..., 0] - s * a[..., 1], s * a[..., 0] - c * a[..., 1], wrap_angle(-a[..., 2])), axis=-1
    )


def between(m_from_a: FloatArray, m_from_b: FloatArray) -> FloatArray:
    """Poses a_from_b, shape (..., 3), of two frames known in a common frame m."""
    return compose(inverse(m_from_a), m_from_b)


def transform_points(a_from_b: FloatArray, points_b: FloatArray) -> FloatArray:
    """Points (n, 2) of frame b expressed in frame a, m."""
    x, y, theta = np.asarray(a_from_b, dtype=np.float64).tolist()
    c, s = math.cos(theta), math.sin(theta)
    px, py = points_b[:, 0], points_b[:, 1]
    out = np.empty((len(points_b), 2))
    out[:, 0] = c * px - s * py + x
    out[:, 1] = s * px + c * py + y
    return out


def interpolate(a: FloatArray, b: FloatArray, fraction: FloatArray | float) -> FloatArray:
    """Poses between a and b, shape (..., 3); heading along the shorter arc, `fraction` in [0, 1]."""
    f = np.asarray(fraction, dtype=np.float64)[..., None]
    a = np.asarray(a, dtype=np.float64)
    delta = np.asarray(b, dtype=np.float64) - a
    delta[..., 2] = wrap_angle(delta[..., 2])
    out = a + f * delta
    out[..., 2] = wrap_angle(out[..., 2])
    return np.asarray(out)
