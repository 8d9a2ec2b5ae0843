"""What 3D ultrasonic sensors add to a run: a volume along its trajectory, and a map of a band of heights."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from glassslam.config import VolumeConfig
from glassslam.errors import GridError
from glassslam.records import FloatArray, PointSet
from glassslam.slam.ghost_rays import visible_rays
from glassslam.slam.result import MapResult, VolumeMaps
from glassslam.slam.stopwatch import Stages
from glassslam.volume.mapper import Volume, VolumeMapper, lifted
from glassslam.volume.octree import CENTRE, Octree
from glassslam.volume.options import volume_options
from glassslam.volume.projection import project

if TYPE_CHECKING:  # runs that do not look for glass need not load what finds it
    from glassslam.glass.walls import GlassWall

_STAGE = "volume"


class VolumeListener:
    """Takes the points of a run.

    Parameters
    ----------
    config : VolumeConfig
        Voxels, sensors and fusion.
    points : sequence of PointSet
        Points of all pings, in the order of the recording.
    laser_height : float, optional
        Height of the lidar above the base as the recording tells it, m.

    Examples
    --------
    >>> import numpy as np
    >>> import glassslam as gs
    >>> points = [gs.PointSet(0.0, np.array([[1.0, 0.0, 0.5]], dtype=np.float32), np.zeros(3))]
    >>> len(VolumeListener(gs.Config().volume, points, laser_height=0.3))
    1
    """

    def __init__(
        self, config: VolumeConfig, points: Sequence[PointSet], laser_height: float | None = None
    ) -> None:
        self._config, self._records, self._laser_height = config, points, laser_height

    def __len__(self) -> int:
        return len(self._records)

    def joined(self, result: MapResult) -> MapResult:
        """The result with the volume of its lidar and of the points, as the configuration says.

        The lidar takes part with the scans that are nodes, whose rays are those of the map: mirror images end
        where the map lets them end, and glass walls stand in the plane of the lidar. Points are placed along
        the poses of all scans. Without a single ping the result stays as it is.

        Parameters
        ----------
        result : MapResult
            A finished run.
        """
        if not self._records:
            return result
        stages, maps = Stages(), None
        with stages.measure(_STAGE):
            try:
                maps = self._maps(result)
            except GridError as error:  # too large: no reason to lose the map
                warnings = [f"there is no volume: {error.message} ({error.hint})"]
            else:
                warnings = list(_warnings(maps))
        statistics = replace(
            result.statistics,
            stages={**result.statistics.stages, **stages.times},
            warnings=[*result.statistics.warnings, *warnings],
        )
        return replace(result, statistics=statistics, volume=maps)

    def _maps(self, result: MapResult) -> VolumeMaps:
        options = volume_options(self._config, result.config.sensor, self._laser_height)
        mapper = VolumeMapper(result.trajectory, options)
        _feed(mapper, result, self._records)
        volume = mapper.finish()
        if volume.fused.count() == (0, 0):
            raise GridError("nothing of it could be placed", _listed(volume.dropped))
        if result.glass is not None and result.config.glass.scheme != "off":
            lock_walls(volume.fused, result.glass.walls, options.lidar_height)
        return self._described(volume, options.lidar_height)

    def _described(self, volume: Volume, height: float) -> VolumeMaps:
        band = self._config.band_low, self._config.band_high
        return VolumeMaps(
            tree=volume.fused,
            config=self._config,
            map=project(volume.fused, band, self._config.projection),
            lidar_height=height,
            counts=dict(volume.counts),
            dropped=dict(volume.dropped),
        )


def _feed(mapper: VolumeMapper, result: MapResult, records: Sequence[PointSet]) -> None:
    """Scans of the nodes and points in the order of their stamps: pairs are found among neighbours."""
    ghosts = None if result.glass is None else result.glass.ghosts
    rays = list(visible_rays(result.nodes, ghosts, result.config.glass.ghosts_in_map))
    stamps = np.array([*(node.stamp for node in result.nodes), *(record.stamp for record in records)])
    count = len(result.nodes)
    for k in np.argsort(stamps, kind="stable").tolist():
        if k >= count:
            mapper.add(records[k - count])
            continue
        node, (returns, free_ends) = result.nodes[k], rays[k]
        mapper.add_rays(node.stamp, result.node_poses[k], node.sensor, returns, free_ends)


def _warnings(maps: VolumeMaps) -> Iterator[str]:
    lost, used = sum(maps.dropped.values()), maps.counts["points"]
    if lost > used:
        yield f"the volume holds {used} points, and more was left out: {_listed(maps.dropped)}"
    yield from plane_warnings(maps.lidar_height, maps.band)


def plane_warnings(height: float, band: tuple[float, float]) -> Iterator[str]:
    """That the map of a volume holds nothing of the lidar, whose height (m) is not in its band (m)."""
    low, high = band
    if not low <= height <= high:
        yield (
            f"the plane of the lidar, {height:g} m above the base, lies outside of the heights"
            f" {low:g} to {high:g} m of the map of the volume (volume.lidar_height, volume.band_low)"
        )


def _listed(dropped: Mapping[str, int]) -> str:
    return ", ".join(f"{count} x {reason}" for reason, count in dropped.items())


def lock_walls(tree: Octree, walls: "Sequence[GlassWall]", height: float) -> None:
    """Make the voxels of glass walls in the plane of the lidar occupied, whatever has passed through them.

    Parameters
    ----------
    tree : Octree
        The volume.
    walls : sequence of GlassWall
        Walls in the map frame.
    height : float
        Height of the plane of the lidar, m.
    """
    places = [lifted(_along(wall, 0.5 * tree.resolution), height) for wall in walls]
    if not places:
        return
    points = np.concatenate(places)
    inside = (np.abs(points) < (CENTRE - 1) * tree.resolution).all(axis=1)
    codes = np.unique(tree.codes(points[inside]))
    certain = np.float32(tree.clamp.high - tree.clamp.low)
    tree.add_sorted(codes, np.full(codes.size, certain, dtype=np.float32))


def _along(wall: "GlassWall", step: float) -> FloatArray:
    """Places (n, 2) on a wall from end to end, at most a step apart, m."""
    count = int(np.ceil(wall.length / step)) + 1
    return np.linspace(wall.start, wall.end, max(count, 2))
