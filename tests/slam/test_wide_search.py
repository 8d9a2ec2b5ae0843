"""A search all around: the place must fit, and no other nearly as well."""

import numpy as np
import pytest
from slam_worlds import ROOM, Lidar, box, range_data

from glassslam.config import LoopClosureConfig
from glassslam.geometry import between, transform_points
from glassslam.grid.probability_grid import ProbabilityGrid
from glassslam.matching.branch_and_bound import BranchAndBoundMatcher
from glassslam.slam.neighbourhood import neighbourhood
from glassslam.slam.node import Node
from glassslam.slam.wide_search import find_wide_place

CONFIG = LoopClosureConfig()
TWIN = box(0, 0, 8, 5)
"""A bare room: the same when turned by half a turn."""
PLACE = np.array([2.6, 1.1, 2.0])


def grid_of(world):
    grid, lidar = ProbabilityGrid(0.05), Lidar(world)
    for pose in np.repeat([[2.0, 1.0, 0.4], [5.0, 1.0, 0.0], [5.0, 4.0, 1.0], [1.0, 3.0, 0.0]], 3, axis=0):
        points = range_data(lidar.look(0.0, pose)).returns
        grid.insert(pose[:2], transform_points(pose, points), np.empty((0, 2)))
    grid.finish()
    return grid


def look(world, pose):
    points = range_data(Lidar(world, seed=1).look(0.0, pose)).returns.astype(np.float32)
    node = Node(0, 0, 0.0, pose, np.zeros(2), points, np.empty((0, 2), np.float32), 0.3)
    return neighbourhood([node], [0], 0)


def found(mapped, seen, guess):
    grid = grid_of(mapped)
    center = np.array([3.0, 2.0, guess[2]])
    return find_wide_place(
        look(seen, PLACE), grid, BranchAndBoundMatcher(grid, 5.0), center, np.array(guess), 5.0, CONFIG
    )


@pytest.mark.parametrize("guess", [(2.6, 1.1, 2.0), (6.0, 3.0, -1.2), (-40.0, 9.0, 0.3)])
def test_a_place_like_no_other_is_found_wherever_it_was_expected(guess):
    place = found(ROOM, ROOM, guess)
    assert place.objection == ""
    assert np.abs(between(PLACE, place.match.pose)).max() < 0.05


@pytest.mark.parametrize("guess", [(2.6, 1.1, 2.0), (5.4, 3.9, 2.0 - np.pi), (3.0, 3.0, 0.0)])
def test_a_room_that_looks_the_same_turned_around_tells_nothing_even_where_expected(guess):
    assert found(TWIN, TWIN, guess).objection == "ambiguous"


def test_another_building_fits_nowhere():
    other = np.vstack((box(1.5, 0.3, 1.6, 1.8), box(2.0, 1.5, 0.2, 0.2)))
    place = found(ROOM, other, (2.6, 1.1, 2.0))
    assert place is None or place.objection == "poor fit"
