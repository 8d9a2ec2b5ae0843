"""What a finished run hands to the outputs."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from glassslam.config import Config, VolumeConfig
from glassslam.glass.layer import GlassLayer
from glassslam.posegraph.graph import Constraint
from glassslam.records import Damage, Float32Array, FloatArray, RecordingInfo, Trajectory
from glassslam.slam.node import Node
from glassslam.slam.trajectory import PoseTracks

if TYPE_CHECKING:  # made of results, which only hold them
    from glassslam.sonar.beam_width import BeamWidth
    from glassslam.volume.octree import Octree


@dataclass(frozen=True, slots=True)
class OccupancyMap:
    """A finished map.

    Attributes
    ----------
    probability : ndarray of float32, shape (rows, columns)
        P(occupied); NaN where never observed. Row 0 is the lowest y, column 0 the lowest x.
    resolution : float
        Cell edge, m.
    origin : tuple of float
        Lower left corner of cell (0, 0) in the map frame, m.
    """

    probability: Float32Array
    resolution: float
    origin: tuple[float, float]


@dataclass(slots=True)
class StageTime:
    """Seconds spent in one stage, summed over all threads."""

    wall: float = 0.0
    cpu: float = 0.0


@dataclass(frozen=True, slots=True)
class Degeneracy:
    """A stretch of a run that the scans did not decide, or where something was bridged.

    Attributes
    ----------
    kind : str
        "featureless", "featureless, no odometry", "odometry stuck", "motion missed",
        "odometry contradicted", "unmatched", "low overlap", "poor fit", "lost", "odometry jump",
        "clock jump" or "silence" (with ", not rejoined" where the map is in pieces), "closure rejected",
        "closure inconsistent", "closure ambiguous" or "closure taken out".
    first_scan, last_scan : int
        Numbers of the scans in the trajectory.
    start, end : float
        Their stamps, s.
    start_place, end_place : tuple of float
        Where the base was in the map, x and y, m.
    length : float
        Way travelled between, m.
    text : str
        What happened, in words.
    """

    kind: str
    first_scan: int
    last_scan: int
    start: float
    end: float
    start_place: tuple[float, float]
    end_place: tuple[float, float]
    length: float
    text: str


@dataclass(slots=True)
class RunStatistics:
    """Counts and times of a run, as they go into report.json.

    Attributes
    ----------
    scans_read, scans_used : int
        Scans delivered by the source; scans that have a pose in the trajectory.
    scans_dropped : dict
        Reason -> number of scans without a pose.
    messages_dropped : dict
        Reason -> number of messages of the recording that could not become records.
    recording_seconds : float
        Recorded time between the first and the last scan, s.
    stages : dict
        Stage name -> `StageTime`.
    nodes, submaps : int
        Size of the pose graph.
    closures_tried, closures_accepted : int
        Loop-closure searches made, constraints in the final graph.
    closures_rejected : dict
        Reason -> number of found matches that were thrown away.
    residuals : dict
        Name -> value (for example "loop_translation_rms" in m).
    glass_detector, glass_reason : str
        Detector in use, "off" without one; why it is in use, or why there is none.
    warnings : list of str
        What a user should know, one line each.
    damage : list of Damage
        What of the recording could not be read.
    solver_failures : int
        Times the pose graph could not be optimised; the poses of before were kept.
    tracking : dict
        What local SLAM had to do beside plain matching -> number of times; `closures_ambiguous`, which leave
        a direction free; and `stretches` of the run.
    degeneracies : list of Degeneracy
        What a reader of the map should know of, in the order of the recording.
    """

    scans_read: int = 0
    scans_used: int = 0
    scans_dropped: dict[str, int] = field(default_factory=dict)
    messages_dropped: dict[str, int] = field(default_factory=dict)
    recording_seconds: float = 0.0
    stages: dict[str, StageTime] = field(default_factory=dict)
    nodes: int = 0
    submaps: int = 0
    closures_tried: int = 0
    closures_accepted: int = 0
    closures_rejected: dict[str, int] = field(default_factory=dict)
    residuals: dict[str, float] = field(default_factory=dict)
    glass_detector: str = "off"
    glass_reason: str = ""
    warnings: list[str] = field(default_factory=list)
    damage: list[Damage] = field(default_factory=list)
    solver_failures: int = 0
    tracking: dict[str, int] = field(default_factory=dict)
    degeneracies: list[Degeneracy] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class SonarMaps:
    """What the sonars of a run add.

    Attributes
    ----------
    sweeps : int
        Sweeps within the time of the lidar.
    cone_width : float
        Full width of the cones in use, rad.
    cone : BeamWidth
        How wide the cones of the sonars are, measured against the map of the lidar.
    sonar_map : OccupancyMap
        Map of the sonars alone.
    fused_map : OccupancyMap
        Lidar and sonar joined.
    source : ndarray of uint8, shape (rows, columns), or None
        Who decided each cell of the fused map: 1 the lidar, 2 the sonar, 3 both, 0 neither; None for rules in
        which no one decides.
    """

    sweeps: int
    cone_width: float
    cone: "BeamWidth"
    sonar_map: OccupancyMap
    fused_map: OccupancyMap
    source: NDArray[np.uint8] | None


@dataclass(frozen=True, slots=True)
class VolumeMaps:
    """What the 3D ultrasonic sensors of a run add.

    Attributes
    ----------
    tree : Octree
        Voxels of lidar and points together, in the map frame, heights above the base.
    config : VolumeConfig
        How it was made.
    map : OccupancyMap
        The voxels of the band of heights seen from above.
    lidar_height : float
        Height of the plane of the lidar, m.
    counts : dict
        "scans", "point_sets", "points", "pairs" -> how many were used; of the scans, those that are nodes.
    dropped : dict
        Reason -> number of pings or points that were not used.
    """

    tree: "Octree"
    config: VolumeConfig
    map: OccupancyMap
    lidar_height: float
    counts: Mapping[str, int]
    dropped: Mapping[str, int]

    @property
    def band(self) -> tuple[float, float]:
        """Lowest and highest height that goes into the map, m above the base."""
        return self.config.band_low, self.config.band_high


@dataclass(frozen=True, slots=True)
class MapResult:
    """Everything a run found out.

    Attributes
    ----------
    map : OccupancyMap
        The rendered map, with its glass.
    lidar_map : OccupancyMap
        The map of the beams alone, without what is known of glass.
    closed_map : OccupancyMap or None
        The map in which no beam goes through glass; only where other sensors than the lidar took part.
    tracks : PoseTracks
        Poses of scans and nodes, before and after optimisation.
    submap_nodes : tuple of int
        First node of every submap.
    constraints : tuple of Constraint
        Edges of the pose graph; vertex i is node i.
    config : Config
        The resolved configuration.
    statistics : RunStatistics
        Counts and times.
    info : RecordingInfo or None
        The source, when the run had one.
    glass : GlassLayer or None
        Glass walls and observations; None when glass was not looked for.
    sonar : SonarMaps or None
        Maps of the sonars and of lidar and sonar together; None without sonar.
    nodes : tuple of Node
        The scans that went into the map.
    volume : VolumeMaps or None
        Voxels of the lidar and of the points of 3D ultrasonic sensors; None without points.
    """

    map: OccupancyMap
    lidar_map: OccupancyMap
    closed_map: OccupancyMap | None
    tracks: PoseTracks
    submap_nodes: tuple[int, ...]
    constraints: tuple[Constraint, ...]
    config: Config
    statistics: RunStatistics
    info: RecordingInfo | None = None
    glass: GlassLayer | None = None
    sonar: SonarMaps | None = None
    nodes: tuple[Node, ...] = ()
    volume: VolumeMaps | None = None

    @property
    def trajectory(self) -> Trajectory:
        """Pose of the robot base at every used scan, in the map frame, in the order of the recording."""
        return self.tracks.final

    @property
    def node_stamps(self) -> FloatArray:
        """Times of the nodes, s, shape (n,)."""
        return self.tracks.nodes.stamps

    @property
    def node_poses(self) -> FloatArray:
        """Optimised poses of the base at the nodes, map frame, shape (n, 3)."""
        return self.tracks.nodes.poses
