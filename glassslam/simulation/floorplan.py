"""From the floor plan to the line segments a beam can hit."""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glassslam.errors import ConfigError
from glassslam.records import FloatArray
from glassslam.simulation.scene import Box, Opening, Post, Scene, Wall

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
    """

    segments: FloatArray
    names: tuple[str, ...]
    materials: tuple[str, ...]
    material: NDArray[np.int64]


def build_floor_plan(scene: Scene) -> FloorPlan:
    """All segments of a scene, in the order of the file.

    Raises
    ------
    ConfigError
        An opening lies beyond its wall or over another one, or a wall has no length.
    """
    pieces: list[tuple[str, str, FloatArray]] = []
    for wall in scene.walls:
        pieces += [(wall.name, wall.material, outline) for outline in _wall_outlines(wall)]
    for box in scene.boxes:
        pieces += [(box.name, box.material, outline) for outline in _box_outlines(box)]
    for post in scene.posts:
        pieces += [(post.name, post.material, outline) for outline in _post_outlines(post)]
    materials = tuple(dict.fromkeys(material for _, material, _ in pieces))
    counts = [len(outline) for _, _, outline in pieces]
    return FloorPlan(
        segments=np.concatenate([outline for _, _, outline in pieces]),
        names=tuple(name for (name, _, _), count in zip(pieces, counts, strict=True) for _ in range(count)),
        materials=materials,
        material=np.repeat([materials.index(material) for _, material, _ in pieces], counts).astype(np.int64),
    )


def _ring(corners: FloatArray) -> FloatArray:
    """Closed outline (n, 4) through corners (n, 2)."""
    return np.hstack((corners, np.roll(corners, -1, axis=0)))


def _wall_outlines(wall: Wall) -> Iterator[FloatArray]:
    points = np.array(wall.points + wall.points[:1] if wall.closed else wall.points)
    lengths = np.hypot(*np.diff(points, axis=0).T)
    if np.any(lengths == 0.0):
        raise ConfigError(f"wall {wall.name!r} has two equal points in a row")
    starts = np.concatenate(([0.0], np.cumsum(lengths)))
    gaps = _gaps(wall, float(starts[-1]))
    for k, length in enumerate(lengths):
        direction = (points[k + 1] - points[k]) / length
        for begin, end in _solid(gaps, float(starts[k]), float(starts[k + 1])):
            span = _extended(wall, begin - starts[k], end - starts[k], float(length))
            yield _face(points[k], direction, span, wall.thickness)


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
