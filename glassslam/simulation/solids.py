"""From the floor plan to flat faces in space, for a sensor that hears above and below its own height."""

import math

import numpy as np

from glassslam.records import FloatArray
from glassslam.simulation.floorplan import Piece, scene_pieces
from glassslam.simulation.materials import Material
from glassslam.simulation.scene import Scene
from glassslam.simulation.ultrasonic_kernels import Surfaces

_MARGIN = 5.0
_FLOOR = Material(reflectance=0.5)


def build_surfaces(scene: Scene, range_max: float) -> Surfaces:
    """Sides, undersides and tops of all things of a scene, its floor and its ceiling.

    Parameters
    ----------
    scene : Scene
        The world; things reach from `z_low` to `z_high`.
    range_max : float
        Range of the sensor, m.
    """
    pieces, palette = scene_pieces(scene), scene.palette()
    parts = [part for piece in pieces for part in _faces(piece, palette[piece.material])]
    parts += _ground(scene, np.concatenate([piece.outline for piece in pieces]))
    origin, first, second, is_round, material = zip(*parts, strict=True)
    return Surfaces(
        np.array(origin, dtype=np.float64),
        np.array(first, dtype=np.float64),
        np.array(second, dtype=np.float64),
        np.array(is_round, dtype=np.bool_),
        np.deg2rad([m.sonar_limit_deg for m in material]),
        range_max * np.array([m.sonar_reach for m in material]),
    )


_Face = tuple[FloatArray, FloatArray, FloatArray, bool, Material]


def _faces(piece: Piece, material: Material) -> list[_Face]:
    height, lean = piece.z_high - piece.z_low, math.tan(math.radians(piece.lean_deg))
    faces: list[_Face] = []
    for x0, y0, x1, y1 in piece.outline.tolist():
        side = np.array([x1 - x0, y1 - y0, 0.0])
        out = lean / math.hypot(x1 - x0, y1 - y0)
        up = height * np.array([-out * side[1], out * side[0], 1.0])
        faces.append((np.array([x0, y0, piece.z_low]), side, up, False, material))
    return faces + [_lid(piece, z, material) for z in (piece.z_low, piece.z_high) if len(piece.outline) > 1]


def _lid(piece: Piece, z: float, material: Material) -> _Face:
    """Top or underside: a rectangle where there are four corners, else the circle of the same outline."""
    corners = piece.outline[:, :2]
    if len(corners) == 4:
        first, second = corners[1] - corners[0], corners[3] - corners[0]
        return np.append(corners[0], z), np.append(first, 0.0), np.append(second, 0.0), False, material
    centre = corners.mean(axis=0)
    radius = float(np.hypot(*(corners - centre).T).mean())
    axes = radius * np.eye(3)
    return np.append(centre, z), axes[0], axes[1], True, material


def _ground(scene: Scene, outlines: FloatArray) -> list[_Face]:
    points = outlines.reshape(-1, 2)
    low, high = points.min(axis=0) - _MARGIN, points.max(axis=0) + _MARGIN
    along, across = np.array([high[0] - low[0], 0.0, 0.0]), np.array([0.0, high[1] - low[1], 0.0])
    heights = [0.0] if scene.ceiling is None else [0.0, scene.ceiling]
    return [(np.append(low, z), along, across, False, _FLOOR) for z in heights]
