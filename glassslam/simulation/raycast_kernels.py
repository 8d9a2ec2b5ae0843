"""Kernels of ray casting: the first segment a ray meets, found by walking a uniform grid."""

import numpy as np
from numpy.typing import NDArray

from glassslam.accelerate import kernel
from glassslam.records import FloatArray

Int64Array = NDArray[np.int64]


@kernel
def hit_distance(ox: float, oy: float, dx: float, dy: float, segment: FloatArray) -> float:
    """Distance along a unit ray to a segment, inf when they do not meet (or are parallel)."""
    ex, ey = segment[2] - segment[0], segment[3] - segment[1]
    cross = dx * ey - dy * ex
    if cross == 0.0:
        return np.inf
    wx, wy = segment[0] - ox, segment[1] - oy
    along_segment = (wx * dy - wy * dx) / cross
    if along_segment < 0.0 or along_segment > 1.0:
        return np.inf
    return float((wx * ey - wy * ex) / cross)


@kernel
def enter_box(ox: float, oy: float, dx: float, dy: float, width: float, height: float) -> float:
    """Distance at which a ray is first inside [0, width] x [0, height], inf when it never is."""
    near, far = 0.0, np.inf
    for o, d, size in ((ox, dx, width), (oy, dy, height)):
        if d == 0.0:
            if o < 0.0 or o > size:
                return np.inf
        else:
            a, b = -o / d, (size - o) / d
            near, far = max(near, min(a, b)), min(far, max(a, b))
    return near if near <= far else np.inf


@kernel
def nearest_segment(
    ox: float,
    oy: float,
    dx: float,
    dy: float,
    beyond: float,
    segments: FloatArray,
    corner: FloatArray,
    cell: float,
    columns: int,
    rows: int,
    first: Int64Array,
    members: Int64Array,
) -> tuple[float, int]:
    """First segment farther than `beyond` along one unit ray: (distance, index), (inf, -1) for none."""
    gx, gy = (ox - corner[0]) / cell, (oy - corner[1]) / cell
    t = enter_box(gx, gy, dx, dy, float(columns), float(rows))
    best, best_index = np.inf, -1
    if t == np.inf:
        return best, best_index
    i = min(max(int(np.floor(gx + t * dx)), 0), columns - 1)
    j = min(max(int(np.floor(gy + t * dy)), 0), rows - 1)
    step_x, step_y = (1 if dx > 0.0 else -1), (1 if dy > 0.0 else -1)
    next_x = ((i + (step_x > 0)) - gx) / dx if dx != 0.0 else np.inf
    next_y = ((j + (step_y > 0)) - gy) / dy if dy != 0.0 else np.inf
    while 0 <= i < columns and 0 <= j < rows:
        for k in range(first[j * columns + i], first[j * columns + i + 1]):
            index = members[k]
            distance = hit_distance(ox, oy, dx, dy, segments[index])
            if beyond < distance < best or (distance == best and beyond < distance and index < best_index):
                best, best_index = distance, index
        # A segment listed in this cell may be hit in a later one, where something nearer may stand.
        if best <= min(next_x, next_y) * cell:
            break
        if next_x < next_y:
            i, next_x = i + step_x, next_x + step_x / dx
        else:
            j, next_y = j + step_y, next_y + step_y / dy
    return best, best_index


@kernel
def cast(
    origins: FloatArray,
    angles: FloatArray,
    beyond: FloatArray,
    segments: FloatArray,
    corner: FloatArray,
    cell: float,
    columns: int,
    rows: int,
    first: Int64Array,
    members: Int64Array,
    distances: FloatArray,
    hits: Int64Array,
    cosines: FloatArray,
) -> None:
    """Fill distance, segment index and |cosine| of incidence of every ray."""
    for k in range(angles.size):
        dx, dy = np.cos(angles[k]), np.sin(angles[k])
        distance, index = nearest_segment(
            origins[k, 0], origins[k, 1], dx, dy, beyond[k], segments,
            corner, cell, columns, rows, first, members,
        )  # fmt: skip
        distances[k], hits[k], cosines[k] = distance, index, 0.0
        if index >= 0:
            ex = segments[index, 2] - segments[index, 0]
            ey = segments[index, 3] - segments[index, 1]
            cosines[k] = abs(dx * ey - dy * ex) / np.hypot(ex, ey)


@kernel
def clearance(points: FloatArray, segments: FloatArray, out: FloatArray) -> None:
    """Fill the distance from each point to the nearest segment, m."""
    for k in range(points.shape[0]):
        best = np.inf
        for s in range(segments.shape[0]):
            ex, ey = segments[s, 2] - segments[s, 0], segments[s, 3] - segments[s, 1]
            wx, wy = points[k, 0] - segments[s, 0], points[k, 1] - segments[s, 1]
            f = min(max((wx * ex + wy * ey) / (ex * ex + ey * ey), 0.0), 1.0)
            best = min(best, (wx - f * ex) ** 2 + (wy - f * ey) ** 2)
        out[k] = np.sqrt(best)
