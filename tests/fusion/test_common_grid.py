"""Maps brought onto one grid."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glassslam.errors import GridError
from glassslam.fusion.common_grid import on_common_grid
from glassslam.slam.result import OccupancyMap


def at(grid, x, y):
    column = math.floor((x - grid.origin[0]) / grid.resolution)
    row = math.floor((y - grid.origin[1]) / grid.resolution)
    rows, columns = grid.probability.shape
    return float(grid.probability[row, column]) if 0 <= row < rows and 0 <= column < columns else math.nan


def test_maps_side_by_side_share_a_grid_that_holds_both(draw_map):
    a, b = on_common_grid([draw_map("#.", origin=(0.0, 0.0)), draw_map("..\n##", origin=(1.0, 0.5))])
    assert a.origin == b.origin == (0.0, 0.0)
    assert a.probability.shape == b.probability.shape == (3, 4)
    assert a.probability[0, :2] == pytest.approx([0.9, 0.1])
    assert b.probability[1, 2:] == pytest.approx([0.9, 0.9])
    assert b.probability[2, 2:] == pytest.approx([0.1, 0.1])
    assert np.isnan(a.probability).sum() == 10
    assert np.isnan(b.probability).sum() == 8


def test_a_map_alone_is_unchanged(draw_map):
    grid = draw_map("#.?\n.+#", origin=(-0.35, 7.1))
    (same,) = on_common_grid([grid])
    assert same.origin == pytest.approx(grid.origin)
    assert np.array_equal(same.probability, grid.probability, equal_nan=True)


def test_the_finest_resolution_wins(draw_map):
    coarse, fine = draw_map("#.", resolution=0.1), draw_map("?#", resolution=0.05, origin=(0.1, 0.0))
    a, b = on_common_grid([coarse, fine])
    assert a.resolution == b.resolution == 0.05
    assert a.probability == pytest.approx(np.array([[0.9, 0.9, 0.1, 0.1]] * 2))
    assert at(b, 0.175, 0.025) == pytest.approx(0.9)


@given(st.floats(-3, 3), st.floats(-3, 3), st.sampled_from([0.05, 0.07, 0.1]), st.integers(0, 10**6))
def test_every_point_keeps_its_value_within_half_a_cell(x, y, resolution, seed):
    random = np.random.default_rng(seed)
    first = OccupancyMap(random.uniform(size=(6, 7)).astype(np.float32), 0.05, (0.1, -0.2))
    second = OccupancyMap(random.uniform(size=(5, 4)).astype(np.float32), resolution, (x, y))
    for grid, same in zip((first, second), on_common_grid([first, second]), strict=True):
        rows, columns = np.nonzero(~np.isnan(same.probability))
        assert len(rows) >= grid.probability.size * 0.5
        for row, column in zip(rows[::7], columns[::7], strict=True):
            centre = (
                same.origin[0] + (column + 0.5) * same.resolution,
                same.origin[1] + (row + 0.5) * same.resolution,
            )
            near = [at(grid, centre[0] + dx, centre[1] + dy) for dx in (-1e-7, 1e-7) for dy in (-1e-7, 1e-7)]
            assert same.probability[row, column] in near


def test_a_map_without_cells_does_not_stretch_the_grid(draw_map):
    empty = OccupancyMap(np.empty((0, 0), np.float32), 0.5, (-100.0, 50.0))
    a, b = on_common_grid([draw_map("#."), empty])
    assert a.probability.shape == b.probability.shape == (1, 2)
    assert np.isnan(b.probability).all()


def test_no_maps_are_refused():
    with pytest.raises(GridError, match="no maps to bring onto one grid") as caught:
        on_common_grid([])
    assert caught.value.hint == "give at least one"


@pytest.mark.parametrize("resolution", [0.0, -0.1, math.nan, math.inf])
def test_a_resolution_that_is_not_positive_is_refused(draw_map, resolution):
    with pytest.raises(GridError, match="resolution of a map is") as caught:
        on_common_grid([draw_map("#", resolution=resolution)])
    assert caught.value.hint == "it must be positive"
