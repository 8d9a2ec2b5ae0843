"""People who walk through a scene: each a pair of moving circles."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from glassslam.records import FloatArray
from glassslam.simulation.scene import Person, Scene
from glassslam.simulation.trace_kernels import Legs

_STEP_LENGTH = 0.7
_SWING = 0.25


@dataclass(frozen=True, slots=True)
class Crowd:
    """Everybody who walks in a scene.

    Attributes
    ----------
    people : tuple of Person
        Their lines and speeds.
    reflectance : ndarray of float64, shape (2 k,)
        Of each leg's clothes.
    """

    people: tuple[Person, ...]
    reflectance: FloatArray

    @classmethod
    def of(cls, scene: Scene) -> Self:
        """The people of a scene."""
        palette = scene.palette()
        levels = [palette[person.material].reflectance for person in scene.people]
        return cls(scene.people, np.repeat(np.array(levels, dtype=np.float64), 2))

    def legs(self, time: float, sweep: float) -> Legs:
        """Circles (x, y, vx, vy, radius) at a time since the start, moving evenly over a sweep."""
        if not self.people:
            return Legs(np.empty((0, 5)), self.reflectance)
        now = feet(self.people, time)
        then = feet(self.people, time + sweep)
        radii = np.repeat([person.leg_radius for person in self.people], 2)
        return Legs(np.column_stack((now, (then - now) / sweep, radii)), self.reflectance)


def feet(people: Sequence[Person], time: float) -> FloatArray:
    """Centres (2 k, 2) of the legs of k people at a time since the start, world frame, m."""
    return np.concatenate([_feet_of(person, time) for person in people])


def _feet_of(person: Person, time: float) -> FloatArray:
    points = np.array(person.points)
    line = np.vstack((points, points[-2::-1]))
    marks = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))))
    walked = person.start + person.speed * time
    s = walked % marks[-1]
    k = min(int(np.searchsorted(marks, s, side="right")) - 1, len(line) - 2)
    ahead = (line[k + 1] - line[k]) / (marks[k + 1] - marks[k])
    aside = np.array([-ahead[1], ahead[0]]) * (person.stance / 2)
    swing = _SWING * np.sin(np.pi * walked / _STEP_LENGTH) * ahead
    body = line[k] + (s - marks[k]) * ahead
    return np.stack((body + aside + swing, body - aside - swing))
