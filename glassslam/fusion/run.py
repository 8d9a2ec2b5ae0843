"""From the sweeps of a recording to its sonar map and its fused map, in one call."""

from collections.abc import Iterable
from dataclasses import dataclass

from glassslam.config import SonarConfig
from glassslam.fusion.fuse import FusedMap, fuse
from glassslam.records import RangeRing, SonarRing
from glassslam.slam.result import OccupancyMap
from glassslam.sonar.mapping import build_sonar_map
from glassslam.sonar.poses import PoseTracks
from glassslam.sonar.sweeps import SonarSweeps, placed_sweeps


@dataclass(frozen=True, slots=True)
class SonarLayer:
    """What the sonars of a run add.

    Attributes
    ----------
    sweeps : SonarSweeps
        Sweeps with their poses.
    sonar_map : OccupancyMap
        Map of the sonars alone.
    fused : FusedMap
        Lidar and sonar joined.
    """

    sweeps: SonarSweeps
    sonar_map: OccupancyMap
    fused: FusedMap


def fuse_recording(
    records: Iterable[RangeRing],
    ring: SonarRing,
    tracks: PoseTracks,
    lidar_map: OccupancyMap,
    config: SonarConfig,
) -> SonarLayer:
    """Place the sweeps, map them, and join the map with that of the lidar, as `config` says.

    Revisited rays always start at the final interpolated poses (pi-map, section III-C), whatever poses the
    sonar map is made with.

    Parameters
    ----------
    records : iterable of RangeRing
        Sweeps in the order of the recording.
    ring : SonarRing
        Where the sonars sit in the base frame.
    tracks : PoseTracks
        Poses of the run.
    lidar_map : OccupancyMap
        Map of the lidar in the frame of the final poses.
    config : SonarConfig
        Algorithm, kind of poses, fusion.

    Raises
    ------
    GridError
        A sweep with another number of ranges than the ring has sonars.
    """
    recorded = list(records)
    sweeps = placed_sweeps(recorded, ring, tracks, config.pose_kind)
    sonar_map = build_sonar_map(sweeps, config)
    revisited = sweeps if config.pose_kind == "FGfit" else placed_sweeps(recorded, ring, tracks, "FGfit")
    # the end points of the overlay belong to the sonar layer and keep its poses
    used = sweeps if config.fusion.method == "overlay" else revisited
    return SonarLayer(
        sweeps, sonar_map, fuse(config.fusion.method, lidar_map, sonar_map, used, config.fusion)
    )
