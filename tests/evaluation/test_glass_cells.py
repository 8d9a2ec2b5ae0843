"""Glass cells of a map against true panes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glassslam.evaluation import evaluate_glass_cells
from glassslam.geometry import inverse, transform_points

CELL = 0.05
PANE = np.array([[[0.0, 0.0], [2.0, 0.0]]])


def drawing(*rows, corner=(0.0, 5.0)):
    """Centres of the cells marked # in a drawing, highest y on top."""
    marks = np.array([[cell == "#" for cell in row] for row in rows[::-1]])
    return np.array(corner) + CELL * (np.argwhere(marks)[:, ::-1] + 0.5)


def line(start, end):
    """Cells along a line."""
    points = np.array(start) + np.linspace(0.0, 1.0, 400)[:, None] * (np.array(end) - start)
    return CELL * (np.unique(np.floor(points / CELL), axis=0) + 0.5)


def found(errors):
    return [row.found for row in errors.within]


def test_cells_on_the_pane_detect_it():
    errors = evaluate_glass_cells(line((0, 0.01), (1.99, 0.01)), [PANE], resolution=CELL)
    assert (errors.cells, errors.true_length) == (40, pytest.approx(2.0))
    assert found(errors) == pytest.approx([2.0] * 3)
    assert [row.found_percent for row in errors.within] == pytest.approx([100.0] * 3)
    assert (errors.false_cells, errors.false_length) == (0, 0.0)


def test_cells_beside_the_pane_detect_it_by_tolerance():
    errors = evaluate_glass_cells(line((0, 0.16), (1.99, 0.16)), [PANE], resolution=CELL)
    assert found(errors) == pytest.approx([0.0, 0.0, 2.0])
    assert errors.false_length == 0.0


def test_a_part_is_detected_by_its_length():
    errors = evaluate_glass_cells(line((0, 0.01), (0.99, 0.01)), [PANE], resolution=CELL)
    assert found(errors) == pytest.approx([1.07, 1.12, 1.22], abs=0.03)


def test_no_cells_detect_nothing_and_no_glass_is_no_share():
    nothing = np.empty((0, 2))
    errors = evaluate_glass_cells(nothing, [PANE], resolution=CELL)
    assert (found(errors), errors.false_length) == ([0.0] * 3, 0.0)
    errors = evaluate_glass_cells(line((0, 0), (1, 0)), [], resolution=CELL)
    assert [row.found_percent for row in errors.within] == [None] * 3
    assert errors.false_cells == 21


@pytest.mark.parametrize(
    ("rows", "cells"),
    [
        (["######"], 6),
        (["#", "#", "#"], 3),
        (["#"], 1),
        (["#.#.#"], 3),
        (["...#", "..#.", ".#..", "#..."], 1 + 3 * 2**0.5),
        (["#..", "#..", "###"], 5),
        (["#" * 20, "#" * 20, "#" * 20], 19),
    ],
)
def test_false_glass_is_measured_along_its_lines(rows, cells):
    """A line three cells thick counts once; a corner is not cut short; every line ends with half a cell."""
    errors = evaluate_glass_cells(drawing(*rows), [PANE], resolution=CELL)
    assert errors.false_length == pytest.approx(CELL * cells, abs=1.1 * CELL)
    if len(rows) != 3 or rows[0] != "#" * 20:
        assert errors.false_cells == sum(row.count("#") for row in rows)


@given(st.floats(-np.pi, np.pi), st.floats(-5, 5), st.floats(-5, 5))
def test_the_map_may_lie_in_another_frame(angle, x, y):
    pose = np.array([x, y, angle])
    cells = np.concatenate((line((0, 0.01), (1.99, 0.01)), line((0, 4), (1, 4))))
    as_it_is = evaluate_glass_cells(cells, [PANE], resolution=CELL)
    turned = transform_points(pose, PANE.reshape(-1, 2)).reshape(-1, 2, 2)
    moved = evaluate_glass_cells(cells, [turned], resolution=CELL, true_from_map=pose)
    assert found(moved) == pytest.approx(found(as_it_is), abs=0.021)
    assert moved.false_length == as_it_is.false_length
    back = evaluate_glass_cells(
        transform_points(inverse(pose), cells), [PANE], resolution=CELL, true_from_map=pose
    )
    assert found(back) == pytest.approx(found(as_it_is), abs=0.021)


@given(st.floats(0, np.pi))
def test_the_length_of_a_line_hardly_depends_on_its_direction(angle):
    """Every cell a line passes through, so the strip is up to half a cell longer at both ends."""
    end = np.array([3.0 * np.cos(angle), 5.0 + 3.0 * np.sin(angle)])
    errors = evaluate_glass_cells(line((0, 5), end), [], resolution=CELL)
    assert 0.99 * 3.0 < errors.false_length < 1.07 * 3.0 + 1.5 * CELL


@pytest.mark.parametrize("thickness", [1, 2, 3, 5])
def test_false_glass_on_a_diagonal_is_as_long_as_it_is(thickness):
    """Thick lines a few degrees off the diagonal, of which thinning would leave as little as the half."""
    across = np.arange(thickness) * CELL * 2**-0.5 * np.array([[-1.0], [1.0]])
    for angle in np.deg2rad(np.arange(41.0, 50.0)):
        ends = [(move, move + 3.0 * np.array([np.cos(angle), np.sin(angle)])) for move in across.T]
        errors = evaluate_glass_cells(
            np.concatenate([line(*each) for each in ends]), [PANE + 50.0], resolution=CELL
        )
        assert errors.false_length == pytest.approx(3.0, rel=0.07, abs=0.1)
