"""Sweeps with their poses."""

import math

import numpy as np
import pytest
from sonar_worlds import LEFT, ring, sweeps

from glassslam.errors import GridError
from glassslam.records import RangeRing, Trajectory
from glassslam.slam.trajectory import PoseTracks
from glassslam.sonar.sweeps import SonarSweeps, placed_sweeps

TRACK = Trajectory(np.array([0.0, 1.0]), np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]))
TRACKS = PoseTracks(TRACK, TRACK, TRACK, TRACK)


def test_sonars_stand_where_base_and_ring_put_them():
    placed = sweeps([[1.0, 1.0]], ring(0.0, LEFT, offset=0.2), [[1.0, 2.0, LEFT]])
    assert placed.sensors[0] == pytest.approx(np.array([[1.0, 2.2, LEFT], [0.8, 2.0, -math.pi]]))


def test_sweeps_outside_the_run_are_left_out():
    records = [RangeRing(t, np.array([t], dtype=np.float32)) for t in (-1.0, 0.25, 0.5, 2.0)]
    placed = placed_sweeps(records, ring(0.0), TRACKS)
    assert placed.stamps.tolist() == [0.25, 0.5]
    assert placed.ranges.tolist() == [[0.25], [0.5]]
    assert placed.poses[:, 0].tolist() == [0.25, 0.5]


def test_no_sweeps_are_no_error():
    assert placed_sweeps([], ring(0.0, LEFT), TRACKS).ranges.shape == (0, 2)


def test_a_sweep_of_another_ring_is_refused():
    with pytest.raises(GridError, match=r"^sweep at 0\.500 s has 3 ranges$") as caught:
        placed_sweeps([RangeRing(0.5, np.zeros(3, np.float32))], ring(0.0, LEFT), TRACKS)
    assert caught.value.hint == "the ring test has 2 sonars"


@pytest.mark.parametrize(("ranges", "poses"), [((2, 3), (2, 3)), ((1, 2), (2, 3)), ((2, 2), (2, 2))])
def test_arrays_that_do_not_fit_are_refused(ranges, poses):
    with pytest.raises(GridError, match="2 sweeps of 2 sonars") as caught:
        SonarSweeps(np.zeros(2), np.zeros(ranges), ring(0.0, LEFT), np.zeros(poses))
    assert caught.value.hint == "give one row of ranges and one pose per sweep, one column per sonar"


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_a_pose_that_is_not_finite_is_refused(value):
    with pytest.raises(GridError, match="sweep at a pose that is not finite") as caught:
        sweeps([[1.0]], ring(0.0), [[0.0, value, 0.0]])
    assert caught.value.hint == "leave out sweeps without a pose"
