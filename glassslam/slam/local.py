"""Local SLAM: every scan is matched against the active submap, some become nodes."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from glassslam.config import Config
from glassslam.geometry import transform_points
from glassslam.grid.probability_grid import OddsModel
from glassslam.grid.submap import ActiveSubmaps, Submap
from glassslam.records import FloatArray
from glassslam.slam.extrapolator import Prediction
from glassslam.slam.glass_locks import GlassLocks, miss_probability
from glassslam.slam.motion_filter import MotionFilter
from glassslam.slam.node import Node
from glassslam.slam.range_data import RangeData, thin
from glassslam.slam.tracker import Tracker
from glassslam.slam.tracking import How, Match, MatchLog, Tracking

__all__ = ["How", "LocalResult", "LocalSlam", "Match", "Tracking", "prepared"]

_NO_POINTS = np.empty((0, 2))
Points: TypeAlias = Callable[[], FloatArray]


def _no_glass() -> FloatArray:
    return _NO_POINTS


@dataclass(frozen=True, slots=True)
class LocalResult:
    """What local SLAM made of a scan.

    Attributes
    ----------
    match : Match
        Where it fits.
    node : Node or None
        The node, when the scan became one.
    submaps : list of Submap
        The submaps the node went into.
    finished : list of Submap
        The submaps it completed: one, or at the start of a new stretch all that were active.
    """

    match: Match
    node: Node | None
    submaps: list[Submap]
    finished: list[Submap]

    @property
    def pose_in_local(self) -> FloatArray:
        """Pose of the base in the local frame, shape (3,), m and rad."""
        return self.match.pose


class LocalSlam:
    """Tracks the robot against the submap being built.

    Attributes
    ----------
    locks : GlassLocks
        Glass to be locked in the submaps, by the schemes that do so.
    log : MatchLog
        The match of every scan entered.
    """

    def __init__(self, config: Config) -> None:
        self._config = config
        odds = OddsModel(config.submap.hit_probability, miss_probability(config))
        self._submaps = ActiveSubmaps(config.submap.resolution, odds, config.submap.num_range_data)
        self.locks = GlassLocks(config)
        self.log = MatchLog()
        self._motion_filter = MotionFilter(config.motion_filter)
        self._tracker = Tracker(config)
        self._nodes = 0

    @property
    def tracking(self) -> Tracking:
        """What matching carries from scan to scan; may be set to what it was at another scan."""
        return self._tracker.tracking

    @tracking.setter
    def tracking(self, tracking: Tracking) -> None:
        self._tracker.tracking = tracking

    def add(self, data: RangeData, prediction: Prediction, glass: Points = _no_glass) -> LocalResult:
        """Match one scan and enter it when the motion filter admits it.

        Parameters
        ----------
        data : RangeData
            The scan.
        prediction : Prediction
            Where it is expected.
        glass : callable
            Points of glass seen in it, ndarray of float64, shape (k, 2), frame of the base, m; asked for only
            when the scan becomes a node.
        """
        return self.enter(self.match(data, prediction), data, glass)

    def match(self, data: RangeData, prediction: Prediction) -> Match:
        """Where a scan fits; changes `tracking` and nothing else.

        Parameters
        ----------
        data : RangeData
            The scan.
        prediction : Prediction
            Where it is expected.
        """
        submap = self._submaps.matching
        return self._tracker.match(None if submap is None else submap.grid, data, prediction)

    def enter(self, match: Match, data: RangeData, glass: Points = _no_glass) -> LocalResult:
        """Make a node of a scan where the motion filter admits it; `match` may be one of an earlier run.

        Parameters
        ----------
        match : Match
            Where the scan fits.
        data : RangeData
            The scan.
        glass : callable
            As for `add`.
        """
        scan, pose = len(self.log), match.pose
        self.log.add(match)
        begins = match.how is How.FIRST and self._nodes > 0
        ended = self._end_stretch() if begins else []
        if not self._motion_filter.admits(data.stamp, pose):
            return LocalResult(match, None, [], [])
        node = Node(
            self._nodes, scan, data.stamp, pose, data.sensor, data.returns.astype(np.float32),
            data.free_ends.astype(np.float32), match.residual, match.doubtful,
            data.ghosts.astype(np.float32), begins,
        )  # fmt: skip
        self._nodes += 1
        self.tracking.doubtful = False
        seen = glass() if self.locks.is_on else _NO_POINTS
        entered, finished = self._submaps.insert(
            node.index,
            pose,
            transform_points(pose, data.sensor[None])[0],
            transform_points(pose, data.returns),
            transform_points(pose, data.free_ends),
            glass=self.locks.seen(transform_points(pose, seen)),
            known_glass=self.locks.known(pose) if self._submaps.starts_next else _NO_POINTS,
        )
        return LocalResult(match, node, entered, ended if finished is None else [*ended, finished])

    def _end_stretch(self) -> list[Submap]:
        """Complete the active submaps, so that the next scan starts new ones."""
        self._motion_filter = MotionFilter(self._config.motion_filter)
        return self._submaps.finish()

    def finish(self) -> list[Submap]:
        """Complete the active submaps."""
        return self._submaps.finish()


def prepared(data: RangeData, voxel_edge: float) -> RangeData:
    """The scan with its returns thinned by the first voxel filter."""
    returns, ghosts = thin(data.returns, voxel_edge), thin(data.ghosts, voxel_edge)
    return RangeData(data.stamp, data.sensor, returns, data.free_ends, ghosts)
