"""Length of the lines that cells draw."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from scipy.ndimage import label

from glassslam.evaluation import cell_lines
from glassslam.evaluation.cell_lines import drawn_length

CELL = 0.05
TOUCHING = np.ones((3, 3))
angles = st.one_of(
    st.floats(-np.pi, np.pi),
    st.floats(-0.1, 0.1).map(lambda angle: angle + np.pi / 4),
    st.sampled_from([0.0, np.pi / 4, np.pi / 2, np.arctan(0.5), np.arctan(1 / 3)]),
)
offsets = st.tuples(st.floats(0, 1), st.floats(0, 1))
thicknesses = st.floats(1.0, 5.0)


def cells_of(*rows):
    """Centres of the cells marked # in a drawing, cells."""
    return np.argwhere([[mark == "#" for mark in row] for row in rows]).astype(float)


def strip(length, thickness, angle, middle):
    """Centres in a rectangle."""
    reach = int(length + thickness) // 2 + 3
    centres = np.stack(np.meshgrid(*2 * [np.arange(-reach, reach + 1.0)]), axis=-1).reshape(-1, 2)
    along = (centres - middle) @ [np.cos(angle), np.sin(angle)]
    across = (centres - middle) @ [-np.sin(angle), np.cos(angle)]
    return centres[(abs(along) <= length / 2) & (abs(across) <= thickness / 2)]


def stroke(corners, thickness, angle=0.0, middle=(0.0, 0.0)):
    """Centres within half the thickness of a line through corners, turned and moved."""
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    corners = np.array(corners, dtype=float) @ turn + middle
    low, high = np.floor(corners.min(axis=0)) - 4, np.ceil(corners.max(axis=0)) + 5
    x, y = np.meshgrid(np.arange(low[0], high[0]), np.arange(low[1], high[1]))
    centres = np.column_stack((x.ravel(), y.ravel()))
    gaps = np.full(len(centres), np.inf)
    for start, end in pairwise(corners):
        way = end - start
        share = np.clip((centres - start) @ way / (way @ way), 0.0, 1.0)
        gaps = np.minimum(gaps, np.hypot(*(centres - start - share[:, None] * way).T))
    return centres[gaps <= thickness / 2]


def circle(radius):
    turns = np.linspace(0.0, 2.0 * np.pi, 100)
    return radius * np.column_stack((np.cos(turns), np.sin(turns)))


def naive_strip_length(drawing):
    """From half an outline and an area, counted by squares of two by two centres, without straightening."""
    padded = np.pad(drawing, 1)
    half = area = 0.0
    for i in range(padded.shape[0] - 1):
        for j in range(padded.shape[1] - 1):
            square = padded[i : i + 2, j : j + 2]
            filled = int(square.sum())
            area += {3: 0.5, 4: 1.0}.get(filled, 0.0)
            half += 2**0.5 / 2 if filled == 3 else 0.0
            half += 2**0.5 if filled == 2 and square[0, 0] == square[1, 1] else 0.0
            # every side belongs to two squares, and is outline towards each that is not filled
            sides = [square[0].all(), square[1].all(), square[:, 0].all(), square[:, 1].all()]
            half += 0.5 * sum(sides) if filled < 3 else 0.0
    ends = 1 - (label(~padded)[1] - 1)
    return half / 2 + max(half**2 / 4 - ends * area, 0.0) ** 0.5 + ends


@given(arrays(bool, array_shapes(min_dims=2, max_dims=2, max_side=9), elements=st.booleans()))
def test_without_straightening_it_is_what_counting_squares_gives(drawing):
    """Holes of any size count; where the box around a strip is longer, it is no longer than the strip."""
    strips, number = label(drawing, TOUCHING)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(cell_lines, "_STRAIGHT", 0.0)
        patch.setattr(cell_lines, "_GAP", 0.0)
        for index in range(1, number + 1):
            centres = np.argwhere(strips == index).astype(float)
            far = np.linalg.norm(centres[:, None] - centres, axis=-1).max() + 1.0
            naive = naive_strip_length(strips == index)
            assert naive - 1e-6 <= drawn_length(centres, 1.0) <= max(naive, far) + 1e-6


def test_no_cells_have_no_length():
    assert drawn_length(np.empty((0, 2)), CELL) == 0.0


@pytest.mark.parametrize("edge", [1, 2, 3, 4, 5])
def test_a_square_is_as_long_as_its_edge(edge):
    assert drawn_length(np.argwhere(np.ones((edge, edge))) * CELL, CELL) == pytest.approx(CELL * edge)


@pytest.mark.parametrize(
    ("rows", "length"),
    [
        (["######"], 6),
        (["#", "#", "#"], 3),
        (["#.#.#"], 3),
        (["#...", ".#..", "..#.", "...#"], 1 + 3 * 2**0.5),
        (["##...", ".##..", "..##.", "...##", "....#"], 1 + 4 * 2**0.5),
        (["#" * 20] * 3, 20),
        (["#" * 20, "#" * 8 + "." + "#" * 11, "#" * 20], 20),
        (["#" * 12, "##..####.###", "##..####.###", "#" * 12], 12),
    ],
)
def test_straight_lines_are_exact_along_the_grid_and_its_diagonals(rows, length):
    assert drawn_length(cells_of(*rows), 1.0) == pytest.approx(length, abs=0.5)


@given(st.integers(1, 30))
def test_lone_cells_count_a_cell_each(number):
    assert drawn_length(2.0 * CELL * np.argwhere(np.ones((number, 3))), CELL) == pytest.approx(
        3 * number * CELL
    )


