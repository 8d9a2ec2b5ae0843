"""Chains of surface pieces that continue each other, cut where they bend.

Two pieces belong together when each lies on the tangent of the other. A chain may bend a little from
piece to piece, as a corridor does in a map that is not perfect; where it leaves a straight line by more
than the tolerance it is cut in two.
"""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.signal import medfilt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from glassslam.glass.lines import axial_difference
from glassslam.records import FloatArray

_CELL = 0.1
_SECTOR = math.radians(10.0)
_SLACK = math.radians(4.0)
_SHORTEST = 4.0


def merge_pieces(
    positions: FloatArray, normals: FloatArray
) -> tuple[FloatArray, FloatArray, NDArray[np.int64]]:
    """Means of the pieces that share a cell of 10 cm and a sector of 10 degrees.

    Returns
    -------
    positions, normals : ndarray of float64, shape (g, 2), (g,)
        Means by group, m and rad.
    group : ndarray of int64, shape (k,)
        The group of every piece.
    """
    axes = np.mod(normals, np.pi)
    keys = np.column_stack((np.floor(positions / _CELL), np.floor(axes / _SECTOR))).astype(np.int64)
    _, group = np.unique(keys, axis=0, return_inverse=True)
    group = group.reshape(-1)
    count = np.bincount(group)
    mean = np.column_stack([np.bincount(group, positions[:, a]) / count for a in (0, 1)])
    axis = 0.5 * np.arctan2(np.bincount(group, np.sin(2.0 * axes)), np.bincount(group, np.cos(2.0 * axes)))
    return mean, axis, group


def chains(
    positions: FloatArray, normals: FloatArray, max_gap: float, distance: float
) -> list[NDArray[np.int64]]:
    """Groups of pieces that continue each other, the largest first.

    Parameters
    ----------
    positions : ndarray of float64, shape (k, 2)
        Points on the surface, m.
    normals : ndarray of float64, shape (k,)
        Directions of the surface normal, rad.
    max_gap : float
        Longest step from piece to piece, m.
    distance : float
        How far a piece may lie from the tangent of the other, m.
    """
    centres, axes, group = merge_pieces(positions, normals)
    pairs = cKDTree(centres).query_pairs(max_gap, output_type="ndarray")
    steps = centres[pairs[:, 1]] - centres[pairs[:, 0]]
    length = np.hypot(steps[:, 0], steps[:, 1])
    heading = np.arctan2(steps[:, 1], steps[:, 0])
    allowed = np.where(length < 2.0 * _CELL, np.pi, _SLACK + np.arctan2(distance, length))
    fits = axial_difference(axes[pairs[:, 0]], axes[pairs[:, 1]]) < 2.0 * _SLACK
    for end in (0, 1):
        fits &= axial_difference(axes[pairs[:, end]] + 0.5 * np.pi, heading) < allowed
    linked = pairs[fits]
    count = len(centres)
    graph = coo_array((np.ones(len(linked)), (linked[:, 0], linked[:, 1])), shape=(count, count))
    _, component = connected_components(graph, directed=False)
    label = component[group]
    found = [np.flatnonzero(label == c) for c in np.unique(label)]
    return sorted(found, key=lambda members: (-len(members), int(members[0])))


def straight_parts(
    positions: FloatArray, chain: NDArray[np.int64], distance: float
) -> list[NDArray[np.int64]]:
    """A chain cut into parts that stay within `distance` (m) of a straight line each.

    Parts follow each other along the chain and share the piece at which it bends.

    Parameters
    ----------
    positions : ndarray of float64, shape (k, 2)
        Points on the surface, m.
    chain : ndarray of int64, shape (n,)
        Pieces that make the chain, at least one, in any order.
    distance : float
        Largest offset of the middle of neighbouring pieces from their line, m.
    """
    chain = np.sort(chain)
    points = positions[chain]
    centre, axis = _principal(points)
    # the sign of a singular vector is arbitrary; the order of the pieces, and thus the cuts, must not be
    axis = axis * np.sign(axis[np.argmax(np.abs(axis))])
    order = np.argsort((points - centre) @ axis, kind="stable")
    return _cut(positions, chain[order], distance)


def _principal(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean of points and unit vector along their largest spread, shape (2,) each."""
    centre = points.mean(axis=0)
    return centre, np.asarray(np.linalg.svd(points - centre, full_matrices=False)[2][0])


def _cut(positions: FloatArray, ordered: NDArray[np.int64], distance: float) -> list[NDArray[np.int64]]:
    points = positions[ordered]
    centre, axis = _principal(points)
    gaps = (points - centre) @ np.array([-axis[1], axis[0]])
    # single strays are left to the fit; a bend shows in the median of several neighbours
    smooth = np.abs(medfilt(gaps, 5)) if len(points) >= 5 else np.zeros(len(points))
    if smooth.max() <= distance:
        return [ordered]
    along = (points - points[0]) @ (axis * np.sign((points[-1] - points[0]) @ axis))
    inner = (along > _SHORTEST) & (along < along[-1] - _SHORTEST)
    if not inner.any():
        return [ordered]
    chord = points[-1] - points[0]
    offset = medfilt((points - points[0]) @ np.array([-chord[1], chord[0]]), 5)
    bend = int(np.argmax(np.where(inner, np.abs(offset), -1.0)))
    return _cut(positions, ordered[: bend + 1], distance) + _cut(positions, ordered[bend:], distance)
