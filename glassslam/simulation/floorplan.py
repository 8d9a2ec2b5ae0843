"""From the floor plan to the line segments a beam can hit."""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from glassslam.errors import ConfigError
from glassslam.records import FloatArray
from glassslam.simulation.scene import Box, Opening, Panes, Post, Scene, Wall

_POST_SIDES = 12


@dataclass(frozen=True, slots=True)
class FloorPlan:
    """Every surface of a scene as straight segments.

    Attributes
    ----------
    segments : ndarray of float64, shape (n, 4)
        End points x0, y0, x1, y1 in the world frame, m.
    names : tuple of str
        The thing each segment belongs to, length n.
    materials : tuple of str
        Names of the materials in use.
    material : ndarray of int64, shape (n,)
        Index of each segment's material in `materials`.
    lean : ndarray of float64, shape (n,)
        Angle of each segment's surface with the vertical, rad.
    """

    segments: FloatArray
    names: tuple[str, ...]
    materials: tuple[str, ...]
    material: NDArray[np.int64]
    lean: FloatArray


class Piece(NamedTuple):
    """One straight stretch, pane, mullion, box or post.

    Attributes
    ----------
    name, material : str
        What it belongs to and is made of.
    outline : ndarray of float64, shape (n, 4)
        Its sides: end points in the world frame, m.
    z_low, z_high : float
        From where to where it reaches, m.
    lean_deg : float
        Angle with the vertical, deg.
    """

    name: str
    material: str
    outline: FloatArray
    z_low: float
    z_high: float
    lean_deg: float = 0.0


def build_floor_plan(scene: Scene, band: tuple[float, float] | None = None) -> FloorPlan:
    """The segments of a scene that reach into a band of heights, in the order of the file.

    Parameters
    ----------
    scene : Scene
        The world.
    band : tuple of float, optional
        Lowest and highest z, m; the plane of the lidar when omitted.

    Raises
    ------
    ConfigError
        An opening lies beyond its wall or over another one, a wall has no length, or nothing is that high.
    """
    bottom, top = band or (scene.laser_height, scene.laser_height)
    pieces = [piece for piece in scene_pieces(scene) if piece.z_low <= top and piece.z_high > bottom]
    if not pieces:
        raise ConfigError(
            f"nothing of the scene reaches the height of {bottom:g} m", "check z_low and z_high"
        )
    materials = tuple(dict.fromkeys(piece.material for piece in pieces))
    counts = [len(piece.outline) for piece in pieces]
    return FloorPlan(
        segments=np.concatenate([piece.outline for piece in pieces]),
        names=tuple(piece.name for piece, count in zip(pieces, counts, strict=True) for _ in range(count)),
        materials=materials,
        material=np.repeat([materials.index(piece.material) for piece in pieces], counts).astype(np.int64),
        lean=np.deg2rad(np.repeat([piece.lean_deg for piece in pieces], counts)),
    )


def scene_pieces(scene: Scene) -> list[Piece]:
    """Everything a scene is made of, in the order of the file.

    Raises
    ------
    ConfigError
        An opening lies beyond its wall or over another one, or a wall has no length.
    """
    pieces: list[Piece] = []
    for wall in scene.walls:
        pieces += _wall_pieces(wall)
    for box in scene.boxes:
        pieces += [_piece(box, outline) for outline in _box_outlines(box)]
    for post in scene.posts:
        pieces += [_piece(post, outline) for outline in _post_outlines(post)]
    return pieces


def _piece(thing: Wall | Box | Post, outline: FloatArray) -> Piece:
    lean_deg = thing.lean_deg if isinstance(thing, Wall) else 0.0
    return Piece(thing.name, thing.material, outline, thing.z_low, thing.z_high, lean_deg)


def _ring(corners: FloatArray) -> FloatArray:
    """Closed outline (n, 4) through corners (n, 2)."""
    return np.hstack((corners, np.roll(corners, -1, axis=0)))


def _wall_pieces(wall: Wall) -> Iterator[Piece]:
    for origin, direction, span, length in _stretches(wall):
        if wall.panes is None:
            outline = _face(origin, direction, _extended(wall, *span, length), wall.thickness)
            yield _piece(wall, outline)
        else:
            yield from _pane_pieces(
                wall, wall.panes, origin + span[0] * direction, direction, span[1] - span[0]
            )


