"""The traced light paths against a naive twin that follows every path by recursion."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from optics_worlds import first_surface, plan_of

from detectors.labels import GHOST, GLASS, NO_RETURN, SOLID
from glassslam.simulation import lidar
from glassslam.simulation import optics_kernels as optics
from glassslam.simulation.echo import Optics
from glassslam.simulation.materials import MATERIALS
from glassslam.simulation.trace_kernels import Echoes, Legs, nearest_leg, trace_scan

KINDS = ("plaster", "glass", "clean_glass", "polished_steel", "reflector", "aluminium")


def empty(n):
    return Echoes(
        np.empty(n), np.empty(n), np.empty(n, np.uint8), np.empty(n, np.uint8), np.empty(n, np.int32),
        np.empty(n, np.float32),
    )  # fmt: skip


def first_leg(x, y, dx, dy, beyond, circles):
    best, hit, cosine = math.inf, -1, 0.0
    for index, (cx, cy, radius) in enumerate(circles):
        b = dx * (x - cx) + dy * (y - cy)
        c = (x - cx) ** 2 + (y - cy) ** 2 - radius**2
        if b * b > c and beyond < -b - math.sqrt(b * b - c) < best:
            best, hit = -b - math.sqrt(b * b - c), index
            normal = np.array([x + best * dx - cx, y + best * dy - cy]) / radius
            cosine = -float(normal @ [dx, dy])
    return best, hit, cosine


def naive_echoes(world, x, y, dx, dy, flicker, way=0.0, beyond=0.0, light=1.0, panes=0, bounces=0):
    """All echoes a beam brings back, as (path, level, label, mirrored, segment, along)."""
    plan, s, r, circles, clothes = world
    t, index = first_surface(x, y, dx, dy, beyond, plan.segments)
    leg_t, leg, leg_cosine = first_leg(x, y, dx, dy, beyond, circles)
    path = way + min(t, leg_t)
    if path > r.range_max:
        return
    fall = path**-r.intensity_falloff
    through = GHOST if panes or bounces else SOLID
    if leg_t < t:
        level = light * clothes[leg] * leg_cosine
        if optics.surface_is_heard(level, path, flicker, r):
            yield path, level * fall, through, int(bounces > 0), -1, 0.0
        return
    start, end = plan.segments[index, :2], plan.segments[index, 2:]
    along_wall = (end - start) / np.linalg.norm(end - start)
    normal = np.array([-along_wall[1], along_wall[0]])
    beam, here = np.array([dx, dy]), np.array([x + t * dx, y + t * dy])
    cosine, along = abs(float(beam @ normal)), float((here - start) @ along_wall)
    if s.glass[index]:
        angle = math.atan2(float(beam @ along_wall), cosine)
        level = light * fall * optics.pane_level(
            path, angle, s.lean[index], s.haze[index], s.glint[index], index, along, r
        )  # fmt: skip
        heard = optics.pane_is_heard(level, flicker, r)
        label = GHOST if bounces else GLASS
    else:
        back = light * optics.scatter(
            cosine, s.reflectance[index], s.gloss[index], s.gloss_width[index], s.retro[index]
        )
        heard, level, label = optics.surface_is_heard(back, path, flicker, r), back * fall, through
    if heard:
        yield path, level, label, int(bounces > 0), index, along
    mirrored = optics.fresnel(s.mirrored[index], cosine)
    faintest = r.weakest_echo * path**2 / 8
    if s.sends_on[index] and bounces < 2 and light * mirrored**2 > faintest and abs(s.lean[index]) < 0.03:
        turned = beam - 2 * float(beam @ normal) * normal
        yield from naive_echoes(
            world, *here, *turned, flicker, path, 1e-6, light * mirrored**2, panes, bounces + 1
        )
    if s.glass[index] and light * (1 - mirrored) ** 2 > faintest:
        yield from naive_echoes(
            world, x, y, dx, dy, flicker, way, t + 1e-6, light * (1 - mirrored) ** 2, panes + 1, bounces
        )


@settings(max_examples=60)
@given(seed=st.integers(0, 10**6), sensor=st.sampled_from(["utm30lx", "ust10lx", "rplidar"]))
def test_light_paths_agree_with_the_naive_twin(seed, sensor):
    random, n = np.random.default_rng(seed), 12
    surfaces = [(KINDS[random.integers(len(KINDS))], *random.uniform(-4, 4, 4)) for _ in range(6)]
    made = Optics.build(plan_of(*surfaces), MATERIALS, lidar(sensor))
    circles, clothes = random.uniform([-3, -3, 0.1], [3, 3, 0.4], (2, 3)), np.array([0.3, 0.6])
    legs = Legs(np.column_stack((circles[:, :2], np.zeros((2, 2)), circles[:, 2])), clothes)
    lasers = np.column_stack((random.uniform(-4, 4, (n, 2)), random.uniform(-4, 4, n)))
    flicker, echoes = random.standard_normal(n), empty(n)
    trace_scan(
        lasers, np.zeros(n), np.zeros(n), flicker, made.plan, made.surfaces, legs, made.receiver, echoes
    )
    world = (made.plan, made.surfaces, made.receiver, circles, clothes)
    for k, (x, y, theta) in enumerate(lasers):
        found = list(naive_echoes(world, x, y, math.cos(theta), math.sin(theta), flicker[k]))
        if not found:
            assert echoes.label[k] == NO_RETURN
            continue
        best = max(found, key=lambda e: e[1]) if made.receiver.strongest else min(found)
        assert echoes.path[k] == pytest.approx(best[0], rel=1e-7)
        assert echoes.level[k] == pytest.approx(best[1], rel=1e-5)
        assert (echoes.label[k], echoes.mirrored[k], echoes.segment[k]) == best[2:5]
        assert echoes.along[k] == pytest.approx(best[5], abs=1e-5)


@given(
    st.floats(-3, 3), st.floats(-3, 3), st.floats(-3.2, 3.2), st.floats(-2, 2), st.floats(-2, 2),
    st.floats(0.05, 0.5), st.sampled_from([0.0, 1.0]),
)  # fmt: skip
def test_legs_agree_with_the_naive_twin(x, y, theta, cx, cy, radius, beyond):
    dx, dy = math.cos(theta), math.sin(theta)
    aside = abs((cx - x) * dy - (cy - y) * dx)
    away = math.hypot(cx - x, cy - y)
    if abs(aside - radius) < 1e-6 or abs(away - radius) < 1e-6:  # grazing, or starting on the skin
        return
    expected = first_leg(x, y, dx, dy, beyond, [(cx, cy, radius)])
    found = nearest_leg(x, y, dx, dy, beyond, 0.0, np.array([[cx, cy, 0, 0, radius]]))
    assert found[0] == pytest.approx(expected[0], abs=1e-6)
    assert found[1] == expected[1]
    assert found[2] == pytest.approx(expected[2], abs=1e-5)


def test_a_leg_is_met_where_it_is_at_the_instant_of_the_beam():
    moving = np.array([[2.0, 0.0, 1.0, 0.0, 0.1]])
    assert nearest_leg(0.0, 0.0, 1.0, 0.0, 0.0, 0.0, moving)[0] == pytest.approx(1.9)
    assert nearest_leg(0.0, 0.0, 1.0, 0.0, 0.0, 0.5, moving)[0] == pytest.approx(2.4)
