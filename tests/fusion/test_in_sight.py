"""What the lidar has seen and left undecided is free in sight of the path, up to what is occupied."""

from dataclasses import replace

import numpy as np
import pytest
from fusion_worlds import LEFT, RIGHT, drawn, ring, sweeps
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from glassslam.config import SonarConfig
from glassslam.fusion.listener import by_walls
from glassslam.records import Trajectory

SIGNS = {"#": 0.9, "+": 0.5, ".": 0.1}
AHEAD = ring(0.0)
IN_THE_FIRST_CELL = [(0.25, 0.25, 0.0)]
IN_THE_CORNER = [(0.75, 0.75, 0.0)]


def run_along(result, lidar, poses):
    """A run with the given map, whose nodes have the given poses."""
    poses = np.array(poses, dtype=np.float64).reshape(-1, 3)
    tracks = replace(result.tracks, nodes=Trajectory(np.arange(len(poses), dtype=np.float64), poses))
    return replace(result, map=lidar, lidar_map=lidar, closed_map=lidar, tracks=tracks)


@pytest.fixture
def joined(tiny_result, draw_map):
    """Cells of a drawn map seen from the poses of nodes, joined with sonars that hear nothing."""

    def join(drawing, nodes=IN_THE_FIRST_CELL, heard=None):
        silent = sweeps(IN_THE_FIRST_CELL, AHEAD)
        run = run_along(tiny_result, draw_map(drawing), nodes)
        fused = by_walls(run, silent if heard is None else heard, SonarConfig())
        return fused.source, drawn(fused.map.probability, SIGNS)

    return join


@pytest.mark.parametrize("heading", [0.0, 0.7, np.pi])
def test_undecided_cells_all_around_are_free_up_to_what_is_occupied(joined, heading):
    _, after = joined(
        """
        ++++++++
        #######+
        #+++++#+
        #+++++#+
        #+++++#+
        #######+
        """,
        nodes=[(1.75, 1.25, heading)],
    )
    assert after == [
        "++++++++",
        "#######+",
        "#.....#+",
        "#.....#+",
        "#.....#+",
        "#######+",
    ]


def test_what_is_around_a_corner_stays(joined):
    _, after = joined(
        """
        #########
        #+++++++#
        #+#######
        #+#######
        #+#######
        #########
        """,
        nodes=IN_THE_CORNER,
    )
    assert after == [
        "#########",
        "#.++++++#",
        "#.#######",
        "#.#######",
        "#.#######",
        "#########",
    ]


def test_no_reading_is_asked_for_and_no_range_is_the_limit(joined):
    far = 30 * "+"
    assert joined(far + "#")[1] == [30 * "." + "#"], "15 m with sonars of 5 m"


def test_what_the_lidar_never_saw_stays_unknown_and_holds_no_line(joined):
    assert joined("+??+#+")[1] == [".??.#+"]


def test_a_line_that_nothing_stops_tells_nothing(joined):
    assert joined("++++++")[1] == ["++++++"]


def test_every_node_counts(joined):
    two_rooms = """
        #########
        #+++#+++#
        #+++#+++#
        #########
        """
    far_room = (3.25, 0.75, 0.0)
    assert joined(two_rooms, nodes=IN_THE_CORNER)[1][1:3] == ["#...#+++#", "#...#+++#"]
    assert joined(two_rooms, nodes=[far_room])[1][1:3] == ["#+++#...#", "#+++#...#"]
    assert joined(two_rooms, nodes=[*IN_THE_CORNER, far_room])[1][1:3] == ["#...#...#", "#...#...#"]


@pytest.mark.parametrize("yaws", [(0.0,), (LEFT, RIGHT), tuple(np.linspace(-3.0, 3.0, 16))])
def test_neither_where_the_sonars_are_nor_where_they_look_matters(joined, yaws):
    two_rooms = """
        #########
        #+++#+++#
        #+++#+++#
        #########
        """
    elsewhere = sweeps([(3.25, 0.75, 0.0), (3.25, 1.25, 1.0)], ring(*yaws))
    assert joined(two_rooms, IN_THE_CORNER, elsewhere)[1][1:3] == ["#...#+++#", "#...#+++#"]


def test_walls_that_run_aslant_hold_a_line(joined):
    _, after = joined(
        """
        ######
        #+#+++
        #++#++
        #+++#+
        ######
        """,
        nodes=IN_THE_CORNER,
    )
    assert after == [
        "######",
        "#.#+++",
        "#..#++",
        "#...#+",
        "######",
    ]


def test_the_lidar_remains_the_one_who_saw_these_cells(joined):
    assert joined("+++?#")[0].tolist() == [[1, 1, 1, 0, 1]]


def test_a_run_without_nodes_sees_nothing(joined):
    assert joined("+++#", nodes=[])[1] == ["+++#"]


def test_what_is_freer_already_is_not_made_less_free(tiny_result, draw_map):
    lidar = draw_map("....#")
    lidar.probability[0, :4] = [0.02, 0.33, 0.1, 0.6]
    run = run_along(tiny_result, lidar, IN_THE_FIRST_CELL)
    fused = by_walls(run, sweeps(IN_THE_FIRST_CELL, AHEAD), SonarConfig()).map.probability
    assert fused[0] == pytest.approx([0.02, 0.1, 0.1, 0.1, 0.9])


# the tiny result is never changed
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    arrays(np.float32, (9, 12), elements=st.sampled_from([np.nan, 0.05, 0.2, 0.5, 0.9]).map(np.float32)),
    arrays(np.float64, (4, 3), elements=st.floats(0.0, 6.0)),
)
def test_nothing_is_erased_and_nothing_unknown_appears(tiny_result, cells, poses):
    lidar = replace(tiny_result.map, probability=cells, resolution=0.5, origin=(0.0, 0.0))
    run = run_along(tiny_result, lidar, poses)
    after = by_walls(run, sweeps(poses, ring(0.0, 2.0, LEFT)), SonarConfig()).map.probability
    occupied = cells > 0.65
    assert np.array_equal(np.isnan(after), np.isnan(cells))
    assert np.array_equal(after[occupied], cells[occupied])
    known = ~np.isnan(cells) & ~occupied
    changed = known & (after != cells)
    assert (after[changed] == np.float32(0.1)).all()
    assert (cells[changed] > 0.1).all()
