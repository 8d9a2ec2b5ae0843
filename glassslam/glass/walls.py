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
from glassslam.glass.beams import BeamEvidence, Beams
from glassslam.glass.chains import chains, straight_parts
from glassslam.glass.evidence_kernels import count_along_line
from glassslam.glass.lines import Line, fit_line, members
from glassslam.glass.observations import GlassObservations
from glassslam.glass.stretches import STEP, glass_stretches, opaque_pieces, runs
from glassslam.glass.withdrawal import withdrawn_pieces
from glassslam.records import FloatArray

__all__ = ["BeamEvidence", "Beams", "GlassWall", "fit_walls"]

_SOLID_BAND = 0.1
_BEYOND = 0.25
_NORMAL_LIMIT = math.radians(4.0)
_ROUNDS = 6


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


@dataclass(frozen=True, slots=True)
class _Scene:
    """Everything known when walls are fitted, with the observations placed in the map frame."""

    observations: GlassObservations
    positions: FloatArray
    normals: FloatArray
    node_poses: FloatArray
    beams: BeamEvidence
    config: GlassWallConfig


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
    scene = _Scene(observations, positions, normals, node_poses, beams, config)
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
            walls += _pieces(line, part, free, scene)
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
        near = _on_line(line, chosen, positions, normals, config)
        if len(near) < 2 or np.array_equal(near, kept):
            break
        kept = near
    return line


def _on_line(
    line: Line,
    chosen: NDArray[np.int64],
    positions: FloatArray,
    normals: FloatArray,
    config: GlassWallConfig,
) -> NDArray[np.int64]:
    """Those of the chosen observations that lie on a line and are turned as it is."""
    angle = math.radians(config.angle_tolerance_deg)
    return chosen[members(line, positions[chosen], normals[chosen], config.distance_tolerance, angle)]


def _pieces(line: Line, chosen: NDArray[np.int64], free: NDArray[np.bool_], scene: _Scene) -> list[GlassWall]:
    """Walls on a line, where observations and beams agree on glass; what lies on them is no longer free."""
    config, positions = scene.config, scene.positions
    along, everywhere = line.along(positions[chosen]), line.along(positions)
    reach = np.maximum(scene.observations.extent[chosen], 0.5 * STEP)
    start, seen = _seen(along, reach, config.max_extension + STEP)
    solid, passed, passed_normal = _counts(line, start, len(seen), scene.node_poses, scene.beams)
    posts = opaque_pieces(seen, solid, passed)
    gone = _gone(line, chosen, along, reach, (start, STEP, len(seen)), scene)
    near = np.abs(line.gap(positions)) < config.distance_tolerance
    # a map that is not perfect bends: pieces off the line still tell where the wall goes on, but do not count
    on_line = np.isin(chosen, _on_line(line, chosen, positions, scene.normals, config))
    walls = []
    for first, last in runs(glass_stretches(seen, solid, passed, passed_normal, gone, config)):
        low, high = start + first * STEP, start + (last + 1) * STEP
        inside = (along >= low - 0.5 * STEP) & (along <= high + 0.5 * STEP)
        # a wall that no post holds ends with its last observation, not with the piece that lies in
        if seen[first] > 0 and not posts[first - 1]:
            low = max(low, float((along - reach)[inside].min()))
        if seen[last] > 0 and not posts[last + 1]:
            high = min(high, float((along + reach)[inside].max()))
        observed = min(high - low, float((seen[first : last + 1] > 0).sum()) * STEP)
        wall = _wall(line, low, high, chosen[inside & on_line], scene.observations, observed)
        strip = near & (everywhere >= low - STEP) & (everywhere <= high + STEP)
        if _is_enough(wall, int(strip.sum()), config):
            free[strip] = False
            walls.append(wall)
    return walls


def _gone(
    line: Line,
    chosen: NDArray[np.int64],
    along: FloatArray,
    reach: FloatArray,
    pieces: tuple[float, float, int],
    scene: _Scene,
) -> NDArray[np.bool_]:
    """Pieces of a line at which later nodes found the glass gone."""
    seen = scene.observations
    distances = np.hypot(*(seen.position[chosen] - seen.sensor[chosen]).T)
    return withdrawn_pieces(
        line, np.stack((along - reach, along + reach), axis=1), seen.node[chosen], distances, pieces,
        scene.node_poses, scene.beams, scene.config.opening_evidence,
    )  # fmt: skip


def _seen(along: FloatArray, reach: FloatArray, margin: float) -> tuple[float, NDArray[np.int64]]:
    """Where the pieces of a line begin, m, and how many observations cover each of them."""
    start = float((along - reach).min()) - margin
    seen = np.zeros(math.ceil((float((along + reach).max()) + margin - start) / STEP) + 1, dtype=np.int64)
    for low, high in zip(along - reach - start, along + reach - start, strict=True):
        seen[int(low / STEP) : int(high / STEP) + 1] += 1
    return start, seen


def _is_enough(wall: GlassWall, around: int, config: GlassWallConfig) -> bool:
    """Whether a wall has more support than the observations `around` it would give it by chance."""
    chance = 2.0 * math.radians(config.angle_tolerance_deg) / math.pi * around
    return (
        wall.observations >= max(config.min_observations, config.min_excess * chance)
        and wall.nodes >= config.min_nodes
        and wall.probability >= config.min_probability
    )


def _counts(
    line: Line, start: float, bins: int, node_poses: FloatArray, beams: BeamEvidence
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Solid returns, passages and passages at normal incidence by piece of the line."""
    solid, passed, normal, nothing = (np.zeros(bins, dtype=np.int64) for _ in range(4))
    everyone = np.arange(len(node_poses))
    for kind, on_line in ((beams.returns, solid), (beams.silent, nothing)):
        count_along_line(
            node_poses, kind.sensors, kind.ends, kind.first, everyone, line.foot, line.direction, start,
            STEP, _SOLID_BAND, _BEYOND, _NORMAL_LIMIT, on_line, passed, normal,
        )  # fmt: skip
    return solid, passed, normal


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
