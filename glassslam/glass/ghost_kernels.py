"""Kernels that follow beams through glass walls and ask where they would have come from over a mirror."""

import math

import numpy as np
from numpy.typing import NDArray

from glassslam.accelerate import kernel
from glassslam.records import Float32Array, FloatArray

_FULL = 255


@kernel
def distance_to_segment(x: float, y: float, segment: FloatArray) -> float:
    """Distance of a point from a segment x0, y0, x1, y1."""
    dx, dy = segment[2] - segment[0], segment[3] - segment[1]
    squared = dx * dx + dy * dy
    share = 0.0
    if squared > 0.0:
        share = min(max(((x - segment[0]) * dx + (y - segment[1]) * dy) / squared, 0.0), 1.0)
    return math.hypot(x - segment[0] - share * dx, y - segment[1] - share * dy)


@kernel
def walls_in_reach(
    sx: float, sy: float, reach: float, segments: FloatArray, near: FloatArray, number: NDArray[np.int32]
) -> int:
    """Lines of the walls within `reach` of the sensor; how many there are.

    Rows of `near`: unit normal, its offset, distance of the sensor along it, unit direction, start along
    it, length. `number` tells the wall of each row.
    """
    count = 0
    for w in range(segments.shape[0]):
        length = math.hypot(segments[w, 2] - segments[w, 0], segments[w, 3] - segments[w, 1])
        if length == 0.0 or distance_to_segment(sx, sy, segments[w]) > reach:
            continue
        dx, dy = (segments[w, 2] - segments[w, 0]) / length, (segments[w, 3] - segments[w, 1]) / length
        offset = dx * segments[w, 1] - dy * segments[w, 0]
        side = dx * sy - dy * sx - offset
        if side == 0.0:
            continue
        near[count, 0], near[count, 1], near[count, 2], near[count, 3] = -dy, dx, offset, side
        near[count, 4], near[count, 5] = dx, dy
        near[count, 6], near[count, 7] = dx * segments[w, 0] + dy * segments[w, 1], length
        number[count] = w
        count += 1
    return count


@kernel
def first_walls(
    poses: FloatArray,
    sensors: FloatArray,
    points: Float32Array,
    first: NDArray[np.int64],
    segments: FloatArray,
    tolerance: float,
    wall: NDArray[np.int32],
    share: Float32Array,
    cosines: Float32Array,
) -> None:
    """First wall that each beam crosses, -1 for none, the share of its way up to there, 1 for none, and the
    cosine of its incidence there, 0 for none.

    Points `first[n]` .. `first[n + 1]` are the ends of the beams of node n, in the frame of its base. A beam
    that ends within `tolerance` of the line of a wall, or before it, does not cross that wall.
    """
    near = np.empty((segments.shape[0], 8))
    number = np.empty(segments.shape[0], dtype=np.int32)
    for n in range(poses.shape[0]):
        cosine, sine = math.cos(poses[n, 2]), math.sin(poses[n, 2])
        sx = cosine * sensors[n, 0] - sine * sensors[n, 1] + poses[n, 0]
        sy = sine * sensors[n, 0] + cosine * sensors[n, 1] + poses[n, 1]
        reach = 0.0
        for k in range(first[n], first[n + 1]):
            reach = max(reach, math.hypot(points[k, 0] - sensors[n, 0], points[k, 1] - sensors[n, 1]))
        count = walls_in_reach(sx, sy, reach, segments, near, number)
        for k in range(first[n], first[n + 1]):
            px = cosine * points[k, 0] - sine * points[k, 1] + poses[n, 0]
            py = sine * points[k, 0] + cosine * points[k, 1] + poses[n, 1]
            wall[k], best, across = -1, 1.0, 0.0
            for w in range(count):
                gap = near[w, 0] * px + near[w, 1] * py - near[w, 2]
                side = near[w, 3]
                if gap * side >= 0.0 or abs(gap) <= tolerance:
                    continue
                part = side / (side - gap)
                if part >= best:
                    continue
                cx, cy = sx + part * (px - sx), sy + part * (py - sy)
                along = near[w, 4] * cx + near[w, 5] * cy - near[w, 6]
                if 0.0 <= along <= near[w, 7]:
                    best, wall[k], across = part, number[w], abs(side - gap)
            share[k] = best
            cosines[k] = across / math.hypot(px - sx, py - sy) if wall[k] >= 0 else 0.0


