"""Scan-to-submap tracking: where a scan fits, and what is tried when it does not."""

import math
from dataclasses import dataclass, replace

from glassslam.config import Config
from glassslam.grid.probability_grid import ProbabilityGrid
from glassslam.matching.branch_and_bound import BranchAndBoundMatcher
from glassslam.matching.correlative import search_around
from glassslam.matching.gradient import MatchResult, match_scan
from glassslam.records import FloatArray
from glassslam.slam.extrapolator import Prediction
from glassslam.slam.hold_kernels import hold_of, known_share
from glassslam.slam.range_data import RangeData, thin_adaptively
from glassslam.slam.refinement import refined
from glassslam.slam.tracking import Event, How, Match, Tracking

_CALM_DISTANCE = 0.1
_CALM_ROTATION = 0.05
_COASTING_SHARE = 0.3
_LOST_RATIO = 1.15
_LOST_AFTER_GAP = 1.05
_SETTLING_SCANS = 5
_LOST_WINDOW, _LOST_TURN = 1.5, 2.0
_LOST_SCORE = 0.5
_LEAST_STRETCH = 5
_SEARCH_GAIN, _FRESH_GAIN = 0.05, 0.005
_BREAKS = Event.GAP | Event.CLOCK_BACK


@dataclass(frozen=True, slots=True)
class _Fit:
    """The best match so far, and how it came about."""

    match: MatchResult
    how: How


