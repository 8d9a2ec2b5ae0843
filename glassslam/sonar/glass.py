"""Glass that sonars hear and the lidar map does not show, as oriented pieces of surface."""

import math
from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from glassslam.config import SonarConfig, SonarGlassConfig
from glassslam.geometry import between
from glassslam.glass.beams import BeamEvidence
from glassslam.glass.evidence_kernels import count_along_line
from glassslam.glass.observations import SONAR, GlassObservations
from glassslam.records import FloatArray
from glassslam.sonar.mapping import beam_width
from glassslam.sonar.surface_kernels import COLUMNS, surface_pieces
from glassslam.sonar.sweeps import SonarSweeps

_LEAST_READING_SIGMA = 0.01
_LEAST_NORMAL_SIGMA = math.radians(1.0)
_SOLID_BAND = 0.15
_SHORTEST = 0.1
_NEAR = 8.0
_FEWEST_BEAMS = 3
_PIECE_COLUMNS = 9
_SIGMA_OF_MEDIAN = 1.48
# readings this good need no more than the configured span
_QUIET = 0.02
# readings worse than this are those of no surface
_LOUDEST = 0.06
_SPREAD = 1.5


def sonar_glass_observations(
    sweeps: SonarSweeps,
    beams: BeamEvidence,
    node_stamps: FloatArray,
    node_poses: FloatArray,
    config: SonarConfig,
) -> GlassObservations:
    """Surfaces that successive sonar readings agree on and that most lidar beams pass.

    The normal of a piece follows from the change of the range with the motion of the sonar (regions of
    constant depth, Leonard and Durrant-Whyte 1992) and from its axis. The rule of the gap is that of
    pi-map, section III-C, asked of the beams rather than of the map: an opaque wall that beams without
    echo have cleared from the map still ends many others. The strength of an observation is its number of
    readings.

    Parameters
    ----------
    sweeps : SonarSweeps
        Readings at optimised poses.
    beams : BeamEvidence
        Lidar beams of all nodes.
    node_stamps : ndarray of float64, shape (n,)
        Times of the nodes, s.
    node_poses : ndarray of float64, shape (n, 3)
        Optimised poses of the nodes, m and rad.
    config : SonarConfig
        Cone and tolerances.
    """
    if not len(node_stamps):
        return GlassObservations.empty()
    half_width, sensors = 0.5 * beam_width(sweeps, config), sweeps.sensors
    readings = [
        _readings(sweeps, sensors, sonar, config.glass.max_range) for sonar in range(sweeps.ranges.shape[1])
    ]
    noise = reading_noise(readings, config.glass.max_pause)
    found = [_pieces_of(rows, half_width, config.glass, noise) for rows in readings]
    pieces = np.concatenate([np.empty((0, _PIECE_COLUMNS)), *found])
    glass = passed_share(pieces, beams, node_poses, config.glass.min_gap) >= config.glass.min_passed_share
    return _bound(pieces[glass], node_stamps, node_poses, config.glass)


def _readings(sweeps: SonarSweeps, sensors: FloatArray, sonar: int, max_range: float) -> FloatArray:
    """Echoes of one sonar in time: rows of stamp, x, y, axis and range."""
    ranges = sweeps.ranges[:, sonar]
    limit = min(max_range, sweeps.ring.range_max)
    use = np.flatnonzero(np.isfinite(ranges) & (ranges >= sweeps.ring.range_min) & (ranges <= limit))
    use = use[np.argsort(sweeps.stamps[use], kind="stable")]
    return np.column_stack((sweeps.stamps[use], sensors[use, sonar], ranges[use]))


def reading_noise(readings: Sequence[FloatArray], max_pause: float) -> float:
    """Standard deviation of single readings about a surface that the sonar moves past, m, at most 6 cm.

    The second difference of three readings in a row is free of the distance and of the motion; corners are
    left to the median.

    Parameters
    ----------
    readings : sequence of ndarray of float64, shape (n, 5)
        Echoes of every sonar in time: rows of stamp, x, y, axis and range.
    max_pause : float
        Longest time between two of them, s.
    """
    bends = [np.empty(0)]
    for rows in readings:
        steady = np.diff(rows[:, 0]) <= max_pause
        bends.append(np.diff(rows[:, 4], n=2)[steady[1:] & steady[:-1]])
    every = np.abs(np.concatenate(bends))
    noise = float(_SIGMA_OF_MEDIAN * np.median(every) / math.sqrt(6.0)) if every.size else 0.0
    return min(noise, _LOUDEST)


