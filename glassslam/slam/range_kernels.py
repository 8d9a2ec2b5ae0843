"""Kernels that turn beams into points and thin them."""

import math

import numpy as np
from numpy.typing import NDArray

from glassslam.accelerate import kernel
from glassslam.records import Float32Array, FloatArray


@kernel
def beams_to_points(
    ranges: Float32Array,
    angle_min: float,
    increment: float,
    time_increment: float,
    base_from_laser: FloatArray,
    twist: FloatArray,
    nearest: float,
    farthest: float,
    no_echo: float,
    ray_length: float,
    errors: FloatArray,
    points: FloatArray,
    free: FloatArray,
) -> tuple[int, int]:
    """Write returns and free-ray ends in the base frame at the stamp of the scan; the two counts.

    The base moves with a constant twist during the sweep. A reading of at least `farthest` or `no_echo`
    clears `ray_length`, but no farther than itself and `no_echo`; NaN, -inf, 0 and readings below `nearest`
    say nothing. `errors` of the beams are bearing cosine and sine, lateral and range offset.
    """
    hits = silent = 0
    erring = errors[0] != 0.0 or errors[1] != 0.0 or errors[2] != 0.0 or errors[3] != 0.0
    cosine, sine = math.cos(base_from_laser[2]), math.sin(base_from_laser[2])
    for k in range(ranges.shape[0]):
        r = np.float64(ranges[k])
        if not r > 0.0 or r < nearest:
            continue
        echo = r < farthest and r < no_echo
        length = r + errors[3] if echo else min(r, no_echo, ray_length)
        if length <= 0.0:
            continue
        angle = angle_min + k * increment
        if erring:
            angle += errors[0] * math.cos(angle) + errors[1] * math.sin(angle)
        ca, sa = math.cos(angle), math.sin(angle)
        lx, ly = length * ca, length * sa
        if erring:
            lx, ly = lx - errors[2] * sa, ly + errors[2] * ca
        bx = cosine * lx - sine * ly + base_from_laser[0]
        by = sine * lx + cosine * ly + base_from_laser[1]
        if time_increment != 0.0:
            t = k * time_increment
            turn = twist[2] * t
            half = 0.5 * turn
            ct, st = math.cos(turn), math.sin(turn)
            ch, sh = math.cos(half), math.sin(half)
            # the chord of the arc travelled is shorter than the arc, and points halfway
            chord = t * sh / half if half != 0.0 else t
            mx, my = twist[0] * chord, twist[1] * chord
            bx, by = ct * bx - st * by + ch * mx - sh * my, st * bx + ct * by + sh * mx + ch * my
        if echo:
            points[hits, 0], points[hits, 1] = bx, by
            hits += 1
        else:
            free[silent, 0], free[silent, 1] = bx, by
            silent += 1
    return hits, silent


@kernel
def voxel_filter(points: FloatArray, edge: float) -> NDArray[np.int64]:
    """Indices of the first point in every voxel, in order (open-addressing hash of the voxel numbers)."""
    count = points.shape[0]
    size = 1
    while size < 2 * count:
        size *= 2
    keys = np.full(size, np.int64(-1))
    kept = np.empty(count, dtype=np.int64)
    n = 0
    for k in range(count):
        i = np.int64(math.floor(points[k, 0] / edge)) + (1 << 30)
        j = np.int64(math.floor(points[k, 1] / edge)) + (1 << 30)
        key = (i << 31) ^ j
        slot = ((key * np.int64(-7046029254386353131)) >> 20) & (size - 1)
        while keys[slot] != -1 and keys[slot] != key:
            slot = (slot + 1) & (size - 1)
        if keys[slot] == -1:
            keys[slot] = key
            kept[n] = k
            n += 1
    return kept[:n]