class Tracker:
    """Matches scans against a submap, with what it has learned from the scans before.

    Attributes
    ----------
    tracking : Tracking
        All that it carries from scan to scan; may be replaced by what it was at another scan.
    """

    def __init__(self, config: Config) -> None:
        self._config = config
        self.tracking = Tracking()

    def match(self, grid: ProbabilityGrid | None, data: RangeData, prediction: Prediction) -> Match:
        """Where a scan lies in the frame of a grid; without a grid or points, where it is expected."""
        now = self.tracking
        now.since_start += 1
        if grid is None:
            return self._as_predicted(prediction, How.FIRST)
        filters = self._config.filter
        points = thin_adaptively(data.returns, filters.adaptive_max_length, filters.adaptive_min_num_points)
        is_matchable = len(points) >= self._config.local.min_num_points
        # two clocks in one recording would tear every scan from the one before
        if prediction.event & _BREAKS and now.since_start > _LEAST_STRETCH:
            return self._start_anew(grid, points if is_matchable else points[:0], prediction)
        if not is_matchable:
            now.unmatched += 1
            return self._as_predicted(prediction, How.UNMATCHED)
        fit = self._fitted(grid, points, prediction)
        best = fit.match
        now.usual_residual = 0.9 * now.usual_residual + 0.1 * best.residual
        cells, scale = grid.cells, 1.0 / grid.resolution
        hold, heading = hold_of(cells, grid.table, grid.origin, scale, points, best.pose, best.information)
        known = known_share(cells, grid.origin, scale, points, best.pose)
        return Match(
            best.pose, best.residual, len(points), hold, heading, known,
            fit.how, prediction.event, now.doubtful,
        )  # fmt: skip

    def _start_anew(self, grid: ProbabilityGrid, points: FloatArray, prediction: Prediction) -> Match:
        """First scan of a stretch: where it fits in the submap of the last one, else where it is expected."""
        if len(points):
            fit = self._fitted(grid, points, prediction)
            if fit.match.residual <= _LOST_AFTER_GAP * self.tracking.usual_residual + 0.02:
                prediction = replace(prediction, pose_in_local=fit.match.pose)
        fresh = Tracking()
        self.tracking = replace(
            self.tracking,
            usual_residual=fresh.usual_residual,
            since_gap=fresh.since_gap,
            since_start=-_SETTLING_SCANS,
            doubtful=fresh.doubtful,
        )
        return self._as_predicted(prediction, How.FIRST)

    def _as_predicted(self, prediction: Prediction, how: How) -> Match:
        now = self.tracking
        return Match(
            prediction.pose_in_local,
            now.usual_residual,
            how=how,
            event=prediction.event,
            doubtful=now.doubtful,
        )

    def _fitted(self, grid: ProbabilityGrid, points: FloatArray, prediction: Prediction) -> _Fit:
        now = self.tracking
        fit = self._near_either(grid, points, prediction)
        if self._is_doubtful(fit.match, prediction):
            fit = self._search(grid, points, fit, _FRESH_GAIN if self._is_fresh(prediction) else _SEARCH_GAIN)
        now.since_gap = 0 if prediction.after_gap else now.since_gap + 1
        now.doubtful |= prediction.after_gap and prediction.distance + prediction.rotation > _CALM_DISTANCE
        unsettled = now.since_gap < _SETTLING_SCANS
        limit = _LOST_AFTER_GAP if unsettled else _LOST_RATIO
        if fit.match.residual > limit * now.usual_residual + 0.02:
            # in a corridor a slide along it always fits a little better somewhere
            fit = self._relocalise(grid, points, fit, 0.03 if unsettled else 0.08)
        return fit

    def _near_either(self, grid: ProbabilityGrid, points: FloatArray, prediction: Prediction) -> _Fit:
        """Match around the prediction, or around its alternative where that fits clearly better."""
        best = self._match_near(grid, points, prediction, prediction.pose_in_local)
        if prediction.alternative is not None:
            coasting = self._match_near(grid, points, prediction, prediction.alternative)
            if coasting.residual < best.residual - 0.02:
                self.tracking.coasted += 1
                self.tracking.doubtful = True
                return _Fit(coasting, How.COASTED)
        return _Fit(best, How.MATCHED)

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
        if self._is_fresh(prediction):
            return True
        return match.residual > 1.1 * self.tracking.usual_residual + 0.01 or prediction.rotation > 0.15

    def _is_fresh(self, prediction: Prediction) -> bool:
        """Whether a new stretch has just begun in full motion, and nothing tells how fast."""
        return self.tracking.since_start <= 0 and not prediction.measured

    def _search(self, grid: ProbabilityGrid, points: FloatArray, found: _Fit, gain: float) -> _Fit:
        """Real-time correlative search around a doubtful match; taken when it fits better by `gain`."""
        local = self._config.local
        self.tracking.searches += 1
        start = search_around(
            grid,
            points,
            found.match.pose,
            local.search_linear_window,
            math.radians(local.search_angular_window_deg),
        )
        better = self._refined(grid, points, start)
        if better.residual < found.match.residual - gain:
            self.tracking.searches_taken += 1
            self.tracking.doubtful |= gain >= _SEARCH_GAIN
            return _Fit(better, How.SEARCHED)
        return found

    def _relocalise(self, grid: ProbabilityGrid, points: FloatArray, found: _Fit, gain: float) -> _Fit:
        """Branch and bound in the submap after tracking was lost, as after a gap in the recording.

        The new place is taken when its residual is lower by `gain`.
        """
        self.tracking.relocalisations += 1
        matcher = BranchAndBoundMatcher(grid, _LOST_WINDOW)
        coarse = points[:: max(1, len(points) // 150)]
        match = matcher.match(coarse, found.match.pose, _LOST_WINDOW, _LOST_TURN, _LOST_SCORE)
        if match is None:
            return found
        better = self._refined(grid, points, match.pose)
        if better.residual < found.match.residual - gain:
            self.tracking.relocalised += 1
            self.tracking.doubtful = True
            return _Fit(better, How.RELOCALISED)
        return found

    def _refined(self, grid: ProbabilityGrid, points: FloatArray, start: FloatArray) -> MatchResult:
        local = self._config.local
        return refined(
            grid,
            points,
            start,
            occupied_space_weight=local.occupied_space_weight,
            max_iterations=local.max_num_iterations,
            solver=local.solver,
        )