def _pieces_of(
    readings: FloatArray, half_width: float, config: SonarGlassConfig, noise: float = 0.0
) -> FloatArray:
    """Pieces of one sonar: rows of stamp, sensor x, y, normal, range, sigmas, half extent, readings."""
    # evenly spread over a span s, readings tell the normal to noise / s^1.5
    longer = max(noise / _QUIET, 1.0) ** (2.0 / 3.0)
    table = np.empty((len(readings) + 2, COLUMNS))
    axis_sigma = half_width / math.sqrt(3.0)
    weight = (_LEAST_READING_SIGMA / axis_sigma) ** 2
    count = surface_pieces(
        readings, weight, half_width, config.max_pause, config.max_span * longer,
        max(config.max_residual, _SPREAD * noise), config.min_readings, table,
    )  # fmt: skip
    rows = np.empty((count, _PIECE_COLUMNS))
    for k, (first, last, normal, distance, rms, spread, low, high) in enumerate(table[:count]):
        part = readings[int(first) : int(last) + 1]
        n = len(part)
        sensor = part[:, 1:3].mean(axis=0)
        sigma = max(rms * math.sqrt(n / max(n - 2, 1)), _LEAST_READING_SIGMA)
        turn = 1.0 / math.sqrt(spread / sigma**2 + 1.0 / axis_sigma**2)
        reach = distance - sensor @ (math.cos(normal), math.sin(normal))
        rows[k] = (
            part[:, 0].mean(), *sensor, normal, reach, math.hypot(sigma / math.sqrt(n), config.range_bias),
            max(turn, _LEAST_NORMAL_SIGMA), 0.5 * (high - low), n,
        )  # fmt: skip
    return rows[rows[:, 6] <= math.radians(config.max_normal_sigma_deg)]


def passed_share(
    pieces: FloatArray, beams: BeamEvidence, node_poses: FloatArray, min_gap: float
) -> FloatArray:
    """Share of the lidar beams at each piece that go on beyond it, shape (k,); 0 where too few came by."""
    tree = cKDTree(node_poses[:, :2])
    shares = np.zeros(len(pieces))
    for k, piece in enumerate(pieces):
        normal = np.array([math.cos(piece[3]), math.sin(piece[3])])
        foot, length = piece[1:3] + piece[4] * normal, max(2.0 * piece[7], _SHORTEST)
        near = np.array(sorted(tree.query_ball_point(foot, _NEAR)), dtype=np.int64)
        solid, passed, nothing, ignored = (np.zeros(1, dtype=np.int64) for _ in range(4))
        for kind, on_line in ((beams.returns, solid), (beams.silent, nothing)):
            count_along_line(
                node_poses, kind.sensors, kind.ends, kind.first, near, foot,
                np.array([-normal[1], normal[0]]), -0.5 * length, length, _SOLID_BAND,
                max(min_gap, _SOLID_BAND), 0.0, 0.0, on_line, passed, ignored, ignored,
            )  # fmt: skip
        total = int(solid[0] + passed[0])
        shares[k] = passed[0] / total if total >= _FEWEST_BEAMS else 0.0
    return shares


def _bound(
    pieces: FloatArray, node_stamps: FloatArray, node_poses: FloatArray, config: SonarGlassConfig
) -> GlassObservations:
    """Pieces bound to the node nearest in time, in its frame."""
    _, nearest = cKDTree(np.asarray(node_stamps)[:, None]).query(pieces[:, :1])
    node = np.asarray(nearest, dtype=np.int64)
    normal = pieces[:, 3]
    end = pieces[:, 1:3] + pieces[:, 4, None] * np.column_stack((np.cos(normal), np.sin(normal)))
    local = between(node_poses[node], np.column_stack((end, normal)))
    sensor = between(node_poses[node], pieces[:, 1:4])
    return GlassObservations(
        node, local[:, :2].copy(), local[:, 2].copy(), sensor[:, :2].copy(), pieces[:, 8].copy(),
        np.full(len(pieces), config.probability), pieces[:, 5].copy(), pieces[:, 6].copy(),
        pieces[:, 7].copy(), np.full(len(pieces), SONAR, dtype=np.uint8),
    )  # fmt: skip
