"""One scan entered into cells: which cells a ray crosses, what wins, and how often."""

import math

import numpy as np
import pytest
from grid_worlds import drawing, drawn, naive_insert, naive_ray, visited
from hypothesis import given
from hypothesis import strategies as st

from glassslam.grid import OddsModel
from glassslam.grid.kernels import extend_box, insert_scan

MODEL = OddsModel()
STEPS = (MODEL.hit_step, MODEL.miss_step, MODEL.prior, MODEL.top, MODEL.locked + 1)
NOTHING = np.empty((0, 2))

# whole numbers and their neighbours: rays along and through the corners of cells
borders = st.integers(1, 31).flatmap(
    lambda k: st.sampled_from([float(k), math.nextafter(k, 0), math.nextafter(k, 40), k + 0.5])
)
coordinate = st.one_of(st.floats(1.0, 32.0), borders)


def entered(sensor, hits, free_ends=NOTHING, shape=(5, 7), cells=None, mark=1):
    """Cells after one scan in cell units."""
    cells = np.zeros(shape, np.uint16) if cells is None else cells
    marks = np.zeros(cells.shape, np.uint16)
    scan = [np.array(p, dtype=np.float64).reshape(-1, 2) for p in (hits, free_ends)]
    insert_scan(cells, marks, np.uint16(mark), np.array(sensor, float), *scan, 1.0, *STEPS)
    return cells


@given(coordinate, coordinate, coordinate, coordinate)
def test_a_ray_never_leaves_the_box_between_its_end_cells(x0, y0, x1, y1):
    cells = visited(x0, y0, x1, y1)
    columns, rows = {math.floor(x0), math.floor(x1)}, {math.floor(y0), math.floor(y1)}
    assert all(min(columns) <= c <= max(columns) and min(rows) <= r <= max(rows) for c, r in cells)


@given(coordinate, coordinate, coordinate, coordinate)
def test_a_ray_goes_from_cell_to_cell_over_edges(x0, y0, x1, y1):
    start, end = (math.floor(x0), math.floor(y0)), (math.floor(x1), math.floor(y1))
    distances = sorted(abs(c - start[0]) + abs(r - start[1]) for c, r in visited(x0, y0, x1, y1))
    # one cell at every number of steps from the start: a path without gap, detour or corner cut
    assert distances == list(range(abs(end[0] - start[0]) + abs(end[1] - start[1]) + 1))
    assert {start, end} <= visited(x0, y0, x1, y1)


def overlap(x0, y0, x1, y1, cell, margin):
    """Length of the parameter interval in which a segment is inside of a cell widened by a margin."""
    low, high = 0.0, 1.0
    for a, b, k in ((x0, x1, cell[0]), (y0, y1, cell[1])):
        edges = (k - margin, k + 1 + margin)
        if a == b:
            if not edges[0] <= a <= edges[1]:
                return -1.0
            continue
        near, far = sorted(((edges[0] - a) / (b - a), (edges[1] - a) / (b - a)))
        low, high = max(low, near), min(high, far)
    return high - low


@given(coordinate, coordinate, coordinate, coordinate)
def test_a_ray_clears_what_it_touches_and_nothing_else(x0, y0, x1, y1):
    cells = visited(x0, y0, x1, y1)
    assert all(overlap(x0, y0, x1, y1, cell, 1e-9) >= 0 for cell in cells)
    box = [(c, r) for c in range(34) for r in range(34)]
    assert {cell for cell in box if overlap(x0, y0, x1, y1, cell, -1e-9) > 1e-6} <= cells


def test_rays_in_the_eight_directions():
    for dx in (-1, 0, 1):
        for dy in (-1, 0, 1):
            end = (10.5 + 5 * dx, 10.5 + 5.01 * dy)
            assert visited(10.5, 10.5, *end) == naive_ray(10.5, 10.5, *end)