@given(st.floats(20, 80), thicknesses, angles, offsets)
def test_a_strip_is_as_long_as_it_is(length, thickness, angle, middle):
    measured = drawn_length(strip(length, thickness, angle, middle), 1.0)
    assert -2.0 < measured - length < 0.07 * length + 1.5


@given(st.floats(6, 20), thicknesses, angles, offsets)
def test_a_short_strip_is_hardly_shorter(length, thickness, angle, middle):
    measured = drawn_length(strip(length, thickness, angle, middle), 1.0)
    assert -2.5 < measured - length < 3.5


@given(thicknesses, angles, offsets)
def test_a_bend_takes_half_the_thickness_and_a_cell(thickness, angle, middle):
    length = 50.0 + thickness
    measured = drawn_length(stroke([(0, 0), (30, 0), (30, 20)], thickness, angle, middle), 1.0)
    assert -0.5 * thickness - 3.0 < measured - length < 0.07 * length + 1.5


@given(thicknesses, angles, offsets)
def test_what_crossing_strips_share_counts_once(thickness, angle, middle):
    arms = [stroke(ends, thickness, angle, middle) for ends in ([(0, 0), (40, 0)], [(20, -20), (20, 20)])]
    measured = drawn_length(np.concatenate(arms), 1.0)
    length = 80.0 + 2.0 * thickness
    assert -2.0 * thickness - 5.0 < measured - length < 0.07 * length + 1.5


@given(thicknesses, angles, offsets)
def test_a_branch_adds_its_length(thickness, angle, middle):
    arms = [stroke(ends, thickness, angle, middle) for ends in ([(0, 0), (40, 0)], [(20, 0), (20, 25)])]
    measured = drawn_length(np.concatenate(arms), 1.0)
    length = 65.0 + thickness
    assert -thickness - 3.5 < measured - length < 0.07 * length + 1.5


@given(thicknesses, st.floats(12, 30), offsets)
def test_a_ring_is_as_long_as_the_way_round(thickness, radius, middle):
    measured = drawn_length(stroke(circle(radius), thickness, middle=middle), 1.0)
    assert measured == pytest.approx(2.0 * np.pi * radius, rel=0.07)


@given(thicknesses, angles, offsets)
def test_a_room_is_as_long_as_its_walls(thickness, angle, middle):
    walls = [(0, 0), (40, 0), (40, 30), (0, 30), (0, 0)]
    measured = drawn_length(stroke(walls, thickness, angle, middle), 1.0)
    assert measured == pytest.approx(140.0, rel=0.07)


@given(st.floats(2, 10), offsets)
def test_a_disc_is_about_as_long_as_it_is_wide(radius, middle):
    centres = np.argwhere(np.ones((25, 25))) - 12.0
    disc = centres[np.hypot(*(centres - middle).T) <= radius]
    assert drawn_length(disc, 1.0) == pytest.approx(2.0 * radius, rel=0.1, abs=2.0)


@given(st.floats(-100, 100), st.floats(-100, 100), st.floats(0.01, 0.2))
def test_where_the_grid_begins_does_not_matter(x, y, resolution):
    """Centres may lie on multiples of the cell edge, where rounding down would tear lines apart."""
    cells = np.concatenate((stroke([(0, 0), (30, 11)], 2.0), cells_of("#.##", "#..#") + 60.0))
    whole = drawn_length(cells, 1.0) * resolution
    for corner in ((x, y), (0.0, 0.0), (0.5 * resolution, -7.0 * resolution)):
        assert drawn_length(cells * resolution + corner, resolution) == pytest.approx(whole)


def test_a_cell_that_is_there_twice_counts_once():
    cells = strip(30.0, 2.0, 0.3, (0.2, 0.1))
    assert drawn_length(np.concatenate((cells, cells[::3])), 1.0) == drawn_length(cells, 1.0)


def test_separate_lines_add_up():
    parts = strip(30.0, 2.0, 0.3, (0.2, 0.1)), strip(25.0, 3.0, 1.3, (0.0, 0.7)) + 100.0
    both = drawn_length(np.concatenate(parts), 1.0)
    assert both == pytest.approx(sum(drawn_length(part, 1.0) for part in parts))


def test_a_line_within_a_ring_counts_too():
    ring = stroke([(0, 0), (30, 0), (30, 30), (0, 30), (0, 0)], 1.0)
    inside = stroke([(10, 10), (20, 10)], 1.0)
    both = drawn_length(np.concatenate((ring, inside)), 1.0)
    assert both == pytest.approx(drawn_length(ring, 1.0) + drawn_length(inside, 1.0))
    assert both == pytest.approx(120 + 11, abs=2)


def test_missing_cells_hardly_change_a_strip():
    random = np.random.default_rng(4)
    for angle in np.linspace(0.0, np.pi, 20):
        cells = strip(60.0, 4.0, angle, (0.3, 0.6))
        left = cells[random.random(len(cells)) > 0.05]
        assert drawn_length(left, 1.0) == pytest.approx(60.0, rel=0.15)


@pytest.mark.parametrize(("wide", "length"), [(1, 30), (2, 30), (3, 66), (4, 68)])
def test_a_hole_wider_than_two_cells_makes_a_ring(wide, length):
    rows = ["#" * 30, *["#" + "." * 28 + "#"] * wide, "#" * 30]
    assert drawn_length(cells_of(*rows), 1.0) == pytest.approx(length, abs=4)
