"""What a ring of sonars reports of a scene."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from glassslam.geometry import compose
from glassslam.records import Float32Array, FloatArray, RangeRing
from glassslam.simulation.drive import Motion
from glassslam.simulation.floorplan import FloorPlan
from glassslam.simulation.materials import Material
from glassslam.simulation.people import Crowd
from glassslam.simulation.raycast import SegmentGrid
from glassslam.simulation.sonar_kernels import Acoustics, Cone, fire
from glassslam.simulation.sonar_models import SonarModel
from glassslam.simulation.trace_kernels import Plan

_RAY_STEP = math.radians(1.0)
_RESOLUTION = 0.01
_OWN_STREAM = 16
_SPEED_OF_SOUND = 343.0


@dataclass(frozen=True, slots=True)
class SonarArray:
    """A floor plan as one ring of sonars hears it."""

    plan: Plan
    acoustics: Acoustics
    cone: Cone
    model: SonarModel

    @classmethod
    def build(cls, plan: FloorPlan, palette: dict[str, Material], model: SonarModel) -> Self:
        """Prepare the surfaces of a plan for ultrasound."""
        grid = SegmentGrid.build(plan.segments)
        cells = Plan(grid.segments, grid.corner, grid.cell, grid.columns, grid.rows, grid.first, grid.members)
        ring = model.ring
        rays = 1 + 2 * math.ceil(0.5 * ring.field_of_view / _RAY_STEP)
        cone = Cone(0.5 * ring.field_of_view, rays, ring.range_max)
        return cls(cells, _acoustics(plan, palette, ring.range_max), cone, model)

    def fire(
        self, base: FloatArray, group: NDArray[np.int64], circles: FloatArray, random: np.random.Generator
    ) -> Float32Array:
        """One reading of each sonar of a group.

        Parameters
        ----------
        base : ndarray of float64, shape (3,)
            Pose of the robot base in the world frame, m and rad.
        group : ndarray of int64, shape (m,)
            Sonars that fire.
        circles : ndarray of float64, shape (k, 5)
            Legs of people at that moment (see `Legs`).
        random : numpy.random.Generator
            One draw per sonar of the group, whatever it hears.

        Returns
        -------
        ndarray of float32, shape (n,)
            Ranges of all n sonars of the ring, m; NaN for those that did not fire.
        """
        model, ring = self.model, self.model.ring
        sonars = compose(base, ring.poses[group])
        heard = np.empty(len(group))
        fire(np.ascontiguousarray(sonars), self.plan, self.acoustics, circles, self.cone, heard)
        met = np.isfinite(heard)
        path = np.where(met, heard, 1.0)
        bound = np.minimum(model.largest_error, model.relative_error * path + _RESOLUTION)
        error = np.clip(0.5 * bound * random.standard_normal(len(group)), -bound, bound)
        measured = np.round((path + error) / _RESOLUTION) * _RESOLUTION
        measured = np.maximum(measured, ring.range_min)
        out = np.full(len(ring.poses), np.nan, dtype=np.float32)
        out[group] = np.where(met & (measured < ring.range_max), measured, model.no_echo)
        return out


def sonar_records(
    array: SonarArray, motion: Motion, crowd: Crowd, seed: int, start: float
) -> Iterator[RangeRing]:
    """Readings of a ring, one record per group, in the order of their stamps.

    Parameters
    ----------
    array : SonarArray
        The world as the ring hears it.
    motion : Motion
        The true motion of the base.
    crowd : Crowd
        People who walk about.
    seed : int
        Same seed, same readings.
    start : float
        Stamp of the first moment, s.
    """
    random = np.random.default_rng([seed, _OWN_STREAM])
    model, groups = array.model, array.model.groups()
    delay = 2.0 * model.ring.range_max / _SPEED_OF_SOUND
    times = np.arange(0.0, float(motion.times[-1]), model.firing_period)
    poses = motion.at(times)
    for number, (time, pose) in enumerate(zip(times, poses, strict=True)):
        group = groups[number % len(groups)]
        ranges = array.fire(pose, group, crowd.legs(float(time), 1e-3).circles, random)
        stamp = round(start + float(time), 6)
        yield RangeRing(stamp=stamp, ranges=ranges, record_stamp=stamp + delay)


def _acoustics(plan: FloorPlan, palette: dict[str, Material], range_max: float) -> Acoustics:
    made_of = [palette[plan.materials[m]] for m in plan.material]
    return Acoustics(
        limit=np.deg2rad(np.array([material.sonar_limit_deg for material in made_of])),
        reach=range_max * np.array([material.sonar_reach for material in made_of]),
        lean=plan.lean,
    )
