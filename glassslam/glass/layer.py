"""What a run found out about glass, and its place in the map."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from glassslam.records import Float32Array, FloatArray

if TYPE_CHECKING:  # runs that do not look for glass need not load what finds it
    from glassslam.glass.observations import GlassObservations
    from glassslam.glass.walls import GlassWall

GLASS_PROBABILITY = 0.98
"""P(occupied) of the cells of a glass wall: no robot should drive there."""


@dataclass(frozen=True, slots=True)
class GlassLayer:
    """Glass of a finished run.

    Attributes
    ----------
    walls : tuple of GlassWall
        Walls in the map frame.
    observations : GlassObservations
        Everything the detector reported, bound to the nodes.
    positions : ndarray of float64, shape (k, 2)
        Where the observations are in the map frame, m.
    normals : ndarray of float64, shape (k,)
        Their surface normals in the map frame, rad.
    """

    walls: "tuple[GlassWall, ...]"
    observations: "GlassObservations"
    positions: FloatArray
    normals: FloatArray


def wall_cells(
    walls: "Sequence[GlassWall]", shape: tuple[int, int], origin: tuple[float, float], resolution: float
) -> NDArray[np.bool_]:
    """Cells of a grid that walls run through, shape (rows, columns)."""
    mask = np.zeros(shape, dtype=bool)
    for wall in walls:
        steps = max(2, int(np.ceil(4.0 * wall.length / resolution)))
        points = wall.start + np.linspace(0.0, 1.0, steps)[:, None] * (wall.end - wall.start)
        index = np.floor((points - np.asarray(origin)) / resolution).astype(np.int64)
        inside = (index >= 0).all(axis=1) & (index[:, 0] < shape[1]) & (index[:, 1] < shape[0])
        mask[index[inside, 1], index[inside, 0]] = True
    return mask


def locked(probability: Float32Array, glass: NDArray[np.bool_]) -> Float32Array:
    """Probabilities with the glass cells occupied, whatever the beams that passed them said."""
    out = probability.copy()
    out[glass] = np.fmax(out[glass], np.float32(GLASS_PROBABILITY))
    return out
