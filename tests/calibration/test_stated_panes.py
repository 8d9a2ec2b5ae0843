"""Panes of a map in the frame of a laser, and the beams that meet them."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pane_recordings import bearings, scan_at

from detectors.diffuse import DiffuseCurve
from glassslam.calibration.mapped import FRAME, met_panes, planes_in
from glassslam.calibration.views import Plane, settled

AHEAD = np.array([[[2.0, -1.0], [2.0, 1.0]]])
FLAT = DiffuseCurve((1.0, 5.0), (4000.0, 4000.0))


def test_a_pane_ahead_is_seen_without_its_frame():
    (plane,) = planes_in(np.zeros(3), AHEAD)
    assert (plane.normal, plane.distance) == (0.0, 2.0)
    assert plane.along == pytest.approx((-1.0 + FRAME, 1.0 - FRAME))


def test_the_foot_of_the_normal_may_lie_beside_the_pane():
    (plane,) = planes_in(np.array([0.0, -2.0, 0.0]), AHEAD)
    assert plane.along == pytest.approx((1.0 + FRAME, 3.0 - FRAME))


@pytest.mark.parametrize(
    ("laser", "why"),
    [
        ((-9.0, 0.0, 0.0), "too far"),
        ((1.95, 0.0, 0.0), "in the pane"),
        ((1.0, 5.0, 0.0), "too steep"),
    ],
)
def test_panes_that_cannot_be_read(laser, why):
    assert planes_in(np.array(laser), AHEAD) == [], why


def test_a_pane_shorter_than_its_frames():
    assert planes_in(np.zeros(3), np.array([[[2.0, 0.0], [2.0, 0.2]]])) == []


@given(st.floats(-1.5, 1.5), st.floats(-1.0, 1.0), st.floats(-3.0, 3.0))
def test_the_plane_does_not_depend_on_the_direction_in_which_its_ends_are_given(x, y, theta):
    laser = np.array([x, y, theta])
    (one,), (other,) = planes_in(laser, AHEAD), planes_in(laser, AHEAD[:, ::-1])
    assert one.distance == pytest.approx(2.0 - x)
    assert one.normal == pytest.approx(other.normal)
    assert math.cos(one.normal + theta) == pytest.approx(1.0)
    assert one.along == pytest.approx(other.along)


def naive_met(scan, laser, panes):
    """A beam meets a pane where, walked in steps of a centimetre, it changes sides between the ends."""
    met = []
    for angle, length in zip(bearings(), scan.ranges, strict=True):
        heading = angle + laser[2]
        steps = np.arange(0.0, length + 0.15, 0.01)
        path = laser[:2] + steps[:, None] * np.array([math.cos(heading), math.sin(heading)])
        hit = False
        for start, end in panes:
            along = (end - start) / np.hypot(*(end - start))
            offset = path - start
            side = offset @ np.array([-along[1], along[0]])
            place = offset @ along
            crossed = np.flatnonzero(np.sign(side[1:]) != np.sign(side[:-1]))
            hit |= any(0.0 <= place[k] <= np.hypot(*(end - start)) for k in crossed)
        met.append(hit)
    return np.array(met)


@pytest.mark.parametrize("laser", [(0.0, 0.0, 0.0), (1.0, 1.5, 2.0), (-2.0, -2.0, 0.7)])
def test_beams_that_meet_panes(laser):
    panes = np.array([[[2.0, -1.0], [2.0, 1.0]], [[-1.0, 2.0], [0.5, 2.5]]])
    scan = scan_at(laser)
    found, wanted = met_panes(scan, np.array(laser), panes), naive_met(scan, np.array(laser), panes)
    # a centimetre of walking leaves a beam at the ends undecided
    assert np.count_nonzero(found != wanted) <= 4
    assert 10 < np.count_nonzero(found) < len(found)


def test_what_stands_before_the_pane_has_not_met_it():
    scan = scan_at((2.0, 0.0, 0.0))
    behind_the_wall = np.array([[[5.0, -1.0], [5.0, 1.0]]])
    assert not met_panes(scan, np.array([2.0, 0.0, 0.0]), behind_the_wall).any()


def test_a_stated_plane_is_laid_onto_the_returns():
    scan = scan_at((1.3, 0.0, 0.0), pane_x=2.5)
    stated = Plane(math.radians(2.0), 1.26, (-0.5, 0.5))
    plane = settled(scan, stated, FLAT)
    assert plane.distance == pytest.approx(1.2, abs=0.01)
    assert plane.normal == pytest.approx(0.0, abs=math.radians(0.5))


@pytest.mark.parametrize("stated", [Plane(0.0, 1.8, (-0.5, 0.5)), Plane(0.0, 1.2, (0.0, 0.02))])
def test_where_the_returns_are_elsewhere_or_few_it_stays_as_stated(stated):
    scan = scan_at((1.3, 0.0, 0.0), pane_x=2.5)
    assert settled(scan, stated, FLAT) == stated
