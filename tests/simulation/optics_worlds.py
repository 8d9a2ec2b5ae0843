"""Worlds of a few surfaces, and beams sent at them from chosen ranges and angles."""

import math
from dataclasses import replace

import numpy as np

from glassslam.simulation import lidar
from glassslam.simulation.echo import Observation, Optics
from glassslam.simulation.floorplan import FloorPlan
from glassslam.simulation.materials import MATERIALS
from glassslam.simulation.sensors import LidarModel
from glassslam.simulation.trace_kernels import Legs

SPACING = 40.0
NOBODY = Legs(np.empty((0, 5)), np.empty(0))


def plan_of(*surfaces, lean_deg=0.0) -> FloorPlan:
    """A plan of (material, x0, y0, x1, y1)."""
    names = tuple(dict.fromkeys(material for material, *_ in surfaces))
    return FloorPlan(
        segments=np.array([ends for _, *ends in surfaces], dtype=np.float64),
        names=tuple(material for material, *_ in surfaces),
        materials=names,
        material=np.array([names.index(material) for material, *_ in surfaces]),
        lean=np.full(len(surfaces), np.deg2rad(lean_deg)),
    )


def many(material: str, count: int = 150, lean_deg: float = 0.0) -> FloorPlan:
    """Surfaces of 1 m along y = 0, so far apart that a beam meets one at most."""
    return plan_of(*((material, SPACING * k, 0, SPACING * k + 1, 0) for k in range(count)), lean_deg=lean_deg)


def model_of(sensor, beams: int, **changes) -> LidarModel:
    model = sensor if isinstance(sensor, LidarModel) else lidar(sensor)
    return replace(model, angle_min=0.0, angle_increment=0.0, beams=beams, **changes)


def facing(plan, sensor, ranges, angles_deg, *, n=6000, seed=0, material_table=MATERIALS) -> Observation:
    """Beams that meet surfaces of `many` at ranges and incidences drawn evenly from two intervals."""
    random = np.random.default_rng(seed)
    distance = random.uniform(*ranges, n)
    angle = np.deg2rad(random.uniform(*angles_deg, n)) * random.choice([-1, 1], n)
    place = SPACING * random.integers(0, len(plan.segments), n) + random.uniform(0.02, 0.98, n)
    heading = np.pi / 2 + angle
    lasers = np.stack((place - distance * np.cos(heading), -distance * np.sin(heading), heading), axis=1)
    return Optics.build(plan, material_table, model_of(sensor, n)).observe(lasers, NOBODY, random)


def look(plan, sensor, x, y, bearings_deg, *, legs=NOBODY, seed=0, material_table=MATERIALS) -> Observation:
    """Beams from one place in the given directions, one after the other at the rate of the sensor."""
    bearings = np.deg2rad(np.asarray(bearings_deg, dtype=np.float64))
    lasers = np.stack((np.full(bearings.size, x), np.full(bearings.size, y), bearings), axis=1)
    optics = Optics.build(plan, material_table, model_of(sensor, bearings.size))
    return optics.observe(lasers, legs, np.random.default_rng(seed))


def first_surface(x, y, dx, dy, beyond, segments) -> tuple[float, int]:
    """The nearest segment along a ray: each, one after the other, as a 2 x 2 system of equations."""
    best, hit = math.inf, -1
    for index, (x0, y0, x1, y1) in enumerate(segments):
        matrix = np.array([[dx, x0 - x1], [dy, y0 - y1]])
        if abs(np.linalg.det(matrix)) < 1e-12:
            continue
        t, f = np.linalg.solve(matrix, [x0 - x, y0 - y])
        if 0 <= f <= 1 and beyond < t < best:
            best, hit = t, index
    return best, hit