def test_a_return_is_raised_and_the_way_to_it_cleared():
    assert drawing(entered((0.5, 2.5), [(5.5, 2.5)]), MODEL.prior) == drawn(
        """
        ???????
        ???????
        .....#?
        ???????
        ???????
        """
    )


def test_a_silent_beam_clears_its_end_as_well():
    assert drawing(entered((6.5, 4.5), NOTHING, [(2.5, 4.5)]), MODEL.prior) == drawn(
        """
        ??.....
        ???????
        ???????
        ???????
        ???????
        """
    )


def test_a_hit_wins_over_the_misses_of_other_beams():
    beams = [(6.5, 2.5), (3.5, 2.5)]
    expected = drawn(
        """
        ???????
        ???????
        ...#..#
        ???????
        ???????
        """
    )
    assert drawing(entered((0.5, 2.5), beams), MODEL.prior) == expected
    assert drawing(entered((0.5, 2.5), beams[::-1]), MODEL.prior) == expected
    assert drawing(entered((0.5, 2.5), [(3.5, 2.5)], [(2.5, 2.5), (6.5, 2.5)]), MODEL.prior) == drawn(
        """
        ???????
        ???????
        ...#...
        ???????
        ???????
        """
    )


def test_a_sensor_on_a_wall_keeps_the_wall():
    assert drawing(entered((3.5, 2.5), [(3.6, 2.6)]), MODEL.prior).count("#") == 1


@pytest.mark.parametrize("copies", [2, 5])
def test_a_cell_changes_once_per_scan(copies):
    once = entered((0.5, 2.5), [(5.5, 2.5)], [(5.5, 4.5)])
    often = entered((0.5, 2.5), [(5.5, 2.5), (5.4, 2.6)] * copies, [(5.5, 4.5)] * copies)
    assert (often == once).all()


def test_the_next_scan_changes_it_again():
    cells = entered((0.5, 2.5), [(5.5, 2.5)])
    twice = entered((0.5, 2.5), [(5.5, 2.5)], cells=cells.copy())
    assert int(twice[2, 5]) == int(cells[2, 5]) + MODEL.hit_step
    assert int(twice[2, 3]) == int(cells[2, 3]) + MODEL.miss_step


def test_no_beam_changes_nothing():
    assert not entered((3.5, 2.5), NOTHING).any()


# irrational offsets: no ray passes through the corner of a cell, where rounding decides
cell_numbers = st.tuples(st.integers(2, 30), st.integers(2, 30))
hit_points = st.lists(cell_numbers.map(lambda k: (k[0] + 2**0.5 - 1, k[1] + 3**0.5 - 1)), max_size=12)
free_points = st.lists(cell_numbers.map(lambda k: (k[0] + 5**0.5 - 2, k[1] + 7**0.5 - 2)), max_size=12)
scans = st.lists(st.tuples(cell_numbers, hit_points, free_points), min_size=1, max_size=5)


@given(scans)
def test_the_kernel_enters_what_the_naive_twin_enters(recorded):
    cells, known = np.zeros((34, 34), np.uint16), {}
    for mark, (sensor, hits, free_ends) in enumerate(recorded):
        at = (sensor[0] + 0.3, sensor[1] + 0.6)
        entered(at, hits, free_ends, cells=cells, mark=mark + 1)
        naive_insert(known, at, hits, free_ends, MODEL)
    assert {(int(c), int(r)): int(cells[r, c]) for r, c in np.argwhere(cells)} == known


@given(st.lists(st.tuples(coordinate, coordinate), min_size=1, max_size=20), st.integers(0, 20))
def test_the_box_holds_all_points(points, split):
    array = np.array(points)
    box = np.array([*points[0], *points[0]])
    assert extend_box(array[:split], box)
    assert extend_box(array[split:], box)
    assert box.tolist() == [*array.min(axis=0), *array.max(axis=0)]


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("place", [(0, 0), (2, 1), (4, 0)])
def test_the_box_tells_of_points_that_are_not_finite(bad, place):
    points = np.zeros((5, 2))
    points[place] = bad
    assert not extend_box(points, np.zeros(4))
