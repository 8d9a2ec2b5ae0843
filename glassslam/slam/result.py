"""What a finished run hands to the outputs."""

from dataclasses import dataclass, field

from glassslam.config import Config
from glassslam.glass.layer import GlassLayer
from glassslam.posegraph.graph import Constraint
from glassslam.records import Float32Array, FloatArray, RecordingInfo, Trajectory


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


@dataclass(frozen=True, slots=True)
class MapResult:
    """Everything a run found out.

    Attributes
    ----------
    map : OccupancyMap
        The rendered map.
    trajectory : Trajectory
        Pose of the robot base at every used scan, in the map frame, in the order of the recording.
    local_trajectory : Trajectory
        The same poses as local SLAM saw them, in the local frame.
    partial_trajectory : Trajectory
        The poses of local SLAM, each moved as the last optimisation before it said; map frame.
    node_stamps : ndarray of float64, shape (n,)
        Times of the nodes, s.
    node_poses : ndarray of float64, shape (n, 3)
        Optimised poses of the base at the nodes, map frame.
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
    """

    map: OccupancyMap
    trajectory: Trajectory
    local_trajectory: Trajectory
    partial_trajectory: Trajectory
    node_stamps: FloatArray
    node_poses: FloatArray
    submap_nodes: tuple[int, ...]
    constraints: tuple[Constraint, ...]
    config: Config
    statistics: RunStatistics
    info: RecordingInfo | None = None
    glass: GlassLayer | None = None
