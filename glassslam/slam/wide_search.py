"""Where a scene fits after a break of the recording, when nothing is known of where the robot was carried.

A search all around finds a place in every corridor that looks alike, and in most corridors the same one again
with the robot facing the other way. A place therefore counts only where none other fits nearly as well.
"""

import math
from dataclasses import dataclass

import numpy as np

from glassslam.config import LoopClosureConfig
from glassslam.geometry import between
from glassslam.grid.probability_grid import ProbabilityGrid
from glassslam.matching.branch_and_bound import BranchAndBoundMatcher
from glassslam.matching.gradient import MatchResult
from glassslam.records import FloatArray
from glassslam.slam.hold_kernels import known_share
from glassslam.slam.neighbourhood import Neighbourhood
from glassslam.slam.refinement import refined

_CLEARLY_BETTER = 0.03
_RIVAL_DISTANCE, _RIVAL_TURN = 1.0, 0.5
_LEAST_KNOWN, _WORST_RESIDUAL = 0.5, 0.46


@dataclass(frozen=True, slots=True)
class WidePlace:
    """The best place of a search all around.

    Attributes
    ----------
    match : MatchResult
        The place, in the frame of the grid.
    objection : str
        Why it is not believed: "poor fit", "ambiguous"; empty where it is.
    """

    match: MatchResult
    objection: str


def find_wide_place(
    scene: Neighbourhood,
    grid: ProbabilityGrid,
    matcher: BranchAndBoundMatcher,
    center: FloatArray,
    guess: FloatArray,
    linear_window: float,
    config: LoopClosureConfig,
) -> WidePlace | None:
    """Search all around, and ask whether any other place fits nearly as well.

    Parameters
    ----------
    scene : Neighbourhood
        What is looked for.
    grid : ProbabilityGrid
        The map, in the local frame.
    matcher : BranchAndBoundMatcher
        Of the same grid.
    center : ndarray of float64, shape (3,)
        Middle of the search in the frame of the grid, m and rad.
    guess : ndarray of float64, shape (3,)
        Where the graph has the scene: one place among the others.
    linear_window : float
        Half width of the search, m.
    config : LoopClosureConfig
        Least score of a search.

    Returns
    -------
    WidePlace or None
        None where nothing scores enough.
    """

    def searched(heading: float, angular_window: float) -> list[MatchResult]:
        around = np.array([center[0], center[1], heading])
        found = matcher.match(scene.coarse, around, linear_window, angular_window, config.min_score)
        return [] if found is None else [refined(grid, scene.fine, found.pose)]

    places = [*searched(center[2], math.pi), refined(grid, scene.fine, guess)]
    best = min(places, key=_residual)
    if best.residual > _WORST_RESIDUAL or _known(scene, grid, best.pose) < _LEAST_KNOWN:
        return WidePlace(best, "poor fit") if len(places) > 1 else None
    places += searched(best.pose[2] + math.pi, math.pi - _RIVAL_TURN)
    rivals = [place for place in places if _is_elsewhere(place.pose, best.pose)]
    is_alone = all(place.residual > best.residual + _CLEARLY_BETTER for place in rivals)
    return WidePlace(best, "" if is_alone else "ambiguous")


def _residual(match: MatchResult) -> float:
    return match.residual


def _known(scene: Neighbourhood, grid: ProbabilityGrid, pose: FloatArray) -> float:
    return known_share(grid.cells, grid.origin, 1.0 / grid.resolution, scene.fine, pose)


def _is_elsewhere(a: FloatArray, b: FloatArray) -> bool:
    gap = between(a, b)
    return bool(math.hypot(gap[0], gap[1]) > _RIVAL_DISTANCE or abs(gap[2]) > _RIVAL_TURN)
