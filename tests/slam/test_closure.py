"""One loop closure: found, measured, weighed or refused."""

import numpy as np
import pytest
from slam_worlds import CORRIDOR, RING, ROOM, Lidar, range_data

from glassslam.config import LoopClosureConfig
from glassslam.geometry import between, compose, transform_points
from glassslam.grid.probability_grid import ProbabilityGrid
from glassslam.matching.branch_and_bound import BranchAndBoundMatcher
from glassslam.slam.closure import Candidate, close, is_wide, needs_search
from glassslam.slam.neighbourhood import neighbourhood
from glassslam.slam.node import Node

CONFIG = LoopClosureConfig()
LIMIT = 20.0


def grid_of(world, poses):
    """A submap of what the lidar sees from each pose, three times."""
    grid, lidar = ProbabilityGrid(0.05), Lidar(world)
    for pose in np.repeat(poses, 3, axis=0):
        returns = range_data(lidar.look(0.0, pose)).returns
        grid.insert(pose[:2], transform_points(pose, returns), np.empty((0, 2)))
    grid.finish()
    return grid


def scene_of(world, pose, *, residual=0.3):
    """What a node at a pose sees."""
    data = range_data(Lidar(world, seed=1).look(0.0, pose))
    node = Node(
        0, 0, 0.0, np.array(pose), np.zeros(2), data.returns.astype(np.float32), np.empty((0, 2)), residual
    )
    return neighbourhood([node], [0], 0)


def candidate(anchor, node, *, error=(0.0, 0.0, 0.0), sigma=1.0, turn_sigma=0.2, window=3.0, turn=0.5):
    """A search whose guess is off by `error` in the frame of the node."""
    expected = compose(between(np.array(anchor), np.array(node)), np.array(error))
    covariance = np.diag([sigma**2, sigma**2, turn_sigma**2])
    return Candidate(9, 2, 0, np.array(anchor), expected, window, turn, covariance)


ANCHOR = (2.0, 1.0, 0.4)
SEEN_FROM = np.array([[2.0, 1.0, 0.4], [2.5, 1.2, 0.5], [5.0, 1.0, 0.0], [5.0, 4.0, 1.0]])
PLACE = (2.6, 1.1, 2.0)


@pytest.fixture(scope="module")
def room():
    return grid_of(ROOM, SEEN_FROM)


@pytest.fixture(scope="module")
def corridor():
    return grid_of(CORRIDOR, np.array([[0.2 * k, 1.0, 0.0] for k in range(10)]))


@pytest.mark.parametrize("error", [(0, 0, 0), (1.5, -1.0, 0.3), (-2.0, 1.0, -0.4)])
def test_the_right_place_is_found_and_measured_sharply(room, error):
    found = close(
        candidate(ANCHOR, PLACE, error=error), scene_of(ROOM, PLACE), room,
        BranchAndBoundMatcher(room, 3.0), CONFIG, LIMIT,
    )  # fmt: skip
    assert found.rejected == ""
    assert found.searched
    assert not found.ambiguous
    off = found.anchor_from_node - between(np.array(ANCHOR), np.array(PLACE))
    assert np.abs(off[:2]).max() < 0.03
    assert abs(off[2]) < 0.01
    deviations = np.sqrt(np.diag(found.covariance))
    assert (deviations >= [CONFIG.translation_noise, CONFIG.translation_noise, CONFIG.rotation_noise]).all()
    assert deviations[:2].max() < 0.15
    assert deviations[2] < 0.05


def test_near_by_no_search_is_needed(room):
    found = close(
        candidate(ANCHOR, PLACE, error=(0.1, -0.1, 0.03)), scene_of(ROOM, PLACE), room, None, CONFIG, LIMIT
    )
    assert found.rejected == ""
    assert not found.searched
    np.testing.assert_allclose(found.anchor_from_node, between(np.array(ANCHOR), np.array(PLACE)), atol=0.03)


def test_windows_beyond_the_basin_of_the_gradient_need_a_search():
    assert not needs_search(0.2, 0.05)
    assert needs_search(0.3, 0.05)
    assert needs_search(0.2, 0.15)


