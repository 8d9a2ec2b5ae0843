"""Glass walls: what many observations, and the beams between them, say together.

A pane answers only near normal incidence, so one observation is an oriented piece of surface rather
than a point. Pieces on a common line make a wall. Between them the beams of all scans decide: where
they pass, glass may go on; where they end on the line, it does not, except at a mullion; where they
pass at normal incidence more often than glass lets them, there is an opening.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glassslam.config import GlassWallConfig
from glassslam.glass.chains import chains, straight_parts
from glassslam.glass.evidence_kernels import count_along_line
from glassslam.glass.lines import Line, fit_line, members
from glassslam.glass.observations import GlassObservations
from glassslam.records import Float32Array, FloatArray

_STEP = 0.1
_SOLID_BAND = 0.1
_BEYOND = 0.25
_NORMAL_LIMIT = math.radians(4.0)
_ROUNDS = 6
_RELIABLE = 0.3


@dataclass(frozen=True, slots=True)
class Beams:
    """End points of the beams of all nodes, packed.

    Attributes
    ----------
    sensors : ndarray of float64, shape (n, 2)
        Position of the laser in the frame of the base at each node, m.
    ends : ndarray of float32, shape (m, 2)
        End points in the frames of the bases of their nodes, m.
    first : ndarray of int64, shape (n + 1,)
        Row of `ends` where each node begins.
    """

    sensors: FloatArray
    ends: Float32Array
    first: NDArray[np.int64]

    @classmethod
    def pack(cls, sensors: Sequence[FloatArray], ends: Sequence[Float32Array]) -> "Beams":
        """Pack the end points (m_i, 2) of every node."""
        lengths = [len(points) for points in ends]
        joined = np.concatenate(ends) if ends else np.empty((0, 2), np.float32)
        return cls(
            np.array(sensors).reshape(-1, 2),
            joined,
            np.concatenate(([0], np.cumsum(lengths))).astype(np.int64),
        )


@dataclass(frozen=True, slots=True)
class BeamEvidence:
    """What all beams of a run tell about free space and surfaces.

    Attributes
    ----------
    returns, silent : Beams
        Beams that came back, ending on a surface, and beams without echo, ending in free space.
    """

    returns: Beams
    silent: Beams


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
    observations: GlassObservations, node_poses: FloatArray, beams: BeamEvidence, config: GlassWallConfig
) -> list[GlassWall]:
    """All walls that the observations support, the best supported first.

    Parameters
    ----------
    observations : GlassObservations
        Of the whole run.
    node_poses : ndarray of float64, shape (n, 3)
        Optimised poses of the nodes, m and rad.
    beams : BeamEvidence
        Of all nodes.
    config : GlassWallConfig
        Tolerances.
    """
    if len(observations) < config.min_observations:
        return []
    positions, normals = observations.at(node_poses)
    walls: list[GlassWall] = []
    free = np.ones(len(observations), dtype=bool)
    for chain in chains(positions, normals, config.max_gap, config.distance_tolerance):
        if len(chain) < config.min_observations:
            break
        rest = chain[free[chain]]
        if len(rest) < config.min_observations:
            continue
        for part in straight_parts(positions, rest, 0.6 * config.distance_tolerance):
            line = _robust_line(positions, normals, observations, part, config)
            walls += _pieces(line, part, positions, free, observations, node_poses, beams, config)
    return walls


def _robust_line(
    positions: FloatArray,
    normals: FloatArray,
    observations: GlassObservations,
    chosen: NDArray[np.int64],
    config: GlassWallConfig,
) -> Line:
    """Line through the chosen observations, without those that turn out to lie off it."""
    kept = chosen
    for _ in range(_ROUNDS):
        line = fit_line(
            positions[kept], normals[kept], observations.position_sigma[kept], observations.normal_sigma[kept]
        )
        near = chosen[
            members(
                line, positions[chosen], normals[chosen], config.distance_tolerance,
                math.radians(config.angle_tolerance_deg),
            )
        ]  # fmt: skip
        if len(near) < 2 or np.array_equal(near, kept):
            break
        kept = near
    return line


def _pieces(
    line: Line,
    chosen: NDArray[np.int64],
    positions: FloatArray,
    free: NDArray[np.bool_],
    observations: GlassObservations,
    node_poses: FloatArray,
    beams: BeamEvidence,
    config: GlassWallConfig,
) -> list[GlassWall]:
    """Cut a line into the stretches of glass that observations and beams agree on."""
    everywhere = line.along(positions)
    along = everywhere[chosen]
    extents = np.maximum(observations.extent[chosen], 0.5 * _STEP)
    margin = config.max_extension + _STEP
    start = float((along - extents).min()) - margin
    bins = math.ceil((float((along + extents).max()) + margin - start) / _STEP)
    solid, passed, passed_normal = _counts(line, start, bins, node_poses, beams)
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
    line: Line, start: float, bins: int, node_poses: FloatArray, beams: BeamEvidence
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Solid returns, passages and passages at normal incidence by piece of the line."""
    solid, passed, normal, nothing = (np.zeros(bins, dtype=np.int64) for _ in range(4))
    everyone = np.arange(len(node_poses))
    for kind, on_line in ((beams.returns, solid), (beams.silent, nothing)):
        count_along_line(
            node_poses, kind.sensors, kind.ends, kind.first, everyone, line.foot, line.direction, start, _STEP,
            _SOLID_BAND, _BEYOND, _NORMAL_LIMIT, on_line, passed, normal,
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
    # glass that seldom answers even where it stands proves nothing by its silence
    if rate > _RELIABLE and rate * int(passed_normal.sum()) > config.opening_evidence:
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
