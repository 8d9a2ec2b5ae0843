"""Odometry and scans that tell different ways."""

from dataclasses import replace

import numpy as np
import pytest
from slam_worlds import RING, odometry, recording, round_trip
from test_degeneracy import COUNT, good

from glassslam.config import Config
from glassslam.slam.closure_degeneracy import find_degeneracies
from glassslam.slam.contradiction import steps_of
from glassslam.slam.degeneracy_words import summarised
from glassslam.slam.mapper import Mapper
from glassslam.slam.motion_watch import MotionReport, Stuck
from glassslam.slam.tracking import How

NOTHING = np.full(COUNT, np.nan)


def with_wheels(wheels, stuck=(), **changes):
    """The good run along x with other odometry."""
    return good(motion=MotionReport(NOTHING, NOTHING, np.asarray(wheels, dtype=np.float64), stuck), **changes)


def along(scale=1.0, begin=0, end=COUNT):
    """Odometry of the good run whose steps are scaled from scan to scan."""
    steps = np.full(COUNT, 0.1)
    steps[begin:end] *= scale
    wheels = np.zeros((COUNT, 3))
    wheels[1:, 0] = np.cumsum(steps)[:-1]
    return wheels


def found(trace):
    return [(one.kind, one.first_scan, one.last_scan) for one in find_degeneracies(trace)]


@pytest.mark.parametrize("scale", [0.8, 1.0, 1.25])
def test_odometry_that_errs_a_little_is_usual(scale):
    assert found(with_wheels(along(scale))) == []


@pytest.mark.parametrize(("scale", "share"), [(-1.0, "200%"), (0.5, "50%"), (2.0, "50%")])
def test_odometry_of_wrong_units_or_signs_is_told(scale, share):
    (one,) = find_degeneracies(with_wheels(along(scale)))
    assert one.kind == "odometry contradicted"
    assert one.text.startswith(f"odometry and scans disagree by {share} of the way, ")
    assert one.length > 19.0
    (line,) = summarised([one])
    assert line.endswith(
        "m, of odometry that the scans contradict: the map may be wrong"
        " (--odom-topic none maps without it): see report"
    )


def test_so_is_odometry_that_looks_another_way():
    wheels = along()
    wheels[:, 2] = np.pi / 2
    assert [kind for kind, _, _ in found(with_wheels(wheels))] == ["odometry contradicted"]


def test_it_is_told_where_it_begins_and_ends():
    ((_, first, last),) = found(with_wheels(along(-1.0, 60, 120)))
    assert abs(first - 60) <= 5
    assert abs(last - 120) <= 5


def test_wheels_that_slip_for_a_step_or_two_are_usual():
    assert found(with_wheels(along(3.0, 60, 70))) == []


def test_without_odometry_nothing_is_contradicted():
    trace = with_wheels(np.full((COUNT, 3), np.nan))
    assert len(steps_of(trace, trace.motion).gap) == 0
    assert found(trace) == []


def test_breaks_and_stuck_odometry_are_told_elsewhere():
    how = good().matches.how.copy()
    how[::4] = How.FIRST
    torn = with_wheels(along(-1.0), matches=replace(good().matches, how=how))
    assert len(steps_of(torn, torn.motion).gap) == 0
    still = with_wheels(np.zeros((COUNT, 3)), (Stuck(0, COUNT - 1, 0.5),))
    assert [kind for kind, _, _ in found(still)] == ["odometry stuck"]


def test_a_gap_is_a_share_of_the_longer_way():
    trace = with_wheels(along(0.5))
    np.testing.assert_allclose(steps_of(trace, trace.motion).gap, 0.5, atol=1e-9)


@pytest.mark.parametrize("turned", [0.0, np.pi])
def test_a_run_with_odometry_that_drives_backwards(turned):
    path = round_trip(0.35)
    wheels = odometry(path, scale=1.01, drift=0.004)
    wheels[:, 2] += turned
    mapper = Mapper(Config())
    try:
        for record in recording(RING, path, wheels, beams=180):
            mapper.add(record)
        statistics = mapper.settle().statistics
    finally:
        mapper.close()
    told = [one.kind for one in statistics.degeneracies]
    assert ("odometry contradicted" in told) == (turned != 0.0)
    assert any("the scans contradict" in text for text in statistics.warnings) == (turned != 0.0)
