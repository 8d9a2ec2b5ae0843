"""One loop closure: search a node's neighbourhood in a finished submap and weigh what is found."""

import math
from dataclasses import dataclass

import numpy as np

from glassslam.config import LoopClosureConfig
from glassslam.geometry import between, compose, inverse
from glassslam.grid.probability_grid import ProbabilityGrid
from glassslam.matching.branch_and_bound import BranchAndBoundMatcher
from glassslam.matching.gradient import MatchResult
from glassslam.matching.profile_kernels import flat_reach
from glassslam.records import FloatArray
from glassslam.slam.neighbourhood import Neighbourhood
from glassslam.slam.refinement import refined
from glassslam.slam.wide_search import WidePlace, find_wide_place

_DIRECT_LINEAR, _DIRECT_ANGULAR = 0.25, 0.1
_INFORMATION_SCALE = 100.0
_PROFILE_REACH, _PROFILE_STEP, _PROFILE_MARGIN = 8.0, 0.2, 0.06
_AMBIGUOUS_REACH = 0.5
_AMBIGUOUS_SIGMA = 20.0
_LEAST_POINTS = 50
_ROUNDING = 1e-9


@dataclass(frozen=True, slots=True)
class Candidate:
    """A search to make.

    Attributes
    ----------
    node, anchor, submap : int
        The node; the node of the submap nearest to it; the submap.
    anchor_in_local : ndarray of float64, shape (3,)
        Pose of the anchor in the local frame, m and rad.
    anchor_from_node : ndarray of float64, shape (3,)
        Expected pose of the node in the frame of the anchor.
    linear_window, angular_window : float
        Half widths of the search, m and rad.
    covariance : ndarray of float64, shape (3, 3)
        Of `anchor_from_node`, as the graph knows it before the closure.
    """

    node: int
    anchor: int
    submap: int
    anchor_in_local: FloatArray
    anchor_from_node: FloatArray
    linear_window: float
    angular_window: float
    covariance: FloatArray


@dataclass(frozen=True, slots=True)
class Closure:
    """A closure found, or why not.

    Attributes
    ----------
    candidate : Candidate
        The search.
    rejected : str
        Empty, or the reason: "few points", "low score", "poor fit", "inconsistent", "ambiguous",
        "unconfirmed".
    anchor_from_node : ndarray of float64, shape (3,)
        Measured pose of the node in the frame of the anchor.
    covariance : ndarray of float64, shape (3, 3)
        Of the measurement, m and rad.
    ambiguous : bool
        Whether the place fits as well somewhere else along a line.
    searched : bool
        Whether branch and bound was needed.
    """

    candidate: Candidate
    rejected: str
    anchor_from_node: FloatArray
    covariance: FloatArray
    ambiguous: bool = False
    searched: bool = False


def close(
    candidate: Candidate,
    scene: Neighbourhood,
    grid: ProbabilityGrid,
    matcher: BranchAndBoundMatcher | None,
    config: LoopClosureConfig,
    chi_square_limit: float,
) -> Closure:
    """Search, refine, and test one candidate.

    Parameters
    ----------
    candidate : Candidate
        Where to look.
    scene : Neighbourhood
        What the node and its neighbours see.
    grid : ProbabilityGrid
        Grid of the submap, in the local frame.
    matcher : BranchAndBoundMatcher or None
        Of the same grid; None when the window needs no search.
    config : LoopClosureConfig
        Gates.
    chi_square_limit : float
        Largest squared Mahalanobis distance between measurement and graph.
    """
    searched = matcher is not None

    def refuse(reason: str) -> Closure:
        return Closure(candidate, reason, np.zeros(3), np.eye(3), searched=searched)

    if len(scene.fine) < _LEAST_POINTS:
        return refuse("few points")
    if is_wide(candidate, config) and matcher is not None:
        place = _wide_place(candidate, scene, grid, matcher, config)
        match, objection = (None, "") if place is None else (place.match, place.objection)
    else:
        match, objection = _located(candidate, scene, grid, matcher, config), ""
    if match is None:
        return refuse("low score")
    if objection or match.residual > min(max(0.45, 1.1 * scene.residual + 0.03), config.max_residual):
        return refuse(objection or "poor fit")
    measured = between(candidate.anchor_in_local, match.pose)
    covariance, ambiguous = _uncertainty(match, scene, grid, candidate.anchor_in_local, config)
    if is_wide(candidate, config):
        # no covariance of first order holds so far off: other closures are asked instead of the graph
        objection = "ambiguous" if ambiguous else ""
    elif _is_contradicted(candidate, measured, covariance, chi_square_limit):
        objection = "inconsistent"
    if objection:
        return refuse(objection)
    return Closure(candidate, "", measured, covariance, ambiguous, searched)


