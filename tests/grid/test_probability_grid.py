"""A grid that grows with what is entered, and is cropped when done."""

import math

import numpy as np
import pytest
from grid_worlds import drawing, drawn, observed
from hypothesis import given
from hypothesis import strategies as st

from glassslam.errors import GridError
from glassslam.grid import OddsModel, ProbabilityGrid
from glassslam.grid.probability_grid import point_array

NOTHING = np.empty((0, 2))


def at_cells(cells, resolution, shift=(0.4, 0.7)):
    """Points inside of the given cells, m."""
    return (np.array(cells, dtype=float).reshape(-1, 2) + shift) * resolution


def test_a_corner_of_a_room():
    grid = ProbabilityGrid(0.5)
    grid.insert(np.array([0.25, 0.25]), np.array([[1.8, 0.3], [0.3, 1.3]]), NOTHING)
    grid.finish()
    assert drawing(grid.cells[3:-3, 3:-3], grid.odds.prior) == drawn(
        """
        #???
        .???
        ...#
        """
    )
    assert grid.origin.tolist() == [-1.5, -1.5]


cell_numbers = st.tuples(st.integers(-120, 120), st.integers(-120, 120))
recorded = st.lists(
    st.tuples(cell_numbers, st.lists(cell_numbers, max_size=6), st.lists(cell_numbers, max_size=4)),
    min_size=1,
    max_size=5,
)


def enter(grid, scan):
    sensor, hits, free_ends = scan
    r = grid.resolution
    # irrational offsets: no ray passes through the corner of a cell, where rounding decides
    grid.insert(
        at_cells([sensor], r, (0.3, 0.6))[0],
        at_cells(hits, r, (2**0.5 - 1, 3**0.5 - 1)),
        at_cells(free_ends, r, (5**0.5 - 2, 7**0.5 - 2)),
    )


@given(recorded, st.sampled_from([0.05, 0.1, 0.25, 0.3]), st.randoms())
def test_any_order_of_growth_gives_the_same_cells(scans, resolution, random):
    grids = [ProbabilityGrid(resolution) for _ in range(2)]
    for scan in scans:
        enter(grids[0], scan)
    for scan in random.sample(scans, len(scans)):
        enter(grids[1], scan)
    # few scans: no cell reaches the clamp, so that the order of updates does not matter either
    assert observed(grids[0]) == observed(grids[1])


@given(recorded, st.sampled_from([0.05, 0.3]))
def test_everything_entered_lies_inside_with_room_for_the_smooth_surface(scans, resolution):
    grid = ProbabilityGrid(resolution)
    for sensor, hits, free_ends in scans:
        enter(grid, (sensor, hits, free_ends))
        rows, columns = grid.cells.shape
        corner = np.rint(grid.origin / resolution)
        index = np.array([sensor, *hits, *free_ends]) - corner
        assert (index >= 2).all()
        assert (index < np.array([columns, rows]) - 2).all()


@given(recorded, st.sampled_from([0.05, 0.3]))
def test_cropping_keeps_every_observed_cell(scans, resolution):
    grid = ProbabilityGrid(resolution)
    for scan in scans:
        enter(grid, scan)
    before, size = observed(grid), grid.cells.size
    if not before:
        return
    grid.finish()
    assert observed(grid) == before
    border = grid.cells.copy()
    border[3:-3, 3:-3] = 0
    assert not border.any(), "three unknown cells all around"
    inner = grid.cells[3:-3, 3:-3]
    assert all(line.any() for line in (inner[0], inner[-1], inner[:, 0], inner[:, -1])), "and no more"
    assert grid.cells.base is None or grid.cells.base.size <= size


@given(recorded, recorded)
def test_a_finished_grid_takes_more_scans(first, then):
    finished, open_ = ProbabilityGrid(0.05), ProbabilityGrid(0.05)
    for scan in first:
        enter(finished, scan)
        enter(open_, scan)
    finished.finish()
    for scan in then:
        enter(finished, scan)
        enter(open_, scan)
    assert observed(finished) == observed(open_)


def test_points_on_the_borders_of_cells_far_from_zero_find_room():
    grid = ProbabilityGrid(0.1)
    corner = np.array([[1000.3, -999.9]])
    for k in range(50):
        grid.insert(corner[0], corner + 0.1 * k, corner - 0.1 * k)
    # rounding may put a point on the border into either cell
    near = corner + 0.1 * np.array([[49.0], [48.0], [0.0], [-48.0], [-49.0]])
    around = np.stack([grid.probability_at(near + shift) for shift in (-0.05, 0.05)])
    assert np.isfinite(around).any(axis=0).all()


def test_an_empty_grid_can_be_finished():
    grid = ProbabilityGrid()
    grid.finish()
    assert grid.cells.shape == (0, 0)
    assert np.isnan(grid.probability_at(np.zeros((2, 2)))).all()


def test_a_scan_without_beams_leaves_all_unknown():
    grid = ProbabilityGrid()
    grid.insert(np.zeros(2), NOTHING, NOTHING)
    grid.finish()
    assert not grid.cells.any()
    assert np.isnan(grid.probability()).all()


def test_the_number_of_scans_may_exceed_what_a_mark_can_count():
    fresh, worn = ProbabilityGrid(0.5), ProbabilityGrid(0.5)
    for grid in (fresh, worn):
        grid.insert(np.zeros(2), np.array([[3.2, 0.3]]), NOTHING)
    worn._mark = np.iinfo(np.uint16).max - 2
    worn._marks[worn._marks > 0] = worn._mark
    for _ in range(5):
        for grid in (fresh, worn):
            grid.insert(np.zeros(2), np.array([[3.2, 0.3]]), NOTHING)
    assert worn._mark == 3
    assert observed(fresh) == observed(worn)


