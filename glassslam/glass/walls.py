"""Glass walls: what many observations, and the beams between them, say together.

A pane answers only near normal incidence, so one observation is an oriented piece of surface rather
than a point. Pieces on a common line make a wall. Between them the beams of all scans decide: where
they pass, glass may go on; where they end on the line, it does not, except at a mullion; where they
pass at normal incidence more often than glass lets them, there is an opening.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glassslam.config import GlassWallConfig
from glassslam.glass.evidence_kernels import count_along_line
from glassslam.glass.lines import Line, axial_difference, fit_line, members
from glassslam.glass.observations import GlassObservations
from glassslam.records import Float32Array, FloatArray

_STEP = 0.1
_SOLID_BAND = 0.08
_BEYOND = 0.25
_NORMAL_LIMIT = math.radians(4.0)
_NEIGHBOURHOOD = 3.0
_ROUNDS = 6


@dataclass(frozen=True, slots=True)
class ScanPoints:
    """Returns of all nodes, packed.

    Attributes
    ----------
    sensors : ndarray of float64, shape (n, 2)
        Position of the laser in the frame of the base at each node, m.
    points : ndarray of float32, shape (m, 2)
        Returns of all nodes in the frames of their bases, m.
    first : ndarray of int64, shape (n + 1,)
        Row of `points` where each node begins.
    """

    sensors: FloatArray
    points: Float32Array
    first: NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class GlassWall:
    """A straight piece of glass.

    Attributes
    ----------
    start, end : ndarray of float64, shape (2,)
        End points in the map frame, m.
    observations : int
        Observations it rests on.
    nodes : int
        Different nodes that made them.
    probability : float
        That it is glass.
    position_sigma : float
        Standard deviation across the wall, m.
    angle_sigma : float
        Standard deviation of its direction, rad.
    observed_length : float
        Length that the observations themselves prove, m; the rest is bridged.
    """

    start: FloatArray
    end: FloatArray
    observations: int
    nodes: int
    probability: float
    position_sigma: float
    angle_sigma: float
    observed_length: float

    @property
    def length(self) -> float:
        """Distance of the end points, m."""
        return float(np.hypot(*(self.end - self.start)))


def fit_walls(
    observations: GlassObservations, node_poses: FloatArray, scans: ScanPoints, config: GlassWallConfig
) -> list[GlassWall]:
    """All walls that the observations support, the best supported first.

    Parameters
    ----------
    observations : GlassObservations
        Of the whole run.
    node_poses : ndarray of float64, shape (n, 3)
        Optimised poses of the nodes, m and rad.
    scans : ScanPoints
        Returns of all nodes.
    config : GlassWallConfig
        Tolerances.
    """
    positions, normals = observations.at(node_poses)
    free = np.ones(len(observations), dtype=bool)
    walls: list[GlassWall] = []
    while free.sum() >= config.min_observations:
        found = _grow(positions, normals, observations, free, config)
        if found is None:
            break
        line, chosen = found
        free[chosen] = False
        walls += _pieces(line, chosen, positions, free, observations, node_poses, scans, config)
    return walls


def _grow(
    positions: FloatArray,
    normals: FloatArray,
    observations: GlassObservations,
    free: NDArray[np.bool_],
    config: GlassWallConfig,
) -> tuple[Line, NDArray[np.int64]] | None:
    """The best supported line among the free observations, and those on it."""
    index = np.flatnonzero(free)
    seed, support = _best_seed(positions[index], normals[index], observations.probability[index], config)
    if support < config.min_evidence:
        return None
    tolerance, turn = config.distance_tolerance, math.radians(config.angle_tolerance_deg)
    line = Line(positions[index[seed]], float(normals[index[seed]]) + 0.5 * math.pi, tolerance, turn)
    chosen = index[:0]
    for _ in range(_ROUNDS):
        on_line = index[members(line, positions[index], normals[index], tolerance, turn)]
        near = on_line[
            _connected(line.along(positions[on_line]), line.along(positions[index[seed]][None])[0])
        ]
        if len(near) == 0:
            near = index[seed : seed + 1]
        if len(near) == len(chosen) and (near == chosen).all():
            break
        chosen = near
        line = fit_line(
            positions[chosen],
            normals[chosen],
            observations.position_sigma[chosen],
            observations.normal_sigma[chosen],
        )
    return line, chosen


def _best_seed(
    positions: FloatArray, normals: FloatArray, weights: FloatArray, config: GlassWallConfig
) -> tuple[int, float]:
    """The observation with the largest weight of others nearby on its own tangent, and that weight."""
    best, best_support = 0, -1.0
    for k in range(len(positions)):
        offsets = positions - positions[k]
        across = np.abs(offsets @ np.array([math.cos(normals[k]), math.sin(normals[k])]))
        close = (across < config.distance_tolerance) & (
            np.einsum("ij,ij->i", offsets, offsets) < _NEIGHBOURHOOD**2
        )
        close &= axial_difference(normals, float(normals[k])) < math.radians(config.angle_tolerance_deg)
        support = float(weights[close].sum())
        if support > best_support:
            best, best_support = k, support
    return best, best_support


def _connected(along: FloatArray, seed: float) -> NDArray[np.int64]:
    """Indices reached from the seed position without a step longer than the longest bridge."""
    order = np.argsort(along, kind="stable")
    steps = np.diff(along[order]) > 2.0 * _NEIGHBOURHOOD
    groups = np.concatenate(([0], np.cumsum(steps)))
    at = int(np.argmin(np.abs(along[order] - seed))) if len(order) else 0
    return np.sort(order[groups == groups[at]]) if len(order) else order


def _pieces(
    line: Line,
    chosen: NDArray[np.int64],
    positions: FloatArray,
    free: NDArray[np.bool_],
    observations: GlassObservations,
    node_poses: FloatArray,
    scans: ScanPoints,
    config: GlassWallConfig,
) -> list[GlassWall]:
    """Cut a line into the stretches of glass that observations and beams agree on."""
    everywhere = line.along(positions)
    along = everywhere[chosen]
    extents = np.maximum(observations.extent[chosen], 0.5 * _STEP)
    margin = config.max_extension + _STEP
    start = float((along - extents).min()) - margin
    bins = math.ceil((float((along + extents).max()) + margin - start) / _STEP)
    solid, passed, passed_normal = _counts(line, start, bins, node_poses, scans)
    seen = np.zeros(bins, dtype=np.int64)
    for s, e in zip(along, extents, strict=True):
        first, last = int((s - e - start) / _STEP), int((s + e - start) / _STEP)
        seen[max(first, 0) : last + 1] += 1
    glass = _bridged(seen, solid, passed, passed_normal, config)
    walls = []
    for first, last in _runs(glass):
        low, high = start + first * _STEP, start + (last + 1) * _STEP
        inside = chosen[(along >= low - 0.5 * _STEP) & (along <= high + 0.5 * _STEP)]
        wall = _wall(line, low, high, inside, observations, float((seen[first : last + 1] > 0).sum()) * _STEP)
        strip = np.abs(line.gap(positions)) < config.distance_tolerance
        strip &= (everywhere >= low - _STEP) & (everywhere <= high + _STEP)
        chance = 2.0 * math.radians(config.angle_tolerance_deg) / math.pi * int(strip.sum())
        enough = len(inside) >= max(config.min_observations, config.min_excess * chance)
        if enough and wall.nodes >= config.min_nodes and wall.probability >= config.min_probability:
            free[strip] = False
            walls.append(wall)
    return walls


def _counts(
    line: Line, start: float, bins: int, node_poses: FloatArray, scans: ScanPoints
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Solid returns, passages and passages at normal incidence by piece of the line."""
    solid, passed, normal = (np.zeros(bins, dtype=np.int64) for _ in range(3))
    count_along_line(
        node_poses, scans.sensors, scans.points, scans.first, np.arange(len(node_poses)), line.foot,
        line.direction, start, _STEP, _SOLID_BAND, _BEYOND, _NORMAL_LIMIT, solid, passed, normal,
    )  # fmt: skip
    return solid, passed, normal


