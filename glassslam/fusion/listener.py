"""What sonars add to a run: pieces of glass before the walls are fitted, maps afterwards."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from glassslam.config import SonarConfig
from glassslam.fusion.fuse import FusedMap, fuse
from glassslam.fusion.layer_kernels import clear_rays
from glassslam.fusion.revisit import FREE, side_sonars
from glassslam.fusion.revisit_kernels import revisit
from glassslam.glass.beams import BeamEvidence
from glassslam.glass.layer import wall_cells
from glassslam.glass.observations import GlassObservations
from glassslam.records import Float32Array, FloatArray, RangeRing, SonarRing
from glassslam.slam.result import MapResult, OccupancyMap, SonarMaps
from glassslam.slam.trajectory import PoseTracks
from glassslam.sonar.beam_width import measure_beam_width
from glassslam.sonar.glass import sonar_glass_observations
from glassslam.sonar.mapping import beam_width, build_sonar_map
from glassslam.sonar.poses import PoseKind
from glassslam.sonar.sweeps import SonarSweeps, placed_sweeps

_OCCUPIED = 0.65
_LIDAR, _SONAR, _BOTH = 1, 2, 3
_ROUNDING = 1e-3
_SIGHTS = 72


class SonarListener:
    """Takes the sweeps of a run.

    Parameters
    ----------
    ring : SonarRing
        Where the sonars sit in the base frame.
    config : SonarConfig
        Glass from sonar, sonar map and fusion.
    sweeps : sequence of RangeRing
        Readings, in the order of the recording.

    Examples
    --------
    >>> import numpy as np
    >>> import glassslam as gs
    >>> ring = gs.SonarRing(np.zeros((1, 3)), 0.3, 0.2, 5.0)
    >>> sweeps = [gs.RangeRing(0.0, np.array([1.0], dtype=np.float32))]
    >>> len(SonarListener(ring, gs.Config().sonar, sweeps))
    1
    """

    def __init__(self, ring: SonarRing, config: SonarConfig, sweeps: Sequence[RangeRing]) -> None:
        self._ring, self._config, self._records = ring, config, sweeps

    def __len__(self) -> int:
        return len(self._records)

    def glass(self, tracks: PoseTracks, beams: BeamEvidence) -> GlassObservations:
        """Pieces of glass that the sonars hear and the lidar looks through, bound to the nodes.

        Parameters
        ----------
        tracks : PoseTracks
            Poses of the run.
        beams : BeamEvidence
            Beams of all nodes.
        """
        sweeps = self._placed(tracks, "FGfit")
        nodes = tracks.nodes
        return sonar_glass_observations(sweeps, beams, nodes.stamps, nodes.poses, self._config)

    def joined(self, result: MapResult) -> MapResult:
        """The result with the map of the sonars, and that of lidar and sonar as the configuration says.

        Revisited rays always start at the final interpolated poses (pi-map, section III-C), whatever poses
        the sonar map is made with.

        Raises
        ------
        GridError
            A sweep with another number of ranges than the ring has sonars.
        """
        config, tracks = self._config, result.tracks
        sweeps = self._placed(tracks, config.pose_kind)
        sonar_map = build_sonar_map(sweeps, config)
        final = sweeps if config.pose_kind == "FGfit" else self._placed(tracks, "FGfit")
        if config.fusion.method == "walls":
            fused = by_walls(result, final, config)
        else:
            # the end points of the overlay belong to the sonar layer and keep its poses
            used = sweeps if config.fusion.method == "overlay" else final
            fused = fuse(config.fusion.method, result.lidar_map, sonar_map, used, config.fusion)
        cone = measure_beam_width(final, result.lidar_map)
        width = beam_width(sweeps, config)
        maps = SonarMaps(len(sweeps.stamps), width, cone, sonar_map, fused.map, fused.source)
        return replace(result, sonar=maps)

    def _placed(self, tracks: PoseTracks, kind: PoseKind) -> SonarSweeps:
        """The sweeps of the sonars in use."""
        sweeps = placed_sweeps(self._records, self._ring, tracks, kind)
        return sweeps.only(side_sonars(self._ring)) if self._config.fusion.sonars == "sides" else sweeps


def by_walls(result: MapResult, sweeps: SonarSweeps, config: SonarConfig) -> FusedMap:
    """The decision layer of the project: glass walls from all sensors, which no beam of the lidar passes.

    Every sensor gives oriented pieces of surface with its own uncertainty; walls are fitted to all of them
    together, and the beams of the lidar decide how far they reach. The map is that of the lidar, with its
    beams ending at the walls. What it has seen and not decided is free in sight of the path, up to what is
    occupied; where no beam came, it is free up to where a sonar heard something. One return with nothing
    beside it is no obstacle, but noise or a mirror image.

    Parameters
    ----------
    result : MapResult
        A run with `closed_map`.
    sweeps : SonarSweeps
        Readings at the final poses.
    config : SonarConfig
        Longest reading used.
    """
    closed = _without_lone_returns(result.closed_map or result.map, result.config.map.hit_probability)
    unknown = np.isnan(closed.probability)
    added = unknown & _cleared(closed, sweeps, config)
    probability = np.where(added, np.float32(FREE), _in_sight(closed, result.tracks.nodes.poses))
    source = np.where(unknown, 0, _LIDAR).astype(np.uint8)
    source[added] = _SONAR
    _mark_walls(source, result, (source.shape[0], source.shape[1]), closed)
    return FusedMap(OccupancyMap(probability, closed.resolution, closed.origin), source)


def _without_lone_returns(grid: OccupancyMap, hit_probability: float) -> OccupancyMap:
    """The map without occupied cells that no other touches and that rest on a single return."""
    occupied = grid.probability > _OCCUPIED
    count = np.pad(occupied.astype(np.uint8), 1)
    rows = count[:-2] + count[1:-1] + count[2:]
    around = rows[:, :-2] + rows[:, 1:-1] + rows[:, 2:]
    lone = occupied & (around == 1) & (grid.probability < hit_probability + _ROUNDING)
    return replace(grid, probability=np.where(lone, np.float32(np.nan), grid.probability))


def _in_sight(grid: OccupancyMap, poses: FloatArray) -> Float32Array:
    """P(occupied) with the cells made free that the lidar has seen, and that lie in sight of the path.

    Lines of sight go all around from poses (n, 3) and end at what is occupied, however far away; those that
    nothing stops tell nothing. Where the odds of the map need many beams, much of a room is seen and not
    decided.
    """
    occupied = grid.probability > _OCCUPIED
    rays = np.repeat(poses, _SIGHTS, axis=0)
    rays[:, :2] = (rays[:, :2] - np.asarray(grid.origin)) / grid.resolution
    rays[:, 2] += np.tile(np.arange(_SIGHTS) * (2.0 * np.pi / _SIGHTS), len(poses))
    path = np.empty((sum(occupied.shape), 2), dtype=np.int64)
    paved, source = grid.probability.copy(), np.zeros(occupied.shape, dtype=np.uint8)
    revisit(rays, occupied, occupied, math.inf, True, FREE, _OCCUPIED, path, paved, source)
    open_to_view = (source > 0) & ~occupied & ~np.isnan(grid.probability)
    return np.where(open_to_view, np.minimum(grid.probability, np.float32(FREE)), grid.probability)


def _cleared(grid: OccupancyMap, sweeps: SonarSweeps, config: SonarConfig) -> NDArray[np.bool_]:
    """Cells of a map on the axes of sonars, up to their readings and to what is occupied."""
    ranges, ring = sweeps.ranges, sweeps.ring
    heard = np.isfinite(ranges) & (ranges >= ring.range_min)
    sensors = sweeps.sensors[heard]
    axes = np.column_stack((np.cos(sensors[:, 2]), np.sin(sensors[:, 2])))
    reach = np.minimum(ranges[heard], min(config.max_range, ring.range_max)) - config.arc_thickness
    starts = (sensors[:, :2] - np.asarray(grid.origin)) / grid.resolution
    ends = starts + np.maximum(reach, 0.0)[:, None] * axes / grid.resolution
    cleared = np.zeros(grid.probability.shape, dtype=np.bool_)
    clear_rays(starts, ends, grid.probability > _OCCUPIED, cleared)
    return cleared


def _mark_walls(
    source: NDArray[np.uint8], result: MapResult, shape: tuple[int, int], grid: OccupancyMap
) -> None:
    """Say in the cells of glass walls which sensors saw them."""
    for wall in result.glass.walls if result.glass else ():
        by_lidar, by_sonar = wall.observations > wall.by_sonar, wall.by_sonar > 0
        who = _BOTH if by_lidar and by_sonar else _SONAR if by_sonar else _LIDAR
        source[wall_cells([wall], shape, grid.origin, grid.resolution)] = who
