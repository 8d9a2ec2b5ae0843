"""Kernels that walk rays through voxels."""

import math

from glassslam.accelerate import kernel
from glassslam.records import Float32Array, FloatArray
from glassslam.volume.octree_kernels import Int64Array, spread

RECENT = 1 << 14
"""Slots of the table of voxels freed last; a power of two."""


@kernel
def first_crossing(start: float, end: float) -> tuple[float, float]:
    """Where along a ray, from 0 to 1, an axis first changes voxel, and how far it is between changes."""
    if math.floor(start) == math.floor(end):
        return math.inf, math.inf
    step = abs(1.0 / (end - start))
    ahead = math.floor(start) + 1 - start if end > start else start - math.floor(start)
    return ahead * step, step


@kernel
def trace_ray(start: FloatArray, end: FloatArray, path: Int64Array) -> int:
    """Codes of the voxels from one point to another, both given in voxels (Amanatides and Woo 1987).

    The path has one voxel per step along an axis and never leaves the box of its end voxels, whatever
    the rounding: an axis that has reached its last voxel is stepped no more.
    """
    x, y, z = math.floor(start[0]), math.floor(start[1]), math.floor(start[2])
    last_x, last_y, last_z = math.floor(end[0]), math.floor(end[1]), math.floor(end[2])
    next_x, delta_x = first_crossing(start[0], end[0])
    next_y, delta_y = first_crossing(start[1], end[1])
    next_z, delta_z = first_crossing(start[2], end[2])
    step_x, step_y, step_z = 1 if last_x > x else -1, 1 if last_y > y else -1, 1 if last_z > z else -1
    count = int(abs(last_x - x) + abs(last_y - y) + abs(last_z - z) + 1)
    for k in range(count):
        path[k] = spread(x) | spread(y) << 1 | spread(z) << 2
        if next_x <= next_y and next_x <= next_z:
            x += step_x
            next_x = next_x + delta_x if x != last_x else math.inf
        elif next_y <= next_z:
            y += step_y
            next_y = next_y + delta_y if y != last_y else math.inf
        else:
            z += step_z
            next_z = next_z + delta_z if z != last_z else math.inf
    return count


@kernel
def trace_rays(
    origin: FloatArray,
    ends: FloatArray,
    echoes: int,
    path: Int64Array,
    recent: Int64Array,
    out: Int64Array,
) -> int:
    """Write what rays say of voxels, as 2 * code for the end of an echo and 2 * code + 1 for a free voxel.

    The first `echoes` rays end in an echo, the others in free space. A voxel freed shortly before is
    left out, which spares most of the repeats near the sensor; `recent` must be all -1. The number of
    entries is returned.
    """
    count = 0
    for k in range(ends.shape[0]):
        length = trace_ray(origin, ends[k], path)
        if k < echoes:
            length -= 1
            out[count] = 2 * path[length]
            count += 1
        for i in range(length):
            slot = (path[i] * 0x9E3779B97F4A7C1 >> 20) & (RECENT - 1)
            if recent[slot] != path[i]:
                recent[slot] = path[i]
                out[count] = 2 * path[i] + 1
                count += 1
    return count


@kernel
def merge_first(entries: Int64Array) -> int:
    """Keep, of sorted entries, the first of each voxel; how many remain."""
    count = 0
    for k in range(entries.size):
        if count == 0 or entries[k] >> 1 != entries[count - 1] >> 1:
            entries[count] = entries[k]
            count += 1
    return count


@kernel
def join_sorted(
    codes_a: Int64Array,
    values_a: Float32Array,
    codes_b: Int64Array,
    values_b: Float32Array,
    codes: Int64Array,
    first: Float32Array,
    second: Float32Array,
) -> int:
    """Union of two increasing lists of codes with the value of each list there, 0 where it has none."""
    i = j = count = 0
    while i < codes_a.size or j < codes_b.size:
        take_a = j == codes_b.size or (i < codes_a.size and codes_a[i] <= codes_b[j])
        take_b = i == codes_a.size or (j < codes_b.size and codes_b[j] <= codes_a[i])
        codes[count] = codes_a[i] if take_a else codes_b[j]
        first[count] = values_a[i] if take_a else 0.0
        second[count] = values_b[j] if take_b else 0.0
        i, j, count = i + take_a, j + take_b, count + 1
    return count
