"""Offline 2D lidar SLAM: from a recording to a loop-closed map.

Examples
--------
Map a recording and write every result::

    import glassslam as gs

    result = gs.map_recording("run.bag", gs.Config.load("robot.yaml"))
    gs.write_results(result, "run-map")

Feed records one by one::

    mapper = gs.Mapper(gs.Config())
    for record in gs.open_recording(["run.bag"], gs.SourceOptions()).records():
        mapper.add(record)
    result = mapper.finish()
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from glassslam.api import Progress, map_recording, run_slam
    from glassslam.config import Config
    from glassslam.errors import GlassSlamError
    from glassslam.evaluation import (
        Relations,
        absolute_trajectory_error,
        evaluate_relations,
        read_relations,
        relative_pose_error,
    )
    from glassslam.finished import FinishedRun
    from glassslam.grid.probability_grid import ProbabilityGrid
    from glassslam.matching import BranchAndBoundMatcher, match_scan
    from glassslam.outputs import read_g2o, read_map, read_tum, write_results
    from glassslam.posegraph import PoseGraph
    from glassslam.records import (
        Imu,
        LaserScan,
        Odometry,
        PointSet,
        RangeRing,
        RecordingInfo,
        SonarRing,
        Trajectory,
    )
    from glassslam.session import Session
    from glassslam.slam.mapper import Mapper
    from glassslam.slam.result import MapResult, OccupancyMap
    from glassslam.sources import SourceOptions, open_recording

# Loaded on first use: `import glassslam` and `glassslam --help` must not wait for numba and casadi.
_HOMES = {
    "BranchAndBoundMatcher": "glassslam.matching",
    "Config": "glassslam.config",
    "FinishedRun": "glassslam.finished",
    "GlassSlamError": "glassslam.errors",
    "Imu": "glassslam.records",
    "LaserScan": "glassslam.records",
    "MapResult": "glassslam.slam.result",
    "Mapper": "glassslam.slam.mapper",
    "OccupancyMap": "glassslam.slam.result",
    "Odometry": "glassslam.records",
    "PointSet": "glassslam.records",
    "PoseGraph": "glassslam.posegraph",
    "ProbabilityGrid": "glassslam.grid.probability_grid",
    "Progress": "glassslam.api",
    "RangeRing": "glassslam.records",
    "RecordingInfo": "glassslam.records",
    "Relations": "glassslam.evaluation",
    "Session": "glassslam.session",
    "SonarRing": "glassslam.records",
    "SourceOptions": "glassslam.sources",
    "Trajectory": "glassslam.records",
    "absolute_trajectory_error": "glassslam.evaluation",
    "evaluate_relations": "glassslam.evaluation",
    "map_recording": "glassslam.api",
    "match_scan": "glassslam.matching",
    "open_recording": "glassslam.sources",
    "read_g2o": "glassslam.outputs",
    "read_map": "glassslam.outputs",
    "read_relations": "glassslam.evaluation",
    "read_tum": "glassslam.outputs",
    "relative_pose_error": "glassslam.evaluation",
    "run_slam": "glassslam.api",
    "write_results": "glassslam.outputs",
}

__all__ = [
    "BranchAndBoundMatcher",
    "Config",
    "FinishedRun",
    "GlassSlamError",
    "Imu",
    "LaserScan",
    "MapResult",
    "Mapper",
    "OccupancyMap",
    "Odometry",
    "PointSet",
    "PoseGraph",
    "ProbabilityGrid",
    "Progress",
    "RangeRing",
    "RecordingInfo",
    "Relations",
    "Session",
    "SonarRing",
    "SourceOptions",
    "Trajectory",
    "absolute_trajectory_error",
    "evaluate_relations",
    "map_recording",
    "match_scan",
    "open_recording",
    "read_g2o",
    "read_map",
    "read_relations",
    "read_tum",
    "relative_pose_error",
    "run_slam",
    "write_results",
]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return _version()
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = globals()[name] = getattr(import_module(_HOMES[name]), name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__, "__version__"})


def _version() -> str:
    from importlib.metadata import PackageNotFoundError, version  # noqa: PLC0415  (20 ms)

    try:
        return version("glassslam")
    except PackageNotFoundError:
        return "unknown"
