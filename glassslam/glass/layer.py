"""What a run found out about glass, and its place in the map."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from glassslam.records import Float32Array, FloatArray

if TYPE_CHECKING:  # runs that do not look for glass need not load what finds it
    from detectors.calibration import Calibration
    from glassslam.glass.beam_labels import GlassBeams
    from glassslam.glass.ghosts import Ghosts
    from glassslam.glass.observations import GlassObservations
    from glassslam.glass.walls import GlassWall

GLASS_PROBABILITY = 0.98
"""P(occupied) of the cells of a glass wall: no robot should drive there."""


def _no_cells() -> FloatArray:
    return np.empty((0, 2))


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
    locked_cells : ndarray of float64, shape (c, 2)
        Centres of the cells of the map that are occupied because of glass, m.
    beams : GlassBeams or None
        Labels of single beams.
    ghosts : Ghosts or None
        Which returns came from behind the walls.
    ghost_cells : ndarray of float64, shape (g, 2)
        Centres of the cells of the map in which nothing but ghosts ends, m.
    calibration : Calibration or None
        What the run has learnt about its lidar by itself.
    """

    walls: "tuple[GlassWall, ...]"
    observations: "GlassObservations"
    positions: FloatArray
    normals: FloatArray
    locked_cells: FloatArray = field(default_factory=_no_cells)
    beams: "GlassBeams | None" = None
    ghosts: "Ghosts | None" = None
    ghost_cells: FloatArray = field(default_factory=_no_cells)
    calibration: "Calibration | None" = None


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
