"""Kernels of the 3D ultrasonic sensor: rays against flat faces, and which of them answer."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from glassslam.accelerate import kernel
from glassslam.records import FloatArray


class Surfaces(NamedTuple):
    """Flat faces: parallelograms spanned from a corner, or ellipses around a centre.

    Attributes
    ----------
    origin : ndarray of float64, shape (n, 3)
        Corner or centre, m.
    first, second : ndarray of float64, shape (n, 3)
        Sides or half axes, at right angles, m.
    round : ndarray of bool, shape (n,)
        Whether the face is an ellipse.
    limit : ndarray of float64, shape (n,)
        Largest incidence at which sound comes straight back, rad.
    reach : ndarray of float64, shape (n,)
        Farthest distance at which it is heard, m.
    """

    origin: FloatArray
    first: FloatArray
    second: FloatArray
    round: NDArray[np.bool_]
    limit: FloatArray
    reach: FloatArray


@kernel
def meet(eye: FloatArray, ray: FloatArray, faces: Surfaces, k: int) -> tuple[float, float, float]:
    """Distance along a unit ray to a face (inf: not met), cosine of incidence, distance to its border."""
    ux, uy, uz = faces.first[k, 0], faces.first[k, 1], faces.first[k, 2]
    vx, vy, vz = faces.second[k, 0], faces.second[k, 1], faces.second[k, 2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    along = nx * ray[0] + ny * ray[1] + nz * ray[2]
    if along == 0.0:
        return math.inf, 0.0, 0.0
    wx, wy, wz = faces.origin[k, 0] - eye[0], faces.origin[k, 1] - eye[1], faces.origin[k, 2] - eye[2]
    distance = (nx * wx + ny * wy + nz * wz) / along
    if not distance > 0.0:
        return math.inf, 0.0, 0.0
    px, py, pz = distance * ray[0] - wx, distance * ray[1] - wy, distance * ray[2] - wz
    u, v = math.sqrt(ux * ux + uy * uy + uz * uz), math.sqrt(vx * vx + vy * vy + vz * vz)
    a, b = (px * ux + py * uy + pz * uz) / (u * u), (px * vx + py * vy + pz * vz) / (v * v)
    if faces.round[k]:
        border = (1.0 - math.hypot(a, b)) * min(u, v)
    else:
        border = min(min(a, 1.0 - a) * u, min(b, 1.0 - b) * v)
    if border < 0.0:
        return math.inf, 0.0, 0.0
    return distance, abs(along) / (u * v), border


@kernel
def answer_chance(incidence: float, border: float, limit: float, softness: float, edge: float) -> float:
    """How likely sound comes back: square on, fading beyond the limit; near an edge it is diffracted."""
    beyond = max(incidence - limit, 0.0) / softness
    chance = math.exp(-0.5 * beyond * beyond)
    return max(chance, 0.5) if border < edge else chance


@kernel
def listen(
    eye: FloatArray,
    rays: FloatArray,
    draws: FloatArray,
    faces: Surfaces,
    range_max: float,
    heard: float,
    softness: float,
    edge: float,
    out: FloatArray,
) -> None:
    """Distance of the first face along every unit ray (n, 3), inf where nothing answers.

    A face answers when `draws` (n,) in [0, 1) falls below its chance, times `heard` for echoes that are
    lost anyway.
    """
    for k in range(rays.shape[0]):
        nearest, cosine, border, face = math.inf, 0.0, 0.0, -1
        for i in range(faces.limit.size):
            distance, square, inside = meet(eye, rays[k], faces, i)
            if distance < nearest:
                nearest, cosine, border, face = distance, square, inside, i
        out[k] = math.inf
        if face >= 0 and nearest <= min(range_max, faces.reach[face]):
            incidence = math.acos(min(cosine, 1.0))
            if draws[k] < heard * answer_chance(incidence, border, faces.limit[face], softness, edge):
                out[k] = nearest
