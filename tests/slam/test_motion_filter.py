"""Which scans become nodes."""

import math

import numpy as np
import pytest

from glassslam.config import MotionFilterConfig
from glassslam.slam.motion_filter import MotionFilter

CONFIG = MotionFilterConfig(max_distance=0.2, max_angle_deg=2.0, max_time=5.0)


def admitted(*rows):
    motion_filter = MotionFilter(CONFIG)
    return [motion_filter.admits(stamp, np.array(pose, dtype=np.float64)) for stamp, *pose in rows]


def test_the_first_scan_always_is_one():
    assert admitted((-1e9, 4, 5, 6)) == [True]


@pytest.mark.parametrize(
    "row",
    [(0.1, 0.2, 0.0, 0.0), (0.1, 0.15, 0.15, 0.0), (0.1, 0.0, 0.0, math.radians(-2.001)), (5.0, 0, 0, 0)],
)
def test_enough_travel_turn_or_time_makes_a_node(row):
    assert admitted((0.0, 0, 0, 0), row) == [True, True]


@pytest.mark.parametrize("row", [(4.9, 0.13, 0.13, 0.0), (4.9, 0.0, 0.0, math.radians(1.9))])
def test_less_does_not(row):
    assert admitted((0.0, 0, 0, 0), row) == [True, False]


def test_motion_counts_from_the_last_node_not_the_last_scan():
    rows = [(0.1 * k, 0.09 * k, 0.0, 0.0) for k in range(7)]
    assert admitted(*rows) == [True, False, False, True, False, False, True]


def test_a_turn_across_the_seam_of_angles_is_small():
    assert admitted((0.0, 0, 0, math.pi - 0.01), (0.1, 0, 0, -math.pi + 0.01)) == [True, False]


def test_a_clock_set_back_far_makes_a_node():
    assert admitted((1000.0, 0, 0, 0), (1.0, 0, 0, 0), (1.1, 0, 0, 0)) == [True, True, False]
