"""Kernels that count what the beams of a run say about the strip along a line."""

import math

import numpy as np
from numpy.typing import NDArray

from glassslam.accelerate import kernel
from glassslam.records import Float32Array, FloatArray


@kernel
def count_along_line(
    poses: FloatArray,
    sensors: FloatArray,
    points: Float32Array,
    first: NDArray[np.int64],
    chosen: NDArray[np.int64],
    foot: FloatArray,
    direction: FloatArray,
    start: float,
    step: float,
    tolerance: float,
    beyond: float,
    normal_limit: float,
    before: float,
    solid: NDArray[np.int64],
    passed: NDArray[np.int64],
    passed_normal: NDArray[np.int64],
    blocked: NDArray[np.int64],
) -> None:
    """Count returns on a line and beams through it, by pieces of length `step` from `start` on.

    Points `first[n]` .. `first[n + 1]` are those of node n, in the frame of its base. A return within
    `tolerance` of the line counts as solid; a beam that ends `beyond` it counts as passed where it
    crosses, and also as passed at normal incidence when its angle to the normal is below `normal_limit`; one
    that ends at most `before` in front of it counts as blocked where it would have crossed.
    """
    bins = solid.shape[0]
    nx, ny = -direction[1], direction[0]
    offset = nx * foot[0] + ny * foot[1]
    origin = direction[0] * foot[0] + direction[1] * foot[1]
    for n in chosen:
        cosine, sine = math.cos(poses[n, 2]), math.sin(poses[n, 2])
        sx = cosine * sensors[n, 0] - sine * sensors[n, 1] + poses[n, 0]
        sy = sine * sensors[n, 0] + cosine * sensors[n, 1] + poses[n, 1]
        side = nx * sx + ny * sy - offset
        along_sensor = direction[0] * sx + direction[1] * sy - origin
        for k in range(first[n], first[n + 1]):
            px = cosine * points[k, 0] - sine * points[k, 1] + poses[n, 0]
            py = sine * points[k, 0] + cosine * points[k, 1] + poses[n, 1]
            gap = nx * px + ny * py - offset
            along = direction[0] * px + direction[1] * py - origin
            if abs(gap) <= tolerance:
                b = math.floor((along - start) / step)
                if 0 <= b < bins:
                    solid[b] += 1
                continue
            crosses = gap * side < 0.0
            if abs(gap) > before if not crosses else abs(gap) < beyond:
                continue
            if not crosses and abs(side) <= abs(gap):
                continue
            share = side / (side - gap)
            b = math.floor((along_sensor + share * (along - along_sensor) - start) / step)
            if not 0 <= b < bins:
                continue
            if not crosses:
                blocked[b] += 1
            else:
                passed[b] += 1
                if abs(along - along_sensor) < math.tan(normal_limit) * abs(gap - side):
                    passed_normal[b] += 1


@kernel
def count_silent_nodes(
    poses: FloatArray,
    sensors: FloatArray,
    points: Float32Array,
    first: NDArray[np.int64],
    foot: FloatArray,
    direction: FloatArray,
    start: float,
    step: float,
    beyond: float,
    normal_limit: float,
    reach: float,
    last: NDArray[np.int64],
    known: NDArray[np.uint8],
    before: NDArray[np.int64],
    after: NDArray[np.int64],
) -> None:
    """Count the nodes that looked through a line at normal incidence without an answer, by pieces of it.

    Nodes farther than `reach` from the line say nothing, nor does node n about piece b where `known[n, b]` is
    set already: it had an answer, or was counted. Nodes after `last[b]` are counted in `after`, the others in
    `before`.
    """
    bins = last.shape[0]
    nx, ny = -direction[1], direction[0]
    offset = nx * foot[0] + ny * foot[1]
    origin = direction[0] * foot[0] + direction[1] * foot[1]
    slope = math.tan(normal_limit)
    for n in range(poses.shape[0]):
        cosine, sine = math.cos(poses[n, 2]), math.sin(poses[n, 2])
        sx = cosine * sensors[n, 0] - sine * sensors[n, 1] + poses[n, 0]
        sy = sine * sensors[n, 0] + cosine * sensors[n, 1] + poses[n, 1]
        side = nx * sx + ny * sy - offset
        along_sensor = direction[0] * sx + direction[1] * sy - origin
        inside = start - reach <= along_sensor < start + bins * step + reach
        if abs(side) > reach or not inside:
            continue
        for k in range(first[n], first[n + 1]):
            px = cosine * points[k, 0] - sine * points[k, 1] + poses[n, 0]
            py = sine * points[k, 0] + cosine * points[k, 1] + poses[n, 1]
            gap = nx * px + ny * py - offset
            along = direction[0] * px + direction[1] * py - origin
            if gap * side >= 0.0 or abs(gap) < beyond or abs(along - along_sensor) >= slope * abs(gap - side):
                continue
            share = side / (side - gap)
            b = math.floor((along_sensor + share * (along - along_sensor) - start) / step)
            if not 0 <= b < bins or known[n, b]:
                continue
            known[n, b] = 1
            if n > last[b]:
                after[b] += 1
            else:
                before[b] += 1
