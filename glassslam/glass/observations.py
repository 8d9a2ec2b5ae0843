"""Glass observations of a whole run, each bound to the node near which it was made.

An observation never stores where it is in the map. It is kept in the frame of its node, so that its
place follows the graph: after every optimisation it is asked for anew. Stored global coordinates go
stale with the next loop closure, which Weerakoon et al. call an unsolved problem.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Final

import numpy as np
from numpy.typing import NDArray

from glassslam.geometry import wrap_angle
from glassslam.records import FloatArray

LIDAR: Final = 0
SONAR: Final = 1


@dataclass(frozen=True, slots=True)
class GlassObservations:
    """Oriented pieces of glass surface.

    Attributes
    ----------
    node : ndarray of int64, shape (k,)
        The node each observation is bound to.
    position : ndarray of float64, shape (k, 2)
        Point on the surface in the frame of the base at that node, m.
    normal : ndarray of float64, shape (k,)
        Direction of the surface normal, from the sensor to the surface, in the same frame, rad.
    sensor : ndarray of float64, shape (k, 2)
        Where the sensor was, in the same frame, m.
    strength : ndarray of float64, shape (k,)
        Strength in the unit of the detector.
    probability : ndarray of float64, shape (k,)
        That it is glass, as the detector sees it.
    position_sigma, normal_sigma : ndarray of float64, shape (k,)
        Standard deviations along the normal, m, and of the normal, rad.
    extent : ndarray of float64, shape (k,)
        Half width of the surface piece the observation proves, m.
    sensor_kind : ndarray of uint8, shape (k,)
        LIDAR or SONAR.
    """

    node: NDArray[np.int64]
    position: FloatArray
    normal: FloatArray
    sensor: FloatArray
    strength: FloatArray
    probability: FloatArray
    position_sigma: FloatArray
    normal_sigma: FloatArray
    extent: FloatArray
    sensor_kind: NDArray[np.uint8]

    def __len__(self) -> int:
        return len(self.node)

    @classmethod
    def empty(cls) -> "GlassObservations":
        """No observations."""
        none = np.empty(0)
        return cls(
            np.empty(0, np.int64), np.empty((0, 2)), none, np.empty((0, 2)), none, none, none, none, none,
            np.empty(0, np.uint8),
        )  # fmt: skip

    @classmethod
    def joined(cls, parts: "Sequence[GlassObservations]") -> "GlassObservations":
        """Observations of several sensors as one set, each with its own uncertainty, for one fit of walls.

        Parameters
        ----------
        parts : sequence of GlassObservations
            Observations bound to the same nodes.
        """
        columns = [field.name for field in fields(cls)]
        everything = (cls.empty(), *parts)
        return cls(**{name: np.concatenate([getattr(part, name) for part in everything]) for name in columns})

    def at(self, node_poses: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Positions (k, 2), m, and normals (k,), rad, in the map frame for node poses (n, 3)."""
        poses = node_poses[self.node]
        cosine, sine = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        x = cosine * self.position[:, 0] - sine * self.position[:, 1] + poses[:, 0]
        y = sine * self.position[:, 0] + cosine * self.position[:, 1] + poses[:, 1]
        return np.stack((x, y), axis=1), wrap_angle(self.normal + poses[:, 2])
