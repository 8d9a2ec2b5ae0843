"""What a 3D ultrasonic sensor reports of a scene: a few points where sound came back."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Self

import numpy as np

from glassslam.geometry import compose
from glassslam.records import FloatArray, PointSet
from glassslam.simulation.drive import Motion
from glassslam.simulation.scene import Scene, UltrasonicMount
from glassslam.simulation.solids import build_surfaces
from glassslam.simulation.ultrasonic_kernels import Surfaces, listen

_OWN_STREAM = 48
_SPEED_OF_SOUND = 343.0


@dataclass(frozen=True, slots=True)
class UltrasonicModel:
    """Everything the simulation knows of a 3D ultrasonic sensor.

    Attributes
    ----------
    range_max : float
        Farthest echo reported, m.
    half_angle : float
        Echoes come from within this angle of its axis, rad.
    rays : int
        Directions in which a ping looks for something that answers.
    heard : float
        Share of the echoes that are not lost.
    softness : float
        How fast the answer fades with the incidence beyond the limit of a material, rad.
    edge : float
        Nearer to an edge than this a face answers at any incidence, half of the time, m.
    range_noise, angle_noise : float
        Standard deviations, m and rad (each of two angles).
    sources : tuple of str
        Where the figures come from.
    """

    range_max: float = 4.0
    half_angle: float = math.pi / 2
    rays: int = 200
    heard: float = 0.9
    softness: float = math.radians(8.0)
    edge: float = 0.03
    range_noise: float = 0.0025
    angle_noise: float = math.radians(1.2)
    sources: tuple[str, ...] = (
        "range, angles: figures given for a Toposens TS Alpha, 4 m and 90 deg to each side",
        "rate, noise: a recorded Toposens standing still, 20 Hz, 2 mm, 0.4 deg at 1 m, 1.3 deg at 3.7 m",
        "points: 4 a ping in that recording, at most 200 by the maker; 200 directions give 10 to 40",
        "lost echoes, fading, edges: assumed; walls answer where they are square on, as in the recording",
    )


TS_ALPHA = UltrasonicModel()
"""The one sensor known."""


@dataclass(frozen=True, slots=True)
class Ear:
    """A scene as a 3D ultrasonic sensor hears it."""

    surfaces: Surfaces
    mount: UltrasonicMount
    model: UltrasonicModel

    @classmethod
    def build(cls, scene: Scene, mount: UltrasonicMount, model: UltrasonicModel = TS_ALPHA) -> Self:
        """Prepare the faces of a scene."""
        return cls(build_surfaces(scene, model.range_max), mount, model)

    @property
    def origin(self) -> FloatArray:
        """Where the sensor sits in the base frame, m."""
        return np.array([*self.mount.pose[:2], self.mount.height])

    def ping(self, base: FloatArray, random: np.random.Generator) -> FloatArray:
        """Echoes (n, 3) of one ping in the frame of the sensor, m.

        Parameters
        ----------
        base : ndarray of float64, shape (3,)
            Pose of the robot base in the world frame, m and rad.
        random : numpy.random.Generator
            The same number of draws every time, whatever is heard.
        """
        model = self.model
        x, y, yaw = compose(base, np.array(self.mount.pose))
        rays = _directions(model, random)
        draws, noise = random.random(model.rays), random.standard_normal((model.rays, 3))
        near = self._near(x, y)
        distance = np.empty(model.rays)
        listen(
            np.array([x, y, self.mount.height]), _turned(rays, yaw), draws, near,
            model.range_max, model.heard, model.softness, model.edge, distance,
        )  # fmt: skip
        met = np.isfinite(distance)
        return _disturbed(rays[met], distance[met], noise[met], model)

    def _near(self, x: float, y: float) -> Surfaces:
        """The faces within range, seen from above."""
        faces, eye = self.surfaces, np.array([x, y])
        sides = faces.first[:, :2], faces.second[:, :2]
        spread = np.hypot(*sides[0].T) + np.hypot(*sides[1].T)
        close = np.hypot(*(faces.origin[:, :2] - eye).T) <= self.model.range_max + spread
        return Surfaces(*(array[close] for array in faces))


def ultrasonic_records(ear: Ear, motion: Motion, seed: int, start: float) -> Iterator[PointSet]:
    """Pings of the sensor in the order of their stamps, in the frame of the base.

    Parameters
    ----------
    ear : Ear
        The world as the sensor hears it.
    motion : Motion
        The true motion of the base.
    seed : int
        Same seed, same echoes.
    start : float
        Stamp of the first moment, s.
    """
    random = np.random.default_rng([seed, _OWN_STREAM])
    delay = 2.0 * ear.model.range_max / _SPEED_OF_SOUND
    times = np.arange(0.0, float(motion.times[-1]), 1.0 / ear.mount.rate)
    axis = math.cos(ear.mount.pose[2]), math.sin(ear.mount.pose[2]), 0.0
    for time, pose in zip(times, motion.at(times), strict=True):
        points = _turned(ear.ping(pose, random), ear.mount.pose[2]) + ear.origin
        stamp = round(start + float(time), 6)
        yield PointSet(stamp, points.astype(np.float32), ear.origin, stamp + delay, axis)


def _directions(model: UltrasonicModel, random: np.random.Generator) -> FloatArray:
    """Unit rays (n, 3), even over the part of the sphere around +x that the sensor hears."""
    x = 1.0 - random.random(model.rays) * (1.0 - math.cos(model.half_angle))
    turn = 2.0 * math.pi * random.random(model.rays)
    side = np.sqrt(1.0 - x * x)
    return np.stack((x, side * np.cos(turn), side * np.sin(turn)), axis=1)


def _disturbed(
    rays: FloatArray, distance: FloatArray, noise: FloatArray, model: UltrasonicModel
) -> FloatArray:
    """Points with errors of range, azimuth and elevation."""
    azimuth = np.arctan2(rays[:, 1], rays[:, 0]) + model.angle_noise * noise[:, 0]
    elevation = np.arcsin(np.clip(rays[:, 2], -1.0, 1.0)) + model.angle_noise * noise[:, 1]
    reach = distance + model.range_noise * noise[:, 2]
    flat = reach * np.cos(elevation)
    points = np.stack((flat * np.cos(azimuth), flat * np.sin(azimuth), reach * np.sin(elevation)), axis=1)
    # The sensor knows what it can hear: no error takes a point out of its field of view.
    behind = points[:, 0] < reach * math.cos(model.half_angle)
    points[behind, 0] = (reach * math.cos(model.half_angle))[behind]
    return points


def _turned(points: FloatArray, yaw: float) -> FloatArray:
    """Points (n, 3) turned about the vertical, rad."""
    cosine, sine = math.cos(yaw), math.sin(yaw)
    x, y = points[:, 0], points[:, 1]
    return np.stack((cosine * x - sine * y, sine * x + cosine * y, points[:, 2]), axis=1)