def test_probability_of_cells_and_of_points_agree():
    grid = ProbabilityGrid(0.5)
    for _ in range(3):
        grid.insert(np.zeros(2), np.array([[2.2, 1.3], [-1.7, 0.4]]), np.array([[0.3, -2.2]]))
    cells = grid.probability()
    assert cells.dtype == np.float32
    rows, columns = np.indices(cells.shape)
    centres = (np.stack((columns.ravel(), rows.ravel()), axis=1) + 0.5) * 0.5 + grid.origin
    np.testing.assert_array_equal(grid.probability_at(centres), cells.ravel())
    known = cells[np.isfinite(cells)]
    assert set(known.round(3)) == {np.float32(0.646), np.float32(0.47)}, "three hits, three misses"


@pytest.mark.parametrize("far", [[-99.0, 0.0], [99.0, 0.0], [0.0, -99.0], [0.0, 99.0]])
def test_a_point_outside_was_never_observed(far):
    grid = ProbabilityGrid()
    grid.insert(np.zeros(2), np.array([[1.0, 0.0]]), NOTHING)
    assert np.isnan(grid.probability_at(np.array([far]))[0])


def test_no_points_have_no_probability():
    assert ProbabilityGrid().probability_at(NOTHING).shape == (0,)


def test_the_caller_keeps_its_arrays():
    sensor, hits = np.array([0.1, 0.2]), np.array([[1.0, 0.5], [9.0, -9.0]])
    ProbabilityGrid().insert(sensor, hits, NOTHING)
    assert sensor.tolist() == [0.1, 0.2]
    assert hits.tolist() == [[1.0, 0.5], [9.0, -9.0]]


def test_lists_and_other_types_will_do():
    grids = [ProbabilityGrid(), ProbabilityGrid()]
    grids[0].insert(np.zeros(2), np.array([[1.0, 0.5]]), NOTHING)
    grids[1].insert((0, 0), [(1, np.float32(0.5))], [])
    assert observed(grids[0]) == observed(grids[1])


def test_point_array_takes_any_layout():
    turned = np.arange(6.0).reshape(2, 3).T
    assert point_array(turned).flags.c_contiguous
    np.testing.assert_array_equal(point_array(turned), turned)
    assert point_array([]).shape == (0, 2)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
@pytest.mark.parametrize("which", [0, 1, 2])
def test_a_coordinate_that_is_not_finite_is_refused(bad, which):
    grid = ProbabilityGrid()
    grid.insert(np.zeros(2), np.array([[1.0, 0.0]]), NOTHING)
    before = observed(grid)
    scan = [np.zeros(2), np.ones((2, 2)), np.ones((2, 2))]
    scan[which] = scan[which] + np.array([0.0, bad])
    with pytest.raises(GridError, match=r"^scan with a coordinate that is not finite$") as caught:
        grid.insert(*scan)
    assert caught.value.hint == "leave out invalid beams"
    assert observed(grid) == before


def test_points_of_another_shape_are_refused():
    with pytest.raises(GridError, match=r"^points of shape \(3,\)$") as caught:
        point_array(np.zeros(3))
    assert caught.value.hint == "give an array of shape (n, 2)"
    with pytest.raises(GridError, match=r"^points of shape \(4, 3\)$"):
        ProbabilityGrid().insert(np.zeros(2), np.zeros((4, 3)), NOTHING)


@pytest.mark.parametrize("resolution", [0.0, -0.05, math.nan, math.inf])
def test_a_resolution_that_is_not_positive_is_refused(resolution):
    with pytest.raises(GridError, match=rf"^resolution of a grid is {resolution} m$") as caught:
        ProbabilityGrid(resolution)
    assert caught.value.hint == "it must be positive"


def test_the_odds_of_the_grid_are_those_given():
    grid = ProbabilityGrid(0.5, OddsModel(hit_probability=0.9, miss_probability=0.2))
    grid.insert(np.array([0.2, 0.2]), np.array([[2.2, 0.2]]), NOTHING)
    p = grid.probability_at(np.array([[2.2, 0.2], [1.2, 0.2]]))
    np.testing.assert_allclose(p, [0.9, 0.2], atol=2e-4)


def test_silent_rays_end_at_walls_that_others_have_seen():
    grids = [ProbabilityGrid(0.5, OddsModel(0.8, 0.3), silent_stop=stop) for stop in (None, 0.65)]
    for grid in grids:
        grid.insert(np.array([0.25, 0.25]), np.array([[1.25, 0.25]]), NOTHING)
        for _ in range(3):
            grid.insert(np.array([0.25, 0.25]), NOTHING, np.array([[2.25, 0.25]]))
        grid.finish()
    crossed, stopped = (drawing(grid.cells[3:-3, 3:-3], grid.odds.prior) for grid in grids)
    assert (crossed, stopped) == (".....", "..#")


def test_returns_beyond_a_wall_clear_it_even_where_silence_does_not():
    grid = ProbabilityGrid(0.5, OddsModel(0.8, 0.3), silent_stop=0.65)
    grid.insert(np.array([0.25, 0.25]), np.array([[1.25, 0.25]]), NOTHING)
    for _ in range(3):
        grid.insert(np.array([0.25, 0.25]), np.array([[2.25, 0.25]]), NOTHING)
    grid.finish()
    assert drawing(grid.cells[3:-3, 3:-3], grid.odds.prior) == "....#"
