"""The true map of a scene, drawn into cells."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from glassslam.simulation import draw_true_map, in_sight
from glassslam.simulation.sight_kernels import mark_rays

BOX = np.array(
    [[0.25, 0.25, 4.25, 0.25], [4.25, 0.25, 4.25, 2.25], [4.25, 2.25, 0.25, 2.25], [0.25, 2.25, 0.25, 0.25]]
)
SIGNS = {1.0: "#", 0.0: "."}


def drawing(segments, *places, glass=()):
    """The map around what is known, highest y on top: # occupied, G glass, . free, blank unknown."""
    mask = np.isin(np.arange(len(segments)), glass)
    drawn = draw_true_map(
        np.array(segments, dtype=float), mask, np.array(places, dtype=float), resolution=0.5
    )
    signs = np.vectorize(lambda p: SIGNS.get(p, " "))(drawn.grid.probability.astype(float))
    signs[drawn.glass] = "G"
    known = signs != " "
    rows, columns = np.flatnonzero(known.any(axis=1)), np.flatnonzero(known.any(axis=0))
    part = signs[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    return ["".join(line) for line in part[::-1]], drawn


def test_a_room_is_free_within_its_walls_and_unknown_outside():
    lines, drawn = drawing(BOX, [1, 1], glass=[2])
    assert lines == [
        "GGGGGGGGG",
        "#.......#",
        "#.......#",
        "#.......#",
        "#########",
    ]
    assert drawn.grid.origin == (-5.0, -5.0)
    assert drawn.glass_share == pytest.approx(9 / 24)


def test_what_cannot_be_reached_stays_unknown_and_so_do_its_walls():
    shut = [[2.25, 0.25, 2.25, 2.25]]
    lines, _ = drawing(np.vstack((BOX, shut, BOX + np.array([5, 0, 5, 0]))), [1, 1])
    assert lines == ["#####", "#...#", "#...#", "#...#", "#####"]


def test_only_the_faces_that_touch_free_space_are_drawn():
    thick = BOX + np.array([-0.5, -0.5, 0.5, -0.5]), BOX[[1]] + [0.5, 0, 0.5, 0]
    lines, _ = drawing(np.vstack((BOX, *thick)), [1, 1])
    assert lines[1] == "#.......#"


def test_doors_to_the_outside_are_taken_as_shut_and_doors_between_rooms_are_not():
    """The wall on the right has a door of 1 m to the open; a door of 0.5 m leads to the room on the left."""
    rooms = np.vstack(
        (BOX[[0, 2, 3]], [[4.25, 0.25, 4.25, 0.75]], [[4.25, 1.75, 4.25, 2.25]], [[2.25, 0.25, 2.25, 1.25]])
    )
    lines, drawn = drawing(rooms, [3, 1])
    assert [line[:5] for line in lines] == ["#####", "#....", "#...#", "#...#", "#####"]
    outside = drawn.grid.probability[:, 10 + 13 :]
    assert np.isnan(outside).all()


def test_things_on_the_floor_are_outlines():
    table = np.array([[1.75, 1.25], [3.25, 1.25], [3.25, 2.75], [1.75, 2.75]])
    lines, _ = drawing(np.vstack((2 * BOX - 0.25, np.hstack((table, np.roll(table, -1, axis=0))))), [1, 1])
    assert lines[4] == "#..#  #.........#"


def test_what_is_never_in_sight_can_be_left_out():
    """From its left end a room with a screen in the middle shows what is not behind the screen."""
    segments = np.vstack((BOX, [[2.25, 0.75, 2.25, 1.75]]))
    drawn = draw_true_map(segments, np.zeros(5, dtype=bool), np.array([[1.0, 1.25]]), resolution=0.05)
    seen = in_sight(drawn, segments, np.array([[1.0, 1.25], [1.0, 1.26]]))

    def at(grid, x, y):
        column, row = np.floor((np.array([x, y]) - grid.origin) / 0.05).astype(int)
        return grid.probability[row, column]

    assert at(drawn.grid, 3.0, 1.25) == at(drawn.grid, 1.5, 1.0) == at(seen.grid, 1.5, 1.0) == 0.0
    assert np.isnan(at(seen.grid, 3.0, 1.25))
    assert at(seen.grid, 2.25, 1.25) == at(drawn.grid, 4.26, 1.25) == 1.0
    assert np.isnan(at(seen.grid, 4.26, 1.25))


@given(
    arrays(np.float64, (5, 2), elements=st.floats(-1, 3)),
    arrays(np.float64, 5, elements=st.floats(-4, 4)),
    arrays(np.float64, 5, elements=st.floats(0, 4)),
)
def test_rays_mark_the_cells_their_naive_twin_marks(origins, angles, lengths):
    low, seen, naive = np.array([0.1, -0.2]), np.zeros((6, 7), dtype=bool), np.zeros((6, 7), dtype=bool)
    mark_rays(origins, angles, lengths, low, 0.5, seen)
    for origin, angle, length in zip(origins, angles, lengths, strict=True):
        for way in 0.25 * np.arange(int(4.0 * length)):
            place = origin + way * np.array([np.cos(angle), np.sin(angle)])
            column, row = np.floor((place - low) / 0.5).astype(int)
            if 0 <= column < 7 and 0 <= row < 6:
                naive[row, column] = True
    assert np.array_equal(seen, naive)