def _stretches(wall: Wall) -> Iterator[tuple[FloatArray, FloatArray, tuple[float, float], float]]:
    """Straight parts without openings: start and direction of the side, span on it, length of the side."""
    points = np.array(wall.points + wall.points[:1] if wall.closed else wall.points)
    lengths = np.hypot(*np.diff(points, axis=0).T)
    if np.any(lengths == 0.0):
        raise ConfigError(f"wall {wall.name!r} has two equal points in a row")
    starts = np.concatenate(([0.0], np.cumsum(lengths)))
    gaps = _gaps(wall, float(starts[-1]))
    for k, length in enumerate(lengths):
        direction = (points[k + 1] - points[k]) / length
        for begin, end in _solid(gaps, float(starts[k]), float(starts[k + 1])):
            yield points[k], direction, (begin - float(starts[k]), end - float(starts[k])), float(length)


def _pane_pieces(
    wall: Wall, panes: Panes, origin: FloatArray, direction: FloatArray, length: float
) -> Iterator[Piece]:
    """Panes of equal width with a mullion at both ends of each."""
    if length <= 2 * panes.mullion:
        raise ConfigError(f"wall {wall.name!r}: a stretch of {length:.2f} m has no room for a pane")
    count = max(1, math.ceil(length / panes.width - 1e-9))
    joints = np.linspace(panes.mullion / 2, length - panes.mullion / 2, count + 1)
    for begin, end in itertools.pairwise(joints):
        span = (begin + panes.mullion / 2, end - panes.mullion / 2)
        yield _piece(wall, _face(origin, direction, span, 0.0))
    for joint in joints:
        outline = _mullion(panes, origin + joint * direction, direction)
        yield Piece(f"{wall.name}-mullions", panes.material, outline, wall.z_low, wall.z_high)


def _mullion(panes: Panes, centre: FloatArray, direction: FloatArray) -> FloatArray:
    """Bar with cut corners: one of its faces looks nearly at the lidar from most places."""
    a, b = panes.mullion / 2, panes.depth / 2
    cut = 0.35 * min(a, b)
    corners = np.array(
        [
            [a - cut, -b],
            [a, cut - b],
            [a, b - cut],
            [a - cut, b],
            [cut - a, b],
            [-a, b - cut],
            [-a, cut - b],
            [cut - a, -b],
        ]
    )
    rotation = np.array([[direction[0], -direction[1]], [direction[1], direction[0]]])
    return _ring(corners @ rotation.T + centre)


def _gaps(wall: Wall, total: float) -> list[tuple[float, float]]:
    ordered: list[Opening] = sorted(wall.openings, key=lambda opening: opening.at)
    gaps = [(opening.at, opening.at + opening.width) for opening in ordered]
    if gaps and gaps[-1][1] > total:
        raise ConfigError(
            f"wall {wall.name!r}: an opening ends at {gaps[-1][1]:g} m, the wall at {total:g} m"
        )
    if any(a[1] > b[0] for a, b in itertools.pairwise(gaps)):
        raise ConfigError(f"wall {wall.name!r}: two openings overlap")
    return gaps


def _solid(gaps: list[tuple[float, float]], begin: float, end: float) -> Iterator[tuple[float, float]]:
    """Parts of [begin, end] that no gap covers."""
    for gap_begin, gap_end in gaps:
        if gap_end <= begin or gap_begin >= end:
            continue
        if gap_begin > begin:
            yield begin, gap_begin
        begin = max(begin, gap_end)
    if begin < end:
        yield begin, end


def _extended(wall: Wall, begin: float, end: float, length: float) -> tuple[float, float]:
    """Thick walls reach half their thickness past a corner, so that outer corners are closed."""
    half = wall.thickness / 2
    return (begin - half if begin <= 0.0 else begin), (end + half if end >= length else end)


def _face(
    origin: FloatArray, direction: FloatArray, span: tuple[float, float], thickness: float
) -> FloatArray:
    a, b = origin + span[0] * direction, origin + span[1] * direction
    if thickness == 0.0:
        return np.concatenate((a, b))[None, :]
    side = np.array([-direction[1], direction[0]]) * (thickness / 2)
    return _ring(np.array([a - side, b - side, b + side, a + side]))


def _box_outlines(box: Box) -> Iterator[FloatArray]:
    yaw = np.deg2rad(box.yaw_deg)
    rotation = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * np.array(box.size) / 2
    for centre in box.at:
        yield _ring(corners @ rotation.T + np.array(centre))


def _post_outlines(post: Post) -> Iterator[FloatArray]:
    angle = np.arange(_POST_SIDES) * (2 * np.pi / _POST_SIDES)
    corners = post.radius * np.stack((np.cos(angle), np.sin(angle)), axis=1)
    for centre in post.at:
        yield _ring(corners + np.array(centre))
