"""Kernels of light paths: what one beam of a scan brings back through panes and over mirrors."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from detectors.labels import GHOST, GLASS, NO_RETURN, SOLID
from glassslam.accelerate import kernel
from glassslam.records import Float32Array, FloatArray
from glassslam.simulation import optics_kernels as optics
from glassslam.simulation.optics_kernels import Receiver, Surfaces
from glassslam.simulation.raycast_kernels import nearest_segment

_STACK = 16
_STEPS = 32
_BOUNCES = 2
_ON = 1e-6
_BRIGHTEST = 8.0
_UPRIGHT = 0.03


class Plan(NamedTuple):
    """Segments sorted into cells (see `SegmentGrid`)."""

    segments: FloatArray
    corner: FloatArray
    cell: float
    columns: int
    rows: int
    first: NDArray[np.int64]
    members: NDArray[np.int64]


class Legs(NamedTuple):
    """Moving circles at the start of the scan: rows x, y, velocity, radius; and their reflectance."""

    circles: FloatArray
    reflectance: FloatArray


class Echoes(NamedTuple):
    """What the beams of one scan bring back, filled by `trace_scan`, one entry per beam."""

    path: FloatArray
    """Length of the way to the surface, m; inf without echo."""
    level: FloatArray
    """Signal against white paper at 1 m, square on."""
    label: NDArray[np.uint8]
    mirrored: NDArray[np.uint8]
    segment: NDArray[np.int32]
    """Surface that answered, -1 for none and for people."""
    along: Float32Array
    """Place on that segment from its first end, m."""


@kernel
def nearest_leg(
    ox: float, oy: float, dx: float, dy: float, beyond: float, time: float, circles: FloatArray
) -> tuple[float, int, float]:
    """First circle farther than `beyond` at a time: (distance, index, cosine of incidence)."""
    best, found, cosine = np.inf, -1, 0.0
    for k in range(circles.shape[0]):
        wx = circles[k, 0] + time * circles[k, 2] - ox
        wy = circles[k, 1] + time * circles[k, 3] - oy
        radius = circles[k, 4]
        ahead, aside = wx * dx + wy * dy, wx * dy - wy * dx
        if abs(aside) >= radius:
            continue
        half = np.sqrt(radius**2 - aside**2)
        if beyond < ahead - half < best:
            best, found, cosine = ahead - half, k, half / radius
    return best, found, cosine


@kernel
def answer(
    index: int, hx: float, hy: float, dx: float, dy: float, path: float, light: float, flicker: float,
    plan: Plan, surfaces: Surfaces, receiver: Receiver,
) -> tuple[float, bool, float, float, float, float]:  # fmt: skip
    """What a segment sends back when light meets it at h: level, heard, along, |cosine|, its direction."""
    ex = plan.segments[index, 2] - plan.segments[index, 0]
    ey = plan.segments[index, 3] - plan.segments[index, 1]
    length = np.hypot(ex, ey)
    ex, ey = ex / length, ey / length
    along = (hx - plan.segments[index, 0]) * ex + (hy - plan.segments[index, 1]) * ey
    cosine = min(abs(dx * ey - dy * ex), 1.0)
    fall = path**-receiver.intensity_falloff
    if surfaces.glass[index]:
        angle = np.arctan2(dx * ex + dy * ey, cosine)
        level = light * fall * optics.pane_level(
            path, angle, surfaces.lean[index], surfaces.haze[index], surfaces.glint[index], index, along,
            receiver,
        )  # fmt: skip
        return level, optics.pane_is_heard(level, flicker, receiver), along, cosine, ex, ey
    share = light * optics.scatter(
        cosine, surfaces.reflectance[index], surfaces.gloss[index], surfaces.gloss_width[index],
        surfaces.retro[index],
    )  # fmt: skip
    heard = optics.surface_is_heard(share, path, flicker, receiver)
    return share * fall, heard, along, cosine, ex, ey


@kernel
def keep(
    k: int, path: float, level: float, index: int, along: float, glass: bool, panes: float, bounces: float,
    echoes: Echoes,
) -> None:  # fmt: skip
    """Make this the echo of beam k; all that came through a pane or over a mirror is a ghost."""
    echoes.path[k], echoes.level[k], echoes.segment[k], echoes.along[k] = path, level, index, along
    echoes.mirrored[k] = 1 if bounces > 0 else 0
    if bounces > 0 or (panes > 0 and not glass):
        echoes.label[k] = GHOST
    else:
        echoes.label[k] = GLASS if glass else SOLID


@kernel
def push(
    stack: FloatArray, depth: int, x: float, y: float, dx: float, dy: float, beyond: float, before: float,
    light: float, panes: float, bounces: float,
) -> int:  # fmt: skip
    """Put a way still to be followed on the stack; one too many is forgotten."""
    if depth >= stack.shape[0]:
        return depth
    stack[depth, 0], stack[depth, 1], stack[depth, 2], stack[depth, 3] = x, y, dx, dy
    stack[depth, 4], stack[depth, 5], stack[depth, 6] = beyond, before, light
    stack[depth, 7], stack[depth, 8] = panes, bounces
    return depth + 1


@kernel
def follow(
    k: int, time: float, flicker: float, depth: int, plan: Plan, surfaces: Surfaces, legs: Legs,
    receiver: Receiver, stack: FloatArray, echoes: Echoes,
) -> int:  # fmt: skip
    """Follow the way on top of the stack to the next surface; returns the new depth of the stack."""
    depth -= 1
    x, y, dx, dy, beyond = (
        stack[depth, 0], stack[depth, 1], stack[depth, 2], stack[depth, 3], stack[depth, 4],
    )  # fmt: skip
    before, light, panes, bounces = stack[depth, 5], stack[depth, 6], stack[depth, 7], stack[depth, 8]
    distance, index = nearest_segment(
        x, y, dx, dy, beyond, plan.segments, plan.corner, plan.cell, plan.columns, plan.rows,
        plan.first, plan.members,
    )  # fmt: skip
    to_leg, leg, leg_cosine = nearest_leg(x, y, dx, dy, beyond, time, legs.circles)
    path = before + min(distance, to_leg)
    if path > receiver.range_max or (path >= echoes.path[k] and not receiver.strongest):
        return depth
    if to_leg < distance:
        share = light * legs.reflectance[leg] * leg_cosine
        level = share * path**-receiver.intensity_falloff
        if (
            optics.surface_is_heard(share, path, flicker, receiver)
            and level > echoes.level[k] * receiver.strongest
        ):
            keep(k, path, level, -1, 0.0, False, panes, bounces, echoes)
        return depth
    hx, hy = x + distance * dx, y + distance * dy
    level, heard, along, cosine, ex, ey = answer(
        index, hx, hy, dx, dy, path, light, flicker, plan, surfaces, receiver
    )
    glass = surfaces.glass[index]
    if heard and level > echoes.level[k] * receiver.strongest:
        keep(k, path, level, index, along, glass, panes, bounces, echoes)
    if not surfaces.sends_on[index]:
        return depth
    mirrored = optics.fresnel(surfaces.mirrored[index], cosine)
    back, through = light * mirrored**2, light * (1.0 - mirrored) ** 2
    faintest = receiver.weakest_echo * path**2 / _BRIGHTEST
    # The mirrored beam of a leaning pane leaves the plane of the scan.
    if bounces < _BOUNCES and back > faintest and abs(surfaces.lean[index]) < _UPRIGHT:
        turn = 2.0 * (dx * ex + dy * ey)
        depth = push(
            stack, depth, hx, hy, turn * ex - dx, turn * ey - dy, _ON, path, back, panes, bounces + 1.0
        )
    if glass and through > faintest:
        depth = push(stack, depth, x, y, dx, dy, distance + _ON, before, through, panes + 1.0, bounces)
    return depth


@kernel
def trace_scan(
    lasers: FloatArray,
    bearings: FloatArray,
    times: FloatArray,
    flicker: FloatArray,
    plan: Plan,
    surfaces: Surfaces,
    legs: Legs,
    receiver: Receiver,
    echoes: Echoes,
) -> None:
    """Trace all beams: poses of the laser (n, 3), bearings in its frame and times since the first beam."""
    # Columns: origin, direction, start of the search, way before the origin, share of light, panes, bounces.
    stack = np.empty((_STACK, 9))
    for k in range(bearings.size):
        echoes.path[k], echoes.level[k], echoes.label[k] = np.inf, 0.0, NO_RETURN
        echoes.mirrored[k], echoes.segment[k], echoes.along[k] = 0, -1, 0.0
        theta = lasers[k, 2] + bearings[k]
        depth = push(
            stack, 0, lasers[k, 0], lasers[k, 1], np.cos(theta), np.sin(theta), 0.0, 0.0, 1.0, 0.0, 0.0
        )
        steps = 0
        while depth > 0 and steps < _STEPS:
            depth = follow(k, times[k], flicker[k], depth, plan, surfaces, legs, receiver, stack, echoes)
            steps += 1
