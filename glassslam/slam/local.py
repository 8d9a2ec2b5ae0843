"""Local SLAM: every scan is matched against the active submap, some become nodes."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from glassslam.config import Config
from glassslam.geometry import transform_points
from glassslam.grid.probability_grid import OddsModel, ProbabilityGrid
from glassslam.grid.submap import ActiveSubmaps, Submap
from glassslam.matching.branch_and_bound import BranchAndBoundMatcher
from glassslam.matching.correlative import search_around
from glassslam.matching.gradient import MatchResult, match_scan
from glassslam.records import FloatArray
from glassslam.slam.extrapolator import Prediction
from glassslam.slam.glass_locks import GlassLocks, miss_probability
from glassslam.slam.motion_filter import MotionFilter
from glassslam.slam.node import Node
from glassslam.slam.range_data import RangeData, thin, thin_adaptively

_CALM_DISTANCE = 0.1
_CALM_ROTATION = 0.05
_WEAK_WEIGHT = 0.03
_COASTING_SHARE = 0.3
_LOST_RATIO = 1.15
_LOST_AFTER_GAP = 1.05
_SETTLING_SCANS = 5
_LOST_WINDOW, _LOST_TURN = 1.5, 2.0
_LOST_SCORE = 0.5
_NO_POINTS = np.empty((0, 2))
Points: TypeAlias = Callable[[], FloatArray]


@dataclass(frozen=True, slots=True)
class LocalResult:
    """What local SLAM made of a scan.

    Attributes
    ----------
    pose_in_local : ndarray of float64, shape (3,)
        Pose of the base, m and rad.
    node : Node or None
        The node, when the scan became one.
    submaps : list of Submap
        The submaps the node went into.
    finished : Submap or None
        The submap it completed.
    """

    pose_in_local: FloatArray
    node: Node | None
    submaps: list[Submap]
    finished: Submap | None


class LocalSlam:
    """Tracks the robot against the submap being built.

    Attributes
    ----------
    searches, searches_taken, coasted, unmatched : int
        Correlative searches made and believed, odometry jumps overruled by constant velocity, and
        scans with too few returns to match.
    locks : GlassLocks
        Glass to be locked in the submaps, by the schemes that do so.
    """

    def __init__(self, config: Config) -> None:
        self._config = config
        odds = OddsModel(config.submap.hit_probability, miss_probability(config))
        self._submaps = ActiveSubmaps(config.submap.resolution, odds, config.submap.num_range_data)
        self.locks = GlassLocks(config)
        self._motion_filter = MotionFilter(config.motion_filter)
        self._usual_residual = 0.5
        self._scans = 0
        self._since_gap = 0
        self._doubtful = False
        self._nodes = 0
        self.searches = self.searches_taken = self.coasted = self.unmatched = 0
        self.relocalisations = self.relocalised = 0

    def add(self, data: RangeData, prediction: Prediction, glass: Points = lambda: _NO_POINTS) -> LocalResult:
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
        pose, residual = self._match(data, prediction)
        scan = self._scans
        self._scans += 1
        if not self._motion_filter.admits(data.stamp, pose):
            return LocalResult(pose, None, [], None)
        node = Node(
            self._nodes, scan, data.stamp, pose, data.sensor, data.returns.astype(np.float32),
            data.free_ends.astype(np.float32), residual, self._doubtful, data.ghosts.astype(np.float32),
        )  # fmt: skip
        self._nodes += 1
        self._doubtful = False
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
        return LocalResult(pose, node, entered, finished)

    def finish(self) -> list[Submap]:
        """Complete the active submaps."""
        return self._submaps.finish()

    def _match(self, data: RangeData, prediction: Prediction) -> tuple[FloatArray, float]:
        submap = self._submaps.matching
        if submap is None:
            return prediction.pose_in_local, self._usual_residual
        filters, local = self._config.filter, self._config.local
        points = thin_adaptively(data.returns, filters.adaptive_max_length, filters.adaptive_min_num_points)
        if len(points) < local.min_num_points:
            self.unmatched += 1
            return prediction.pose_in_local, self._usual_residual
        best = self._match_near(submap.grid, points, prediction, prediction.pose_in_local)
        if prediction.alternative is not None:
            coasting = self._match_near(submap.grid, points, prediction, prediction.alternative)
            if coasting.residual < best.residual - 0.02:
                best = coasting
                self.coasted += 1
                self._doubtful = True
        if self._is_doubtful(best, prediction):
            best = self._search(submap.grid, points, best)
        self._since_gap = 0 if prediction.after_gap else self._since_gap + 1
        self._doubtful |= prediction.after_gap and prediction.distance + prediction.rotation > _CALM_DISTANCE
        unsettled = self._since_gap < _SETTLING_SCANS
        limit = _LOST_AFTER_GAP if unsettled else _LOST_RATIO
        if best.residual > limit * self._usual_residual + 0.02:
            # in a corridor a slide along it always fits a little better somewhere
            best = self._relocalise(submap.grid, points, best, 0.03 if unsettled else 0.08)
        self._usual_residual = 0.9 * self._usual_residual + 0.1 * best.residual
        return best.pose, best.residual

    def _match_near(
        self, grid: ProbabilityGrid, points: FloatArray, prediction: Prediction, start: FloatArray
    ) -> MatchResult:
        """Gradient match whose prior weighs less the more the robot moved, as odometry errs by the way."""
        local = self._config.local
        trust = 1.0 if prediction.measured else _COASTING_SHARE
        return match_scan(
            grid,
            points,
            start,
            occupied_space_weight=local.occupied_space_weight,
            translation_weight=trust
            * local.translation_weight
            / math.sqrt(prediction.distance + _CALM_DISTANCE),
            rotation_weight=trust * local.rotation_weight / math.sqrt(prediction.rotation + _CALM_ROTATION),
            max_iterations=local.max_num_iterations,
            solver=local.solver,
        )

    def _is_doubtful(self, match: MatchResult, prediction: Prediction) -> bool:
        mode = self._config.local.correlative_search
        if mode != "when_doubtful":
            return mode == "always"
        return match.residual > 1.1 * self._usual_residual + 0.01 or prediction.rotation > 0.15

    def _search(self, grid: ProbabilityGrid, points: FloatArray, found: MatchResult) -> MatchResult:
        """Real-time correlative search around a doubtful match; taken only when clearly better."""
        local = self._config.local
        self.searches += 1
        start = search_around(
            grid,
            points,
            found.pose,
            local.search_linear_window,
            math.radians(local.search_angular_window_deg),
        )
        refined = self._refine(grid, points, start)
        if refined.residual < found.residual - 0.05:
            self.searches_taken += 1
            self._doubtful = True
            return refined
        return found

    def _relocalise(
        self, grid: ProbabilityGrid, points: FloatArray, found: MatchResult, gain: float
    ) -> MatchResult:
        """Branch and bound in the submap after tracking was lost, as after a gap in the recording.

        The new place is taken when its residual is lower by `gain`.
        """
        self.relocalisations += 1
        matcher = BranchAndBoundMatcher(grid, _LOST_WINDOW)
        coarse = points[:: max(1, len(points) // 150)]
        match = matcher.match(coarse, found.pose, _LOST_WINDOW, _LOST_TURN, _LOST_SCORE)
        if match is None:
            return found
        refined = self._refine(grid, points, match.pose)
        if refined.residual < found.residual - gain:
            self.relocalised += 1
            self._doubtful = True
            return refined
        return found

    def _refine(self, grid: ProbabilityGrid, points: FloatArray, start: FloatArray) -> MatchResult:
        """Gradient match from the result of a search, which odometry has no say in."""
        local = self._config.local
        return match_scan(
            grid,
            points,
            start,
            occupied_space_weight=local.occupied_space_weight,
            translation_weight=_WEAK_WEIGHT,
            rotation_weight=_WEAK_WEIGHT,
            max_iterations=local.max_num_iterations,
            solver=local.solver,
        )


def prepared(data: RangeData, voxel_edge: float) -> RangeData:
    """The scan with its returns thinned by the first voxel filter."""
    returns, ghosts = thin(data.returns, voxel_edge), thin(data.ghosts, voxel_edge)
    return RangeData(data.stamp, data.sensor, returns, data.free_ends, ghosts)
