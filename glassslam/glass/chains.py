"""Chains of surface pieces that continue each other, cut where they bend.

Two pieces belong together when each lies on the tangent of the other. A chain may bend a little from
piece to piece, as a corridor does in a map that is not perfect; where it leaves a straight line by more
than the tolerance it is cut in two.
"""

import math

import numpy as np
from numpy.typing import NDArray

from glassslam.glass.chain_kernels import join_pieces
from glassslam.records import FloatArray

_CELL = 0.1
_SECTOR = math.radians(10.0)
_SLACK = math.radians(4.0)
_SHORTEST = 4.0
_CANDIDATES = 64
_STRETCH = 1.5
_FEW = 3
_ROUNDS = 3


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
    component = np.empty(len(centres), dtype=np.int64)
    join_pieces(centres, axes, max_gap, distance, 2.0 * _CELL, _SLACK, component)
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
    """Parts of a chain, split where it bends most and rejoined where a split turned out to be needless."""
    points = positions[ordered]
    if _is_straight(points, distance):
        return [ordered]
    axis = _principal(points)[1]
    along = (points - points[0]) @ (axis * np.sign((points[-1] - points[0]) @ axis))
    inner = np.flatnonzero((along > _SHORTEST) & (along < along[-1] - _SHORTEST))
    if len(inner) == 0:
        return [ordered]
    bend = _bend(points, inner[:: -(-len(inner) // _CANDIDATES)], distance)
    before = _cut(positions, ordered[: bend + 1], distance)
    after = _cut(positions, ordered[bend:], distance)
    joint = np.concatenate((before[-1][:-1], after[0]))
    if _is_straight(positions[joint], distance):
        return [*before[:-1], joint, *after[1:]]
    return before + after


def _is_straight(points: FloatArray, distance: float) -> bool:
    """Whether a line fits; strays are left to the fit of the wall, the median of a stretch shows a bend."""
    kept = points
    for _ in range(_ROUNDS):
        centre, axis = _principal(kept)
        along, gaps = (points - centre) @ axis, (points - centre) @ np.array([-axis[1], axis[0]])
        near = np.abs(gaps) <= max(distance, 2.0 * float(np.median(np.abs(gaps))))
        kept = points[near]
    steps = np.arange(along.min(), along.max() + _STRETCH, 0.5 * _STRETCH)
    parts = (gaps[np.abs(along - step) <= 0.5 * _STRETCH] for step in steps)
    return all(len(part) < _FEW or abs(float(np.median(part))) <= distance for part in parts)


def _gaps(points: FloatArray) -> FloatArray:
    """Signed distances of points from the line through them, m."""
    centre, axis = _principal(points)
    return np.asarray((points - centre) @ np.array([-axis[1], axis[0]]))


def _bend(points: FloatArray, candidates: NDArray[np.int64], distance: float) -> int:
    """The piece at which two straight lines fit a chain best; strays count no more than `distance`."""
    left_over = [
        sum(float(np.minimum(_gaps(part) ** 2, distance**2).sum()) for part in (points[: k + 1], points[k:]))
        for k in candidates
    ]
    return int(candidates[int(np.argmin(left_over))])