@kernel
def count_ends(
    poses: FloatArray,
    points: Float32Array,
    first: NDArray[np.int64],
    chosen: NDArray[np.bool_],
    corner: FloatArray,
    cell: float,
    counts: NDArray[np.uint8],
) -> None:
    """Count the chosen ends by cells of the map, up to 255."""
    for n in range(poses.shape[0]):
        cosine, sine = math.cos(poses[n, 2]), math.sin(poses[n, 2])
        for k in range(first[n], first[n + 1]):
            if not chosen[k]:
                continue
            x = cosine * points[k, 0] - sine * points[k, 1] + poses[n, 0]
            y = sine * points[k, 0] + cosine * points[k, 1] + poses[n, 1]
            column, row = math.floor((x - corner[0]) / cell), math.floor((y - corner[1]) / cell)
            if 0 <= row < counts.shape[0] and 0 <= column < counts.shape[1] and counts[row, column] < _FULL:
                counts[row, column] += 1


@kernel
def is_known(
    x: float, y: float, corner: FloatArray, cell: float, counts: NDArray[np.uint8], few: int
) -> bool:
    """Whether the cell of a point or one beside it holds at least `few` returns."""
    column, row = math.floor((x - corner[0]) / cell), math.floor((y - corner[1]) / cell)
    for i in range(max(row - 1, 0), min(row + 2, counts.shape[0])):
        for j in range(max(column - 1, 0), min(column + 2, counts.shape[1])):
            if counts[i, j] >= few:
                return True
    return False


@kernel
def mirror_evidence(
    poses: FloatArray,
    points: Float32Array,
    first: NDArray[np.int64],
    wall: NDArray[np.int32],
    segments: FloatArray,
    corner: FloatArray,
    cell: float,
    direct: NDArray[np.uint8],
    real: NDArray[np.uint8],
    few: int,
    known: NDArray[np.uint8],
) -> None:
    """What is known around the ends of beams that cross a wall.

    Bit 0 says that the end, folded back across the line of the wall, lies where at least `few` ends are
    counted in `direct`; bit 1 says so of the end itself and `real`. Entries without a wall stay as they are.
    """
    for n in range(poses.shape[0]):
        cosine, sine = math.cos(poses[n, 2]), math.sin(poses[n, 2])
        for k in range(first[n], first[n + 1]):
            w = wall[k]
            if w < 0:
                continue
            dx, dy = segments[w, 2] - segments[w, 0], segments[w, 3] - segments[w, 1]
            length = math.hypot(dx, dy)
            nx, ny = -dy / length, dx / length
            px = cosine * points[k, 0] - sine * points[k, 1] + poses[n, 0]
            py = sine * points[k, 0] + cosine * points[k, 1] + poses[n, 1]
            gap = nx * (px - segments[w, 0]) + ny * (py - segments[w, 1])
            image = is_known(px - 2.0 * gap * nx, py - 2.0 * gap * ny, corner, cell, direct, few)
            known[k] = 1 * image + 2 * is_known(px, py, corner, cell, real, few)


@kernel
def mark_ends(
    poses: FloatArray,
    points: Float32Array,
    first: NDArray[np.int64],
    labels: NDArray[np.uint8],
    corner: FloatArray,
    cell: float,
    direct: NDArray[np.bool_],
    ghosts: NDArray[np.uint8],
) -> None:
    """Mark the cells in which direct returns (label 0) end, and count the others, up to 255."""
    for n in range(poses.shape[0]):
        cosine, sine = math.cos(poses[n, 2]), math.sin(poses[n, 2])
        for k in range(first[n], first[n + 1]):
            column = math.floor(
                (cosine * points[k, 0] - sine * points[k, 1] + poses[n, 0] - corner[0]) / cell
            )
            row = math.floor((sine * points[k, 0] + cosine * points[k, 1] + poses[n, 1] - corner[1]) / cell)
            if not (0 <= row < direct.shape[0] and 0 <= column < direct.shape[1]):
                continue
            if labels[k] == 0:
                direct[row, column] = True
            elif ghosts[row, column] < _FULL:
                ghosts[row, column] += 1