def is_wide(candidate: Candidate, config: LoopClosureConfig) -> bool:
    """Whether a search looks farther around than any within one stretch of the run."""
    return candidate.angular_window > math.radians(config.max_angular_window_deg) + _ROUNDING


def needs_search(linear_window: float, angular_window: float) -> bool:
    """Whether a window is wider than the basin of the gradient match."""
    return linear_window > _DIRECT_LINEAR or angular_window > _DIRECT_ANGULAR


def _wide_place(
    candidate: Candidate,
    scene: Neighbourhood,
    grid: ProbabilityGrid,
    matcher: BranchAndBoundMatcher,
    config: LoopClosureConfig,
) -> WidePlace | None:
    guess = compose(candidate.anchor_in_local, candidate.anchor_from_node)
    # no window reaches all the places the graph allows: look where the submap was seen from
    center = np.array([*candidate.anchor_in_local[:2], guess[2]])
    return find_wide_place(scene, grid, matcher, center, guess, candidate.linear_window, config)


def _located(
    candidate: Candidate,
    scene: Neighbourhood,
    grid: ProbabilityGrid,
    matcher: BranchAndBoundMatcher | None,
    config: LoopClosureConfig,
) -> MatchResult | None:
    """Where the scene fits best in the window; None when nowhere."""
    guess = compose(candidate.anchor_in_local, candidate.anchor_from_node)
    if matcher is None:
        return refined(grid, scene.fine, guess)
    found = matcher.match(
        scene.coarse, guess, candidate.linear_window, candidate.angular_window, config.min_score
    )
    return None if found is None else refined(grid, scene.fine, found.pose)


def _is_contradicted(
    candidate: Candidate, measured: FloatArray, covariance: FloatArray, chi_square_limit: float
) -> bool:
    """Whether a place is farther from where the graph has it than their covariances allow."""
    error = compose(inverse(candidate.anchor_from_node), measured)
    return bool(error @ np.linalg.solve(candidate.covariance + covariance, error) > chi_square_limit)


def _uncertainty(
    match: MatchResult,
    scene: Neighbourhood,
    grid: ProbabilityGrid,
    anchor_in_local: FloatArray,
    config: LoopClosureConfig,
) -> tuple[FloatArray, bool]:
    """Covariance of a closure in the frame of the anchor, and whether it slides along a line.

    The curvature of the match tells how sharply the walls hold the scan; a scan of the fit along the
    direction held least tells whether other places fit nearly as well, which curvature cannot see.
    """
    values, vectors = np.linalg.eigh(match.information)
    covariance = (vectors / np.maximum(values * _INFORMATION_SCALE, 1e-6)) @ vectors.T
    free = _weakest_direction(match.information)
    reach = flat_reach(
        grid.cells, grid.table, grid.origin, 1.0 / grid.resolution, scene.fine, match.pose, free,
        match.residual + _PROFILE_MARGIN, _PROFILE_REACH, _PROFILE_STEP,
    )  # fmt: skip
    ambiguous = bool(reach > _AMBIGUOUS_REACH)
    if ambiguous:
        covariance[:2, :2] += np.outer(free, free) * _AMBIGUOUS_SIGMA**2
    turn = np.eye(3)
    c, s = math.cos(anchor_in_local[2]), math.sin(anchor_in_local[2])
    turn[:2, :2] = [[c, s], [-s, c]]
    least = np.diag([config.translation_noise**2, config.translation_noise**2, config.rotation_noise**2])
    return turn @ covariance @ turn.T + least, ambiguous


def _weakest_direction(information: FloatArray) -> FloatArray:
    """Unit vector (2,) of the translation that costs least when the rotation follows freely."""
    turning = max(float(information[2, 2]), 1e-12)
    marginal = information[:2, :2] - np.outer(information[:2, 2], information[:2, 2]) / turning
    return np.asarray(np.linalg.eigh(marginal)[1][:, 0])