@pytest.mark.parametrize("heading", [0.0, 0.7, np.pi / 2])
def test_a_bare_corridor_holds_across_and_not_along(corridor, heading):
    anchor = np.array([1.0, 1.0, heading])
    place = np.array([1.2, 1.0, 0.0])
    found = close(candidate(anchor, place), scene_of(CORRIDOR, place), corridor, None, CONFIG, LIMIT)
    assert found.rejected == ""
    assert found.ambiguous
    spreads, directions = np.linalg.eigh(found.covariance[:2, :2])
    assert np.sqrt(spreads[0]) < 0.15
    assert np.sqrt(spreads[1]) > 5.0
    along = np.array([np.cos(heading), -np.sin(heading)])
    assert abs(along @ directions[:, 1]) > np.cos(np.radians(3.0))
    assert np.linalg.eigvalsh(found.covariance).min() > 0


def test_another_place_is_refused(room):
    elsewhere = np.array([[-3.0, -3, 3, -3.4], [3, -3.4, 2, 3], [2, 3, -2.5, 2.6], [-2.5, 2.6, -3, -3]])
    found = close(
        candidate(ANCHOR, PLACE), scene_of(elsewhere, (0.0, 0.0, 0.0)), room,
        BranchAndBoundMatcher(room, 3.0), CONFIG, LIMIT,
    )  # fmt: skip
    assert found.rejected in {"low score", "poor fit"}
    assert found.searched


def test_a_score_below_the_gate_is_refused(room):
    strict = CONFIG.model_copy(update={"min_score": 0.99})
    matcher = BranchAndBoundMatcher(room, 3.0)
    found = close(candidate(ANCHOR, PLACE), scene_of(ROOM, PLACE), room, matcher, strict, LIMIT)
    assert found.rejected == "low score"


def test_a_fit_worse_than_the_gate_is_refused(room):
    strict = CONFIG.model_copy(update={"max_residual": 0.1})
    found = close(candidate(ANCHOR, PLACE), scene_of(ROOM, PLACE), room, None, strict, LIMIT)
    assert found.rejected == "poor fit"


def test_what_contradicts_the_graph_is_refused(room):
    sure = candidate(ANCHOR, PLACE, error=(1.5, -1.0, 0.3), sigma=0.02, turn_sigma=0.01)
    matcher = BranchAndBoundMatcher(room, 3.0)
    found = close(sure, scene_of(ROOM, PLACE), room, matcher, CONFIG, LIMIT)
    assert found.rejected == "inconsistent"


def test_a_handful_of_returns_closes_nothing(room):
    scene = scene_of(ROOM[:1], PLACE)
    few = type(scene)(scene.fine[:49], scene.coarse[:20], scene.residual)
    found = close(candidate(ANCHOR, PLACE), few, room, None, CONFIG, LIMIT)
    assert found.rejected == "few points"


def test_a_grid_without_walls_closes_nothing():
    empty = ProbabilityGrid(0.05)
    empty.finish()
    matcher = BranchAndBoundMatcher(empty, 3.0)
    found = close(candidate(ANCHOR, PLACE), scene_of(ROOM, PLACE), empty, matcher, CONFIG, LIMIT)
    assert found.rejected == "low score"


class TestWide:
    """Searches over a break, in which the robot may have been turned and carried."""

    def search(self, grid, world, place, error):
        wide = candidate(ANCHOR, place, error=error, sigma=9.0, turn_sigma=1.05, window=8.0, turn=np.pi)
        assert is_wide(wide, CONFIG)
        return close(wide, scene_of(world, place), grid, BranchAndBoundMatcher(grid, 8.0), CONFIG, LIMIT)

    @pytest.mark.parametrize("error", [(0, 0, 0), (9.0, -12.0, 3.0), (3.0, 4.0, -2.0)])
    def test_the_place_is_found_however_wrong_the_guess(self, room, error):
        found = self.search(room, ROOM, PLACE, error)
        assert found.rejected == ""
        off = between(between(np.array(ANCHOR), np.array(PLACE)), found.anchor_from_node)
        assert np.abs(off[:2]).max() < 0.03
        assert abs(off[2]) < 0.01

    def test_a_corridor_that_fits_half_turned_and_anywhere_along_it_is_refused(self, corridor):
        place = (1.0, 1.0, 0.0)
        expected = candidate((1.0, 1.0, 0.0), place, sigma=9.0, turn_sigma=1.05, window=8.0, turn=np.pi)
        found = close(
            expected, scene_of(CORRIDOR, place), corridor, BranchAndBoundMatcher(corridor, 8.0), CONFIG, LIMIT
        )
        assert found.rejected == "ambiguous"

    def test_another_building_is_refused(self, room):
        found = self.search(room, 1.7 * RING, (8.0, 2.1, 0.3), (0, 0, 0))
        assert found.rejected == "low score"
