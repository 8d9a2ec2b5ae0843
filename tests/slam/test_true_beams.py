"""Errors of the beams taken out of scans and of the glass found in them."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from detectors.detection import Detection
from glassslam.config import Config, SensorConfig
from glassslam.errors import ConfigError
from glassslam.geometry import transform_points
from glassslam.records import LaserScan
from glassslam.slam.beam_errors import errors_of, true_detection, true_points
from glassslam.slam.range_data import prepare

STILL = np.zeros(3)
SMALL = st.floats(-0.1, 0.1)


def scan(ranges, angle_min=-1.0, increment=0.25, range_max=10.0):
    return LaserScan(7.0, np.array(ranges, np.float32), angle_min, increment, 0.1, range_max)


def erring(**errors):
    return SensorConfig(**errors)


def pane(bearing, normal, distance):
    """One piece of glass at a range (m) along a bearing (rad), turned as its normal (rad) says."""
    column = {name: np.array([0.0]) for name in ("strength", "probability", "position_sigma", "normal_sigma")}
    return Detection(
        beam=np.array([3]), range=np.array([distance]), bearing=np.array([bearing]),
        normal=np.array([normal]), incidence=np.array([abs(bearing - normal)]), extent=np.array([0.1]),
        labels=np.zeros(9, dtype=np.uint8), **column,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("errors", "ahead", "left"),
    [
        ({}, (2.0, 0.0), (0.0, 2.0)),
        ({"bearing_cosine": 0.1}, (2 * math.cos(0.1), 2 * math.sin(0.1)), (0.0, 2.0)),
        ({"bearing_sine": 0.1}, (2.0, 0.0), (-2 * math.sin(0.1), 2 * math.cos(0.1))),
        ({"lateral_offset": 0.1}, (2.0, 0.1), (-0.1, 2.0)),
        ({"range_offset": 0.1}, (2.1, 0.0), (0.0, 2.1)),
    ],
)
def test_what_each_error_does_to_a_beam_ahead_and_to_the_left(errors, ahead, left):
    data = prepare(scan([2.0, 2.0], 0.0, math.pi / 2), STILL, STILL, erring(**errors))
    assert data.returns == pytest.approx(np.array([ahead, left]), abs=1e-12)


def test_silent_beams_are_bent_but_not_stretched():
    config = erring(lateral_offset=0.1, range_offset=0.1, bearing_cosine=0.1)
    data = prepare(scan([math.inf], 0.0), STILL, STILL, config)
    assert np.hypot(*data.free_ends[0]) == pytest.approx(math.hypot(5.0, 0.1))
    assert math.atan2(*data.free_ends[0][::-1]) == pytest.approx(0.1 + math.atan2(0.1, 5.0))


def test_what_is_too_near_or_too_far_is_decided_by_what_was_read():
    config = SensorConfig(min_range=1.0, max_range=3.0, range_offset=-0.1)
    data = prepare(scan([0.95, 1.05, 2.95, 3.05]), STILL, STILL, config)
    assert np.hypot(*data.returns.T) == pytest.approx([0.95, 2.85])


def test_a_reading_that_the_offset_eats_up_says_nothing():
    data = prepare(scan([0.15, 0.5]), STILL, STILL, erring(range_offset=-0.2))
    assert len(data.returns) == 1


@given(st.lists(st.floats(0.2, 9.0), min_size=1, max_size=20), SMALL, SMALL, SMALL, SMALL, st.floats(-3, 3))
def test_the_kernel_agrees_with_arrays(ranges, cosine, sine, lateral, offset, yaw):
    config = SensorConfig(
        bearing_cosine=cosine, bearing_sine=sine, lateral_offset=lateral, range_offset=offset
    )
    laser = np.array([0.3, -0.2, yaw])
    seen = scan(ranges)
    angles = seen.angle_min + seen.angle_increment * np.arange(len(ranges))
    expected = transform_points(laser, true_points(angles, seen.ranges.astype(np.float64), errors_of(config)))
    assert prepare(seen, laser, STILL, config).returns == pytest.approx(expected, abs=1e-9)


def test_glass_moves_and_turns_as_the_wall_it_stands_in():
    """A pane at its normal, and the same wall seen through the eyes of its other points."""
    errors = np.array([0.01, 0.004, -0.022, 0.01])
    found = true_detection(pane(1.2, 1.2, 1.5), errors)
    angles = np.linspace(1.15, 1.25, 11)
    wall = true_points(angles, 1.5 / np.cos(angles - 1.2), errors)
    along = np.linalg.svd(wall - wall.mean(axis=0))[2][0]
    assert found.positions[0] == pytest.approx(wall[5], abs=1e-9)
    assert abs(math.cos(found.normal[0]) * along[0] + math.sin(found.normal[0]) * along[1]) < 1e-3
    assert found.incidence[0] == pytest.approx(abs(found.bearing[0] - found.normal[0]))
    assert found.beam.tolist() == [3]


def test_without_errors_a_detection_stays_what_it_is():
    found = pane(0.3, 0.2, 2.0)
    assert true_detection(found, np.zeros(4)) is found


def test_errors_beyond_any_lidar_are_refused():
    with pytest.raises(
        ConfigError, match=r"sensor\.lateral_offset: Input should be less than or equal to 0\.2"
    ):
        Config.from_mapping({"sensor": {"lateral_offset": 22.0}})
