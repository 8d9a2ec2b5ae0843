"""Kernels of ultrasound: what a fan of rays through the cone of a sonar brings back."""

from typing import NamedTuple

import numpy as np

from glassslam.accelerate import kernel
from glassslam.records import FloatArray
from glassslam.simulation.raycast_kernels import nearest_segment
from glassslam.simulation.trace_kernels import Plan, nearest_leg

_ON = 1e-6
_MEMBRANE = 0.15
_SAME_PLACE = 1e-3


class Acoustics(NamedTuple):
    """How every segment of a plan answers ultrasound, one entry per segment."""

    limit: FloatArray
    """Largest incidence at which sound comes straight back, rad."""
    reach: FloatArray
    """Farthest path at which its echo is still heard, m."""
    lean: FloatArray
    """Angle of the surface with the vertical, rad."""


class Cone(NamedTuple):
    """What all sonars of a ring have in common."""

    half_angle: float
    """Half of the field of view, rad."""
    rays: int
    """Rays that stand for the cone."""
    range_max: float


@kernel
def meet(x: float, y: float, dx: float, dy: float, plan: Plan) -> tuple[float, int]:
    """First segment along a unit ray: (distance, index), (inf, -1) for none."""
    return nearest_segment(
        x, y, dx, dy, _ON, plan.segments, plan.corner, plan.cell, plan.columns, plan.rows,
        plan.first, plan.members,
    )  # fmt: skip


@kernel
def incidence(dx: float, dy: float, index: int, plan: Plan) -> float:
    """Angle between a unit ray and the normal of a segment, rad."""
    ex = plan.segments[index, 2] - plan.segments[index, 0]
    ey = plan.segments[index, 3] - plan.segments[index, 1]
    return float(np.arccos(min(abs(dx * ey - dy * ex) / np.hypot(ex, ey), 1.0)))


@kernel
def mirror(dx: float, dy: float, index: int, plan: Plan) -> tuple[float, float]:
    """Direction of a unit ray after a segment has mirrored it."""
    ex = plan.segments[index, 2] - plan.segments[index, 0]
    ey = plan.segments[index, 3] - plan.segments[index, 1]
    twice = 2.0 * (dx * ex + dy * ey) / (ex * ex + ey * ey)
    return twice * ex - dx, twice * ey - dy


@kernel
def answers(index: int, angle: float, path: float, acoustics: Acoustics, cone: Cone) -> bool:
    """Whether a segment met at an incidence (rad) after a path (m) is heard.

    A surface that leans still shows its normal to a ray that climbs or falls within the cone.
    """
    upright = abs(acoustics.lean[index]) <= cone.half_angle + acoustics.limit[index]
    return bool(upright and angle <= acoustics.limit[index] and path <= acoustics.reach[index])


@kernel
def second_bounce(
    x: float, y: float, dx: float, dy: float, distance: float, index: int, plan: Plan, acoustics: Acoustics,
    cone: Cone,
) -> float:  # fmt: skip
    """Half the way of sound a surface mirrored away that comes back over another one, inf for none.

    It comes back the way it went when it meets the second surface square on, and over both surfaces when
    they form a corner, provided it passes the membrane.
    """
    mx, my = mirror(dx, dy, index, plan)
    hx, hy = x + distance * dx, y + distance * dy
    onward, second = meet(hx, hy, mx, my, plan)
    if second < 0 or distance + onward > cone.range_max:
        return np.inf
    if answers(second, incidence(mx, my, second, plan), distance + onward, acoustics, cone):
        return distance + onward
    bx, by = mirror(mx, my, second, plan)
    wx, wy = x - (hx + onward * mx), y - (hy + onward * my)
    home, aside = wx * bx + wy * by, abs(wx * by - wy * bx)
    if home <= 0.0 or aside > _MEMBRANE or -(bx * dx + by * dy) < np.cos(cone.half_angle):
        return np.inf
    half = 0.5 * (distance + onward + np.hypot(wx, wy))
    return half if half <= min(acoustics.reach[index], acoustics.reach[second]) else np.inf


@kernel
def ray_echo(
    x: float, y: float, dx: float, dy: float, plan: Plan, acoustics: Acoustics, circles: FloatArray,
    cone: Cone,
) -> float:  # fmt: skip
    """Range of the echo that one ray of a cone brings back, inf for none."""
    to_leg, leg, _ = nearest_leg(x, y, dx, dy, 0.0, 0.0, circles)
    distance, index = meet(x, y, dx, dy, plan)
    if min(distance, to_leg) > cone.range_max:
        return np.inf
    if leg >= 0 and to_leg < distance:
        return to_leg
    if answers(index, incidence(dx, dy, index, plan), distance, acoustics, cone):
        return distance
    return second_bounce(x, y, dx, dy, distance, index, plan, acoustics, cone)


@kernel
def overheard(
    x: float, y: float, dx: float, dy: float, listener: FloatArray, plan: Plan, acoustics: Acoustics,
    cone: Cone,
) -> float:  # fmt: skip
    """Range at which another sonar, fired at the same moment, takes the echo of this ray for its own."""
    distance, index = meet(x, y, dx, dy, plan)
    if index < 0:
        return np.inf
    wx, wy = x + distance * dx - listener[0], y + distance * dy - listener[1]
    way = np.hypot(wx, wy)
    half = 0.5 * (distance + way)
    if half > cone.range_max or way <= _SAME_PLACE:
        return np.inf
    wx, wy = wx / way, wy / way
    if wx * np.cos(listener[2]) + wy * np.sin(listener[2]) < np.cos(cone.half_angle):
        return np.inf
    # A surface sends sound from one sonar to the other when its normal halves the angle between them.
    norm = np.hypot(wx + dx, wy + dy)
    if norm < _ON:
        return np.inf
    angle = incidence((wx + dx) / norm, (wy + dy) / norm, index, plan)
    if not answers(index, angle, half, acoustics, cone):
        return np.inf
    seen, _ = meet(listener[0], listener[1], wx, wy, plan)
    return half if seen >= way - _SAME_PLACE else np.inf


@kernel
def fire(
    sonars: FloatArray, plan: Plan, acoustics: Acoustics, circles: FloatArray, cone: Cone, ranges: FloatArray
) -> None:
    """Fill the range of the first echo of each sonar of a group fired at once, inf for none.

    Poses (n, 3) of the sonars in the world frame; legs as circles (k, 5) at that moment.
    """
    ranges[:] = np.inf
    for emitter in range(sonars.shape[0]):
        x, y = sonars[emitter, 0], sonars[emitter, 1]
        for ray in range(cone.rays):
            aside = (2.0 * ray / max(cone.rays - 1, 1) - 1.0) * cone.half_angle if cone.rays > 1 else 0.0
            dx, dy = np.cos(sonars[emitter, 2] + aside), np.sin(sonars[emitter, 2] + aside)
            own = ray_echo(x, y, dx, dy, plan, acoustics, circles, cone)
            ranges[emitter] = min(ranges[emitter], own)
            for listener in range(sonars.shape[0]):
                if listener != emitter:
                    heard = overheard(x, y, dx, dy, sonars[listener], plan, acoustics, cone)
                    ranges[listener] = min(ranges[listener], heard)
