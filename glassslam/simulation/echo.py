"""What a lidar reports of a scene: ranges, intensities, and what each beam truly met."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from detectors.labels import GLASS, NO_RETURN
from glassslam.records import Float32Array, FloatArray
from glassslam.simulation.floorplan import FloorPlan
from glassslam.simulation.materials import Material
from glassslam.simulation.optics_kernels import Receiver, Surfaces, lattice
from glassslam.simulation.raycast import SegmentGrid
from glassslam.simulation.sensors import LidarModel
from glassslam.simulation.trace_kernels import Echoes, Legs, Plan, trace_scan


@dataclass(frozen=True, slots=True)
class Observation:
    """One simulated scan and its truth, one entry per beam.

    Attributes
    ----------
    ranges, intensities : ndarray of float32, shape (n,)
        As the lidar reports them; +inf and 0 without echo; intensities empty when it reports none.
    labels : ndarray of uint8, shape (n,)
        SOLID, GLASS, GHOST (through a pane or over a mirror) or NO_RETURN.
    mirrored : ndarray of uint8, shape (n,)
        1 where the echo came over a mirror, so that nothing stands where it is reported.
    segment : ndarray of int32, shape (n,)
        Index of the surface that answered; -1 for none and for people.
    along : ndarray of float32, shape (n,)
        Place on that surface from its first end, m.
    """

    ranges: Float32Array
    intensities: Float32Array
    labels: NDArray[np.uint8]
    mirrored: NDArray[np.uint8]
    segment: NDArray[np.int32]
    along: Float32Array


@dataclass(frozen=True, slots=True)
class Optics:
    """A floor plan as one lidar sees it."""

    plan: Plan
    surfaces: Surfaces
    receiver: Receiver
    model: LidarModel

    @classmethod
    def build(cls, plan: FloorPlan, palette: dict[str, Material], model: LidarModel) -> Self:
        """Prepare the surfaces of a plan for tracing."""
        grid = SegmentGrid.build(plan.segments)
        cells = Plan(grid.segments, grid.corner, grid.cell, grid.columns, grid.rows, grid.first, grid.members)
        return cls(cells, surface_table(plan, palette), receiver_of(model), model)

    def observe(self, lasers: FloatArray, legs: Legs, random: np.random.Generator) -> Observation:
        """One scan from the poses of the laser at the instants of its beams.

        Parameters
        ----------
        lasers : ndarray of float64, shape (n, 3)
            Pose of the laser at each of the n beams, world frame.
        legs : Legs
            People at the instant of the first beam.
        random : numpy.random.Generator
            Three draws per beam, whatever it met, so that one beam does not change the noise of others.
        """
        model, n = self.model, len(lasers)
        noise = random.standard_normal((3, n))
        beam = np.arange(n, dtype=np.float64)
        echoes = Echoes(
            np.empty(n), np.empty(n), np.empty(n, np.uint8), np.empty(n, np.uint8), np.empty(n, np.int32),
            np.empty(n, np.float32),
        )  # fmt: skip
        bearings = model.angle_min + beam * model.angle_increment
        times = beam * model.time_increment
        trace_scan(
            np.ascontiguousarray(lasers), bearings, times, noise[0],
            self.plan, self.surfaces, legs, self.receiver, echoes,
        )  # fmt: skip
        return _measured(echoes, noise, model)


def _measured(echoes: Echoes, noise: FloatArray, model: LidarModel) -> Observation:
    """Echoes with the noise, the steps and the limits of the lidar."""
    met = echoes.label != NO_RETURN
    path = np.where(met, echoes.path, 1.0)
    own = np.where(echoes.label == GLASS, model.glint_noise, 0.0)
    spread = np.sqrt(model.noise_floor**2 + (model.noise_slope * path) ** 2 + own**2)
    measured = np.round((path + spread * noise[1]) / model.resolution) * model.resolution
    seen = met & (measured >= model.range_min) & (measured <= model.range_max)
    level = model.intensity_at_1m * echoes.level * np.exp(model.intensity_noise * noise[2])
    level = np.where(seen, np.clip(np.round(level), 1, max(model.intensity_max, 1.0)), 0.0)
    return Observation(
        ranges=np.where(seen, measured, np.inf).astype(np.float32),
        intensities=level.astype(np.float32) if model.intensity_at_1m else np.empty(0, dtype=np.float32),
        labels=np.where(seen, echoes.label, NO_RETURN).astype(np.uint8),
        mirrored=np.where(seen, echoes.mirrored, 0).astype(np.uint8),
        segment=np.where(seen, echoes.segment, -1).astype(np.int32),
        along=echoes.along,
    )


def surface_table(plan: FloorPlan, palette: dict[str, Material]) -> Surfaces:
    """Figures of every segment; each pane leans a little on its own, the same in every recording."""
    made_of = [palette[plan.materials[m]] for m in plan.material]
    flatness = np.deg2rad([material.flatness_deg for material in made_of])
    own_lean = flatness * np.array([lattice(k, -1) for k in range(len(made_of))])

    def column(name: str) -> FloatArray:
        return np.array([getattr(material, name) for material in made_of], dtype=np.float64)

    glass = np.array([material.kind == "glass" for material in made_of], dtype=np.bool_)
    return Surfaces(
        reflectance=column("reflectance"),
        gloss=column("gloss"),
        gloss_width=np.deg2rad(column("gloss_width_deg")),
        retro=column("retro"),
        mirrored=column("mirrored"),
        haze=column("haze"),
        glint=column("glint"),
        lean=plan.lean + own_lean,
        glass=glass,
        sends_on=glass | (column("mirrored") > 0.0),
    )


def receiver_of(model: LidarModel) -> Receiver:
    """The figures of a lidar in the form the kernels take."""
    return Receiver(
        range_max=model.range_max,
        weakest_echo=model.weakest_echo,
        intensity_falloff=model.intensity_falloff,
        intensity_noise=model.intensity_noise,
        glint_gain=model.glint_gain,
        weakest_glint=model.weakest_glint,
        glint_wander=model.glint_wander,
        aperture=model.aperture,
        divergence=model.divergence,
        strongest=model.echo == "strongest",
    )