def _bridged(
    seen: NDArray[np.int64],
    solid: NDArray[np.int64],
    passed: NDArray[np.int64],
    passed_normal: NDArray[np.int64],
    config: GlassWallConfig,
) -> NDArray[np.bool_]:
    """Pieces of the line that are glass: observed, bridged, or up to the frame that holds them."""
    observed = seen > 0
    glass = observed.copy()
    answers = int(seen[observed].sum())
    # the share of beams at normal incidence that this glass answered, from the stretches where it did
    rate = answers / (answers + int(passed_normal[observed].sum()))
    opaque = ~observed & (solid >= 3) & (solid > passed)
    for first, last in _runs(~observed):
        inner = slice(first, last + 1)
        if first == 0 or last == len(seen) - 1:
            _extend(glass, opaque, passed, first, last, config)
        elif _may_bridge(opaque[inner], passed[inner], passed_normal[inner], rate, config):
            glass[inner] = True
    return glass


def _may_bridge(
    opaque: NDArray[np.bool_],
    passed: NDArray[np.int64],
    passed_normal: NDArray[np.int64],
    rate: float,
    config: GlassWallConfig,
) -> bool:
    """Whether a gap between observed pieces is glass that nobody met at normal incidence."""
    length = len(opaque) * _STEP
    if length > config.max_gap:
        return False
    widest = max((last - first + 1 for first, last in _runs(opaque)), default=0) * _STEP
    if widest > config.max_mullion:
        return False
    if rate * int(passed_normal.sum()) > config.opening_evidence:
        return False
    silent = ~opaque & (passed == 0)
    return bool(silent.sum() * _STEP <= max(config.max_mullion, 0.5 * length))


def _extend(
    glass: NDArray[np.bool_],
    opaque: NDArray[np.bool_],
    passed: NDArray[np.int64],
    first: int,
    last: int,
    config: GlassWallConfig,
) -> None:
    """Carry a wall on to the frame next to it, when one is within reach and beams pass on the way."""
    way = range(first, last + 1) if first > 0 else range(last, first - 1, -1)
    reach: list[int] = []
    for k in way:
        if opaque[k]:
            if len(reach) * _STEP <= config.max_extension:
                glass[reach] = True
            return
        if passed[k] == 0:
            return
        reach.append(k)


def _runs(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last index of every run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], mask.astype(np.int8), [0]))))
    return [(int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _wall(
    line: Line,
    low: float,
    high: float,
    inside: NDArray[np.int64],
    observations: GlassObservations,
    observed_length: float,
) -> GlassWall:
    """One wall from the line, its ends, and the observations on it."""
    belief = np.clip(observations.probability[inside], 0.02, 0.98)
    nodes = np.unique(observations.node[inside])
    # observations from one node see the same beams: they count once, as strongly as the best of them
    best = [float(belief[observations.node[inside] == node].max()) for node in nodes]
    evidence = float(sum(math.log(p / (1.0 - p)) for p in best))
    return GlassWall(
        line.foot + low * line.direction,
        line.foot + high * line.direction,
        len(inside),
        len(nodes),
        1.0 / (1.0 + math.exp(-min(evidence, 50.0))),
        line.position_sigma,
        line.angle_sigma,
        observed_length,
    )
