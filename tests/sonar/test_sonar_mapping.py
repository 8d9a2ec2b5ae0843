"""Sonar maps: what the four algorithms make of a few readings."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sonar_worlds import LEFT, ring, sweeps

from glassslam.config import SonarConfig
from glassslam.sonar.mapping import beam_width, build_sonar_map, combined_masses

ALGORITHMS = ("ICL", "ICo", "DS", "BFA")
every = pytest.mark.parametrize("algorithm", ALGORITHMS)


def at(grid, x, y):
    column = math.floor((x - grid.origin[0]) / grid.resolution)
    row = math.floor((y - grid.origin[1]) / grid.resolution)
    rows, columns = grid.probability.shape
    return float(grid.probability[row, column]) if 0 <= row < rows and 0 <= column < columns else math.nan


def mapped(ranges, algorithm="BFA", sonars=None, poses=None, **config):
    return build_sonar_map(
        sweeps(ranges, sonars or ring(0.0), poses), SonarConfig(algorithm=algorithm, **config)
    )


@every
def test_an_obstacle_is_occupied_and_the_way_to_it_free(algorithm):
    grid = mapped([[1.0]] * 5, algorithm)
    assert at(grid, 1.02, 0.02) > 0.65
    assert at(grid, 0.5, 0.02) < 0.42
    assert math.isnan(at(grid, 1.3, 0.02))
    assert math.isnan(at(grid, -0.1, 0.02))
    assert grid.probability.dtype == np.float32


@pytest.mark.parametrize(("algorithm", "wide"), [("ICL", False), ("ICo", True), ("DS", True), ("BFA", True)])
def test_only_the_centre_line_knows_no_cone(algorithm, wide):
    grid = mapped([[1.0]] * 5, algorithm, beam_width_deg=30.0)
    off_axis = at(grid, math.cos(0.12), math.sin(0.12))
    assert (off_axis > 0.65) if wide else math.isnan(off_axis)


def test_the_cone_is_as_wide_as_measured_and_never_wider_than_the_field_of_view():
    narrow, wide = sweeps([[1.0]], ring(0.0, fov_deg=10.0)), sweeps([[1.0]], ring(0.0, fov_deg=30.0))
    assert beam_width(wide, SonarConfig(beam_width_deg=18.0)) == pytest.approx(math.radians(18.0))
    assert beam_width(narrow, SonarConfig(beam_width_deg=18.0)) == pytest.approx(math.radians(10.0))
    assert beam_width(wide, SonarConfig(beam_width_deg=0.0)) == pytest.approx(math.radians(30.0))


def test_the_cells_are_those_of_the_robot_turned_and_moved():
    grid = mapped([[1.0]] * 5, sonars=ring(LEFT, offset=0.2), poses=[[3.0, -2.0, LEFT]] * 5)
    assert at(grid, 3.0 - 1.2 + 0.01, -2.0 + 0.01) > 0.65


@every
@pytest.mark.parametrize("value", [math.nan, math.inf, 0.05, -1.0])
def test_what_is_no_reading_changes_nothing(algorithm, value):
    assert (
        build_sonar_map(sweeps([[value]], ring(0.0)), SonarConfig(algorithm=algorithm)).probability.size == 0
    )
    with_it = mapped([[1.0], [value]], algorithm).probability
    assert np.array_equal(with_it, mapped([[1.0]], algorithm).probability, equal_nan=True)


@every
def test_a_reading_beyond_the_limit_clears_up_to_it_and_marks_nothing(algorithm):
    grid = mapped([[3.0]], algorithm, max_range=1.5)
    assert at(grid, 0.7, 0.02) < 0.5
    assert math.isnan(at(grid, 1.6, 0.02))
    assert not (grid.probability > 0.5).any()


def test_silence_clears_only_when_asked():
    grid = mapped([[math.inf]], no_echo_free_length=0.8)
    assert at(grid, 0.4, 0.02) < 0.5
    assert math.isnan(at(grid, 0.9, 0.02))


def test_far_obstacles_weigh_less_in_icl():
    near, far = (at(mapped([[r]], "ICL", max_range=4.0), r, 0.0) for r in (1.0, 3.0))
    assert near == pytest.approx(math.exp(-((1.0 / 4.0) ** 2)), abs=1e-6)
    assert far == pytest.approx(math.exp(-((3.0 / 4.0) ** 2)), abs=1e-6)


def test_later_readings_erase_earlier_ones_in_ico_but_not_in_bfa():
    readings = [[1.0]] * 6 + [[1.8]] * 2
    assert at(mapped(readings, "ICo"), 1.02, 0.02) < 0.5
    assert at(mapped(readings, "BFA"), 1.02, 0.02) > 0.65


def test_the_thickness_of_the_arc_grows_with_the_range():
    def thickness(reach):
        grid = mapped([[reach]], max_range=4.0, arc_growth=0.05)
        line = [at(grid, x, 0.02) > 0.5 for x in np.arange(0.5, reach + 0.5, 0.05)]
        return sum(line)

    assert thickness(3.0) > thickness(1.0)


@every
def test_no_sweeps_give_an_empty_map(algorithm):
    nothing = sweeps(np.empty((0, 1)), ring(0.0))
    assert build_sonar_map(nothing, SonarConfig(algorithm=algorithm)).probability.shape == (0, 0)


@pytest.mark.parametrize("algorithm", ["DS", "BFA"])
def test_the_order_of_sweeps_does_not_matter_to_evidence(algorithm):
    readings = np.array([[1.0], [1.2], [1.5], [1.0]])
    forth, back = mapped(readings, algorithm), mapped(readings[::-1], algorithm)
    assert forth.probability == pytest.approx(back.probability, abs=1e-6, nan_ok=True)


masses = st.lists(st.tuples(st.booleans(), st.floats(0.001, 0.95)), min_size=1, max_size=12)


def dempster(a, b):
    """Dempster's rule for masses (full, empty, either), by its definition."""
    conflict = a[0] * b[1] + a[1] * b[0]
    full = a[0] * b[0] + a[0] * b[2] + a[2] * b[0]
    empty = a[1] * b[1] + a[1] * b[2] + a[2] * b[1]
    return tuple(m / (1.0 - conflict) for m in (full, empty, a[2] * b[2]))


@given(masses)
def test_combining_full_and_empty_at_the_end_is_dempsters_rule_reading_by_reading(readings):
    belief = (0.0, 0.0, 1.0)
    doubt = {True: 0.0, False: 0.0}
    for is_full, mass in readings:
        belief = dempster(belief, (mass, 0.0, 1.0 - mass) if is_full else (0.0, mass, 1.0 - mass))
        doubt[is_full] += math.log(1.0 - mass)
    combined = combined_masses(np.array([doubt[True]]), np.array([doubt[False]]))
    assert combined[0] == pytest.approx(belief[0] + 0.5 * belief[2], abs=1e-9)


def test_overwhelming_evidence_stays_a_number():
    doubt = np.array([-1e4, 0.0, -1e4, 0.0])
    against = np.array([0.0, -1e4, -1e4, 0.0])
    combined = combined_masses(doubt, against)
    assert combined[:3] == pytest.approx([1.0, 0.0, 0.5], abs=1e-6)
    assert math.isnan(combined[3])
