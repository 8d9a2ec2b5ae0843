"""A grid that would fill the memory is refused before it is made."""

import numpy as np
import pytest

from glassslam.errors import GridError
from glassslam.grid import probability_grid
from glassslam.grid.probability_grid import MOST_CELLS, ProbabilityGrid
from glassslam.sonar import mapping

NOTHING = np.empty((0, 2))


def seen(*points):
    return np.array(points, dtype=np.float64)


def test_the_size_is_told_in_metres_and_gigabytes():
    grid = ProbabilityGrid(0.05)
    with pytest.raises(
        GridError, match=r"a map of 7076 x 7076 m in cells of 0\.05 m would take 160\.2 GB"
    ) as caught:
        grid.insert(np.zeros(2), seen([7071.0, 7071.0]), NOTHING)
    assert "lower sensor.max_range" in caught.value.hint
    assert "map.resolution" in caught.value.hint


def test_what_was_there_stays_and_can_be_used():
    grid = ProbabilityGrid(0.05)
    grid.insert(np.zeros(2), seen([1.0, 0.0]), NOTHING)
    before = grid.cells.copy()
    with pytest.raises(GridError):
        grid.insert(np.zeros(2), seen([1e4, 1e4]), NOTHING)
    np.testing.assert_array_equal(grid.cells, before)
    grid.insert(np.zeros(2), seen([1.0, 0.5]), NOTHING)
    assert grid.probability_at(seen([1.0, 0.0]))[0] > 0.5


@pytest.mark.parametrize("far", [1e12, 1e18, 1e300, -1e300])
def test_numbers_beyond_any_index(far):
    with pytest.raises(GridError, match=r"scan with a coordinate of 1e\+\d+ m"):
        ProbabilityGrid(0.05).insert(np.zeros(2), seen([far, 0.0]), NOTHING)


def test_silent_rays_and_locks_count_as_well():
    grid = ProbabilityGrid(0.05)
    with pytest.raises(GridError, match="would take"):
        grid.insert(np.zeros(2), NOTHING, seen([-9e3, 9e3]))
    with pytest.raises(GridError, match="would take"):
        grid.lock(seen([0.0, 0.0], [9e3, 9e3]))


def test_far_along_one_axis_is_no_matter_of_memory():
    grid = ProbabilityGrid(0.05)
    grid.insert(np.zeros(2), seen([10_000.02, 0.0]), NOTHING)
    assert grid.cells.size < MOST_CELLS / 5
    assert grid.probability_at(seen([10_000.02, 0.0]))[0] > 0.5


def test_the_limit_is_on_cells(monkeypatch):
    monkeypatch.setattr(probability_grid, "MOST_CELLS", 10_000)
    ProbabilityGrid(0.05).insert(np.zeros(2), NOTHING, NOTHING)  # 97 x 97
    with pytest.raises(GridError):
        ProbabilityGrid(0.05).insert(np.zeros(2), seen([0.5, 0.5]), NOTHING)
    ProbabilityGrid(0.5).insert(np.zeros(2), seen([0.5, 0.5]), NOTHING)


def test_a_map_of_sonars_is_limited_as_well():
    readings = np.array([[0.0, 0.0, 0.0, 1.0, 2.0, 0.1], [1e6, 1e6, 0.0, 1.0, 2.0, 0.1]])
    with pytest.raises(GridError, match=r"a map of 10000.. x 10000.. m in cells of 0.05 m would take"):
        mapping._extent(readings, 0.05)
