"""What the lidar has seen and left undecided is free on the axes of the sonars, up to what is occupied."""

from dataclasses import replace

import numpy as np
import pytest
from fusion_worlds import LEFT, drawn, ring, sweeps
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from glassslam.config import SonarConfig
from glassslam.fusion.listener import by_walls

SIGNS = {"#": 0.9, "+": 0.5, ".": 0.1}
AHEAD = ring(0.0)
IN_THE_FIRST_CELL = [(0.25, 0.25, 0.0)]


@pytest.fixture
def joined(tiny_result, draw_map):
    """Cells of a drawn map joined with sonars that look along their axes and hear nothing."""

    def join(drawing, poses=IN_THE_FIRST_CELL, sonars=AHEAD):
        lidar = draw_map(drawing)
        run = replace(tiny_result, map=lidar, lidar_map=lidar, closed_map=lidar)
        fused = by_walls(run, sweeps(poses, sonars), SonarConfig())
        return fused.source, drawn(fused.map.probability, SIGNS)

    return join


def test_undecided_cells_on_the_axis_are_free_up_to_what_is_occupied(joined):
    _, after = joined("""
        ++++++++
        ++++##++
        """)
    assert after == [
        "++++++++",
        "....##++",
    ]


def test_no_reading_is_asked_for_and_no_range_is_the_limit(joined):
    far = 30 * "+"
    assert joined(far + "#")[1] == [30 * "." + "#"], "15 m with sonars of 5 m"


def test_what_the_lidar_never_saw_stays_unknown_and_holds_no_axis(joined):
    assert joined("+??+#+")[1] == [".??.#+"]


def test_an_axis_that_nothing_stops_tells_nothing(joined):
    assert joined("++++++")[1] == ["++++++"]


def test_every_sonar_of_the_ring_and_every_sweep_counts(joined):
    _, after = joined(
        """
        ###+##
        ++++++
        ++++++
        ++++#+
        """,
        poses=[(0.25, 0.25, 0.0), (1.25, 0.25, 0.0)],
        sonars=ring(0.0, LEFT),
    )
    assert after == [
        "###+##",
        ".+.+++",
        ".+.+++",
        "....#+",
    ]


def test_walls_that_run_aslant_hold_an_axis(joined):
    _, after = joined(
        """
        #++++
        +#+++
        ++#++
        +++#+
        ++++#
        """,
        poses=[(0.25, 0.75, 0.25 * np.pi)],
    )
    assert after == [
        "#++++",
        "+#+++",
        "+.#++",
        ".++#+",
        "++++#",
    ]


def test_the_lidar_remains_the_one_who_saw_these_cells(joined):
    assert joined("+++?#")[0].tolist() == [[1, 1, 1, 0, 1]]


def test_what_is_freer_already_is_not_made_less_free(tiny_result, draw_map):
    lidar = draw_map("....#")
    lidar.probability[0, :4] = [0.02, 0.33, 0.1, 0.6]
    run = replace(tiny_result, map=lidar, lidar_map=lidar, closed_map=lidar)
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
    run = replace(tiny_result, map=lidar, lidar_map=lidar, closed_map=lidar)
    after = by_walls(run, sweeps(poses, ring(0.0, 2.0, LEFT)), SonarConfig()).map.probability
    occupied = cells > 0.65
    assert np.array_equal(np.isnan(after), np.isnan(cells))
    assert np.array_equal(after[occupied], cells[occupied])
    known = ~np.isnan(cells) & ~occupied
    changed = known & (after != cells)
    assert (after[changed] == np.float32(0.1)).all()
    assert (cells[changed] > 0.1).all()
