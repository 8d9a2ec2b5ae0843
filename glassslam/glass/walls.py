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
from glassslam.glass.lines import Line, fit_line, members, with_scatter
from glassslam.glass.observations import LIDAR, SONAR, GlassObservations
from glassslam.glass.stretches import STEP, LineEvidence, glass_stretches, runs
from glassslam.glass.withdrawal import withdrawn_pieces
from glassslam.records import FloatArray

__all__ = ["BeamEvidence", "Beams", "GlassWall", "fit_walls"]

_SOLID_BAND = 0.1
_BEYOND = 0.25
_BEFORE = 0.5
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
    by_sonar : int
        How many of the observations sonars made.
    """

    start: FloatArray
    end: FloatArray
    observations: int
    nodes: int
    probability: float
    position_sigma: float
    angle_sigma: float
    observed_length: float
    by_sonar: int = 0

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
    return with_scatter(
        line, positions[kept], normals[kept], observations.position_sigma[kept],
        observations.normal_sigma[kept], observations.node[kept],
    )  # fmt: skip


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
    margin = config.max_extension + STEP
    start = float((along - reach).min()) - margin
    bins = math.ceil((float((along + reach).max()) + margin - start) / STEP) + 1
    evidence = _evidence(line, chosen, along, reach, (start, STEP, bins), scene)
    seen, posts = evidence.seen, evidence.opaque
    near = np.abs(line.gap(positions)) < config.distance_tolerance
    # a map that is not perfect bends: pieces off the line still tell where the wall goes on, but do not count
    on_line = np.isin(chosen, _on_line(line, chosen, positions, scene.normals, config))
    walls = []
    for first, last in runs(glass_stretches(evidence, config)):
        low, high = start + first * STEP, start + (last + 1) * STEP
        # by their middles; where none is left in a piece that was cut, by what reaches into it
        inside = (along >= low - 0.5 * STEP) & (along <= high + 0.5 * STEP)
        if not inside.any():
            inside = (along + reach >= low) & (along - reach <= high)
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


def _evidence(
    line: Line,
    chosen: NDArray[np.int64],
    along: FloatArray,
    reach: FloatArray,
    pieces: tuple[float, float, int],
    scene: _Scene,
) -> LineEvidence:
    """What observations and beams tell about the pieces of a line."""
    start, _, bins = pieces
    seen = scene.observations
    lidar = seen.sensor_kind[chosen] == LIDAR
    gone = np.zeros(bins, dtype=bool)
    if lidar.any():
        own = chosen[lidar]
        spans = np.stack((along - reach, along + reach), axis=1)[lidar]
        distances = np.hypot(*(seen.position[own] - seen.sensor[own]).T)
        gone = withdrawn_pieces(
            line, spans, seen.node[own], distances, pieces, scene.node_poses, scene.beams,
            scene.config.opening_evidence,
        )  # fmt: skip
        # the lidar takes back only what it alone saw
        gone &= _covering(along[~lidar], reach[~lidar], start, bins) == 0
    return LineEvidence(
        _covering(along, reach, start, bins),
        _covering(along[lidar], reach[lidar], start, bins),
        *_counts(line, start, bins, scene.node_poses, scene.beams),
        gone,
    )


def _covering(along: FloatArray, reach: FloatArray, start: float, bins: int) -> NDArray[np.int64]:
    """How many observations cover each piece of a line that begins at `start`, m."""
    seen = np.zeros(bins, dtype=np.int64)
    for low, high in zip(along - reach - start, along + reach - start, strict=True):
        seen[int(low / STEP) : int(high / STEP) + 1] += 1
    return seen


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
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Returns on a line, passages, passages at normal incidence and returns just before it, by its pieces."""
    solid, passed, normal, blocked, nothing = (np.zeros(bins, dtype=np.int64) for _ in range(5))
    everyone = np.arange(len(node_poses))
    for kind, on_line, short in ((beams.returns, solid, blocked), (beams.silent, nothing, nothing)):
        count_along_line(
            node_poses, kind.sensors, kind.ends, kind.first, everyone, line.foot, line.direction, start,
            STEP, _SOLID_BAND, _BEYOND, _NORMAL_LIMIT, _BEFORE, on_line, passed, normal, short,
        )  # fmt: skip
    return solid, passed, normal, blocked


def _wall(
    line: Line,
    low: float,
    high: float,
    inside: NDArray[np.int64],
    observations: GlassObservations,
    observed_length: float,
) -> GlassWall:
    """One wall from the line, its ends, and the observations on it."""
    evidence = _evidence_for(inside, observations)
    return GlassWall(
        line.foot + low * line.direction,
        line.foot + high * line.direction,
        len(inside),
        len(np.unique(observations.node[inside])),
        1.0 / (1.0 + math.exp(-min(evidence, 50.0))),
        line.position_sigma,
        line.angle_sigma,
        observed_length,
        int((observations.sensor_kind[inside] == SONAR).sum()),
    )


def _evidence_for(inside: NDArray[np.int64], observations: GlassObservations) -> float:
    """Log odds that a wall is glass, by the observations on it."""
    sonar = observations.sensor_kind[inside] == SONAR
    by_lidar, by_sonar = (_node_evidence(inside[part], observations) for part in (~sonar, sonar))
    # what the lidar takes for a post rather than a pane does not speak against the panes beside it
    return by_lidar + by_sonar if not sonar.any() else max(by_lidar, 0.0) + by_sonar


def _node_evidence(chosen: NDArray[np.int64], observations: GlassObservations) -> float:
    """The same for observations of one kind of sensor."""
    belief, nodes = np.clip(observations.probability[chosen], 0.02, 0.98), observations.node[chosen]
    # observations from one node see the same beams: they count once, as strongly as the best of them
    best = [float(belief[nodes == node].max()) for node in np.unique(nodes)]
    return float(sum(math.log(p / (1.0 - p)) for p in best))
