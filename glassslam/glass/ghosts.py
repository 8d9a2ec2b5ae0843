"""Ghosts: returns that a beam brought from behind a glass wall.

What a beam meets behind glass is there, when the pane let it through, or stands in front of it, when the
pane mirrored it. Both ends lie where the robot may not have been, and move with any error of the beam that
the pane bends; neither belongs to the surface that stands in the way, the glass.

A plane mirror shows its images in the same place from everywhere, so the images alone do not tell. What
tells is the way back: folded over the line of the wall, an image lies on the surface it shows, which other
beams have met in front of the wall. And panes mirror strongly only when met at a glancing angle: what was
met behind them at other angles as well is there.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

import numpy as np
from numpy.typing import NDArray

from glassslam.glass import ghost_kernels as kernels
from glassslam.glass.beams import BeamEvidence, Beams
from glassslam.records import Float32Array, FloatArray

if TYPE_CHECKING:
    from glassslam.glass.walls import GlassWall

DIRECT: Final = 0
SEEN_THROUGH: Final = 1
MIRRORED: Final = 2

_CELL = 0.1
_MOST_CELLS = 1 << 25
_MANY_RETURNS = 5
_CLEARLY_THROUGH = 0.35  # cosine of the incidence from which on a pane hardly mirrors, at 70 degrees
_HEAD_ON = 0.08  # share of light that the two faces of a pane mirror head on (Schlick 1994)
# Of the images that a pane could show, this share is seen; and how much oftener a surface is known at the
# place told, over a mirror than through the pane. From the beams of two simulated buildings.
_SHOWN = 1.0 / 3.0
_IMAGE_KNOWN, _IMAGE_UNKNOWN = 5.0, 0.02
_END_KNOWN, _END_UNKNOWN = 0.4, 3.0

Kept = Literal["all", "seen_through", "none"]


@dataclass(frozen=True, slots=True)
class Ghosts:
    """What the returns and silent beams of a run are with regard to its glass walls.

    Attributes
    ----------
    labels : ndarray of uint8, shape (m,)
        DIRECT, SEEN_THROUGH or MIRRORED for every return of all nodes, in their order.
    mirrored : ndarray of float32, shape (m,)
        Probability that the return came over a mirror; 0 for direct ones.
    share : ndarray of float32, shape (m,)
        Share of the way to the return up to the first wall; 1 for direct ones.
    silent_share : ndarray of float32, shape (s,)
        The same for the beams without echo.
    """

    labels: NDArray[np.uint8]
    mirrored: Float32Array
    share: Float32Array
    silent_share: Float32Array

    def count(self, label: int) -> int:
        """Number of returns with a label."""
        return int(np.count_nonzero(self.labels == label))

    def hidden(self, kept: Kept) -> NDArray[np.bool_]:
        """Returns that a map does not show when it keeps all ghosts, those seen through, or none, (m,)."""
        if kept == "all":
            return np.zeros(len(self.labels), dtype=np.bool_)
        return np.asarray(self.labels == MIRRORED if kept == "seen_through" else self.labels != DIRECT)


def find_ghosts(
    walls: "Sequence[GlassWall]", poses: FloatArray, beams: BeamEvidence, tolerance: float
) -> Ghosts:
    """Sort the returns of all nodes into direct ones, those seen through glass, and mirror images.

    Parameters
    ----------
    walls : sequence of GlassWall
        In the map frame.
    poses : ndarray of float64, shape (n, 3)
        Optimised poses of the nodes, m and rad.
    beams : BeamEvidence
        Of all nodes.
    tolerance : float
        Returns this near the line of a wall are on it, m.
    """
    segments = np.array([[*wall.start, *wall.end] for wall in walls]).reshape(-1, 4)
    wall, share, cosines = crossings(segments, poses, beams.returns, tolerance)
    _, silent_share, _ = crossings(segments, poses, beams.silent, 0.0)
    mirrored = mirror_probability(segments, poses, beams.returns, wall, cosines)
    labels = np.where(wall < 0, DIRECT, np.where(mirrored > 0.5, MIRRORED, SEEN_THROUGH))
    return Ghosts(labels.astype(np.uint8), mirrored, share, silent_share)


def crossings(
    segments: FloatArray, poses: FloatArray, beams: Beams, tolerance: float
) -> tuple[NDArray[np.int32], Float32Array, Float32Array]:
    """First segment that every beam crosses, -1 for none, and where and how it does.

    Parameters
    ----------
    segments : ndarray of float64, shape (w, 4)
        End points x0, y0, x1, y1 in the map frame, m.
    poses : ndarray of float64, shape (n, 3)
        Poses of the nodes, m and rad.
    beams : Beams
        Of these nodes.
    tolerance : float
        A beam that ends this near the line of a segment has not crossed it, m.

    Returns
    -------
    wall : ndarray of int32, shape (m,)
        Row of `segments`.
    share : ndarray of float32, shape (m,)
        Share of the way up to there: 0 at the sensor, 1 at the end of the beam and for none.
    cosine : ndarray of float32, shape (m,)
        Of the incidence on that segment; 0 for none.
    """
    wall = np.empty(len(beams.ends), dtype=np.int32)
    share, cosines = np.empty((2, len(beams.ends)), dtype=np.float32)
    kernels.first_walls(
        poses, beams.sensors, beams.ends, beams.first, segments, tolerance, wall, share, cosines
    )
    return wall, share, cosines


def mirror_probability(
    segments: FloatArray, poses: FloatArray, beams: Beams, wall: NDArray[np.int32], cosines: Float32Array
) -> Float32Array:
    """Probability of every return that a glass wall mirrored it, shape (m,); 0 where no wall is crossed.

    Parameters
    ----------
    segments, poses, beams
        As for `crossings`.
    wall : ndarray of int32, shape (m,)
        Segment that every beam crosses first; -1 for none.
    cosines : ndarray of float32, shape (m,)
        Of the incidence there.
    """
    out = np.zeros(len(wall), dtype=np.float32)
    through = np.flatnonzero(wall >= 0)
    if not len(through):
        return out
    corner, cell, shape = _raster(poses, beams)
    direct, real = np.zeros((2, *shape), dtype=np.uint8)
    # what was met behind a pane far from a glancing angle is no mirror image
    for chosen, counts in ((wall < 0, direct), ((wall < 0) | (cosines > _CLEARLY_THROUGH), real)):
        kernels.count_ends(poses, beams.ends, beams.first, chosen, corner, cell, counts)
    known = np.zeros(len(wall), dtype=np.uint8)
    kernels.mirror_evidence(
        poses, beams.ends, beams.first, wall, segments, corner, cell, direct, real, _MANY_RETURNS, known
    )
    odds = mirror_odds(cosines[through], known[through])
    out[through] = odds / (1.0 + odds)
    return out


def mirror_odds(cosines: Float32Array, known: NDArray[np.uint8]) -> Float32Array:
    """Odds of a mirror image against something seen through the pane.

    Parameters
    ----------
    cosines : ndarray of float32, shape (k,)
        Of the incidence on the pane, which decides how much of the light is mirrored (Schlick 1994, eq. 15).
    known : ndarray of uint8, shape (k,)
        Bit 0: a surface is known where the image would come from; bit 1: one is known at the end itself.
    """
    light = _HEAD_ON + (1.0 - _HEAD_ON) * (1.0 - cosines) ** 5
    # there and back
    odds = _SHOWN * (light / (1.0 - np.minimum(light, 0.999))) ** 2
    odds *= np.where(known & 1, _IMAGE_KNOWN, _IMAGE_UNKNOWN) * np.where(known & 2, _END_KNOWN, _END_UNKNOWN)
    return np.asarray(odds, dtype=np.float32)


def _raster(poses: FloatArray, beams: Beams) -> tuple[FloatArray, float, tuple[int, int]]:
    """Corner, cell edge, m, and shape of a grid that holds all ends, of bounded size."""
    reach = float(np.hypot(*beams.ends.T).max(initial=0.0)) + _CELL
    low, high = poses[:, :2].min(axis=0) - reach, poses[:, :2].max(axis=0) + reach
    cell = max(_CELL, math.sqrt(float(np.prod(high - low)) / _MOST_CELLS))
    columns, rows = (int(size) + 1 for size in (high - low) / cell)
    return low, cell, (rows, columns)


def ghost_cells(
    labels: NDArray[np.uint8],
    poses: FloatArray,
    returns: Beams,
    shape: tuple[int, int],
    origin: tuple[float, float],
    resolution: float,
) -> NDArray[np.bool_]:
    """Cells of a grid in which ghosts end, at least two, and nothing else does, shape (rows, columns).

    Parameters
    ----------
    labels : ndarray of uint8, shape (m,)
        As in `Ghosts`.
    poses : ndarray of float64, shape (n, 3)
        Poses of the nodes, m and rad.
    returns : Beams
        Of these nodes.
    shape : tuple of int
        Rows and columns.
    origin : tuple of float
        Lower left corner of the grid, m.
    resolution : float
        Cell edge, m.
    """
    direct, ghosts = np.zeros(shape, dtype=np.bool_), np.zeros(shape, dtype=np.uint8)
    kernels.mark_ends(
        poses, returns.ends, returns.first, labels, np.array(origin), resolution, direct, ghosts
    )
    return ~direct & (ghosts > 1)
