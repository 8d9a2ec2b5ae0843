"""Errors of the beams, told by walls that must be straight."""

import math
from dataclasses import astuple, replace

import numpy as np
import pytest
from crooked_lidar import ANGLES, STEP, walk
from hypothesis import given
from hypothesis import strategies as st

import glassslam as gs
from glassslam.calibration.bearing import BeamErrors, estimate_beam_errors
from glassslam.calibration.straight_walls import wall_points
from glassslam.config import Config
from glassslam.records import LaserScan
from glassslam.slam.beam_errors import errors_of, true_points
from glassslam.sources import open_recording

HALL_WALLS = ((0, -4.0), (0, 5.0), (1, -1.5), (1, 2.0))
"""Axis across each wall, and where on it the wall stands."""


def found(scans):
    return np.array(astuple(estimate_beam_errors(scans))[:4])


@pytest.mark.parametrize(
    "errors",
    [
        (0.0, 0.0, 0.0, 0.0),
        (0.012, 0.0, 0.0, 0.0),
        (0.0, -0.012, 0.0, 0.0),
        (0.0, 0.0, 0.022, 0.0),
        (0.0, 0.0, 0.0, -0.03),
        (0.008, 0.002, -0.023, -0.005),
    ],
)
def test_each_error_is_found_and_told_from_the_others(errors):
    assert found(walk(errors)) == pytest.approx(errors, abs=2e-4)


def test_noise_is_averaged_and_stated():
    errors = np.array([0.008, 0.002, -0.023, -0.005])
    estimate = estimate_beam_errors(walk(errors, noise=0.01))
    off = np.array(astuple(estimate)[:4]) - errors
    assert np.abs(off[:2]).max() < 0.002
    assert np.abs(off[2:]).max() < 0.006
    assert (np.abs(off) < 5.0 * np.array(estimate.sigma)).all()


def test_the_bend_of_the_walls_goes():
    estimate = estimate_beam_errors(walk((0.015, 0.0, 0.0, 0.0)))
    assert estimate.bend_before > 0.003
    assert estimate.bend_after < 1e-4


def test_a_constant_turn_of_all_beams_is_the_business_of_the_mounting():
    scans = [replace(scan, angle_min=0.3) for scan in walk((0.0, 0.0, 0.0, 0.0))]
    assert found(scans) == pytest.approx(np.zeros(4), abs=2e-4)


def test_a_mirrored_lidar_has_the_mirrored_errors():
    scans = [replace(scan, angle_increment=-STEP) for scan in walk((0.01, 0.004, 0.02, 0.0))]
    assert found(scans) == pytest.approx([-0.01, 0.004, -0.02, 0.0], abs=3e-4)


def test_beams_that_see_nothing_or_nonsense_are_passed_over():
    def spoilt(scan):
        ranges = scan.ranges.copy()
        ranges[::7] = np.inf
        ranges[1::7] = np.nan
        ranges[2::7] = 0.0
        ranges[3::7] = scan.range_max
        return replace(scan, ranges=ranges)

    errors = (0.01, 0.0, -0.02, 0.0)
    assert found(spoilt(scan) for scan in walk(errors)) == pytest.approx(errors, abs=1e-3)


def test_people_and_furniture_do_not_count():
    random = np.random.default_rng(5)

    def crowded(scan):
        ranges = scan.ranges.copy()
        hidden = np.repeat(random.random(45) < 0.2, 8)
        return replace(scan, ranges=np.where(hidden, ranges * np.float32(0.7), ranges))

    errors = (0.01, 0.0, -0.02, 0.0)
    assert found(crowded(scan) for scan in walk(errors)) == pytest.approx(errors, abs=2e-3)


@pytest.mark.parametrize("ranges", [np.full(360, np.inf), np.full(360, 0.3), np.full(5, 2.0)])
def test_without_a_wall_there_is_nothing_to_tell(ranges):
    """Silence, a bucket over the lidar, and too few beams."""
    scan = LaserScan(0.0, ranges.astype(np.float32), 0.0, STEP, 0.1, 12.0)
    assert estimate_beam_errors([scan]) is None
    assert estimate_beam_errors([]) is None


def test_a_robot_that_stands_tells_as_much_as_one_scan():
    scan = next(iter(walk((0.01, 0.0, 0.0, 0.0))))
    once, often = estimate_beam_errors([scan]), estimate_beam_errors([scan] * 50)
    assert once == often


def test_one_straight_wall_cannot_tell_everything_and_says_so():
    one_wall = np.where(np.abs(ANGLES - np.pi / 2) < 0.3, 2.0 / np.sin(ANGLES + 1e-12), np.inf)
    scan = LaserScan(0.0, one_wall.astype(np.float32), 0.0, STEP, 0.1, 12.0)
    estimate = estimate_beam_errors([scan])
    assert estimate.walls == 1
    assert max(estimate.sigma) > 0.02


def test_the_configuration_takes_the_estimate_as_it_is():
    estimate = estimate_beam_errors(walk((0.008, 0.002, -0.023, -0.005)))
    sensor = Config.from_mapping({"sensor": estimate.settings}).sensor
    assert errors_of(sensor) == pytest.approx(np.array(astuple(estimate)[:4]))


def test_the_same_scans_give_the_same_estimate():
    first, second = (estimate_beam_errors(walk((0.01, 0.0, 0.0, 0.0), noise=0.01)) for _ in range(2))
    assert isinstance(first, BeamErrors)
    assert first == second


def test_walls_are_found_as_they_stand():
    scan = next(iter(walk((0.0, 0.0, 0.0, 0.0), turning=0.0)))
    points = wall_points([scan], 10.0, 100)
    assert points.walls == 4
    xy = true_points(points.angles, points.ranges, np.zeros(4)) - (3.0, 0.0)
    for wall in np.split(xy, points.starts[1:]):
        # near a corner a few beams of the next wall come along
        distances = [np.quantile(np.abs(wall[:, axis] - at), 0.8) for axis, at in HALL_WALLS]
        assert min(distances) < 1e-3
    assert points.sums(np.ones(len(points.angles))).sum() == len(points.angles) <= 360
    assert len(np.unique(points.angles)) == len(points.angles)


def test_returns_strewn_about_are_no_wall_and_no_warning():
    """Not even the returns that a line was laid through are near it."""
    ranges = np.where(np.arange(40) % 2, 1.0, 9.0).astype(np.float32)
    assert wall_points([LaserScan(0.0, ranges, 0.0, 0.15, 0.1, 12.0)], 10.0, 100).walls == 0


def test_scans_beyond_the_limit_are_spread_over_the_recording():
    scans = list(walk((0.0, 0.0, 0.0, 0.0)))
    assert wall_points(scans, 10.0, 10).walls <= 40
    assert wall_points(scans, 10.0, 10).walls < wall_points(scans, 10.0, 100).walls


@given(
    st.lists(st.floats(0.0, 12.0) | st.sampled_from([math.inf, math.nan, -1.0]), min_size=1, max_size=90),
)
def test_whatever_the_ranges_the_estimate_is_finite_or_absent(ranges):
    scan = LaserScan(0.0, np.array(ranges, np.float32), -1.5, 0.03, 0.1, 12.0)
    estimate = estimate_beam_errors([scan])
    assert estimate is None or np.isfinite([*astuple(estimate)[:4], *estimate.sigma]).all()


def test_the_lidar_of_the_hallway_without_odometry_has_an_eccentric_disc(data_dir):
    """A triangulating lidar: its beams pass the axis by 2 cm, and its bearings err by half a degree."""
    records = open_recording(data_dir / "pimap" / "scene4.bag").records()
    estimate = estimate_beam_errors(r for r in records if isinstance(r, LaserScan))
    assert estimate.walls > 400
    assert 0.005 < estimate.bearing_cosine < 0.010
    assert abs(estimate.bearing_sine) < 0.004
    assert -0.026 < estimate.lateral_offset < -0.019
    assert abs(estimate.range_offset) < 0.01
    assert estimate.bend_after < 0.95 * estimate.bend_before


def reference(path):
    """Stamps (s) and poses of the reference trajectory, one for each scan it was refreshed with."""
    rows = np.loadtxt(path)
    rows = rows[np.append(True, np.diff(rows[:, 3]) != 0)]
    return rows[:, 3] / 1e7 - 62135596800.0, rows[:, 4:7]


def bow(trajectory, stamps, poses):
    """Change of heading against a reference, deg per 27 m along x, and mean distance once aligned, m."""
    x, y = (np.interp(trajectory.stamps, stamps, column) for column in poses.T[:2])
    true_heading = np.interp(trajectory.stamps, stamps, np.unwrap(poses[:, 2]))
    drift = np.unwrap(trajectory.poses[:, 2]) - true_heading
    ours = trajectory.poses[:, 0] + 1j * trajectory.poses[:, 1]
    theirs = x + 1j * y
    ours, theirs = ours - ours.mean(), theirs - theirs.mean()
    turn = np.vdot(ours, theirs)
    distance = np.abs(ours * turn / abs(turn) - theirs).mean()
    return math.degrees(27.0 * np.polyfit(x, drift, 1)[0]), distance


@pytest.mark.slow
def test_the_hallway_comes_out_straight_once_the_beams_are_corrected(data_dir):
    """Without, the map bends by eight degrees."""
    bag = data_dir / "pimap" / "scene4.bag"
    estimate = estimate_beam_errors(r for r in open_recording(bag).records() if isinstance(r, LaserScan))
    result = gs.map_recording(
        bag, Config.from_mapping({"sensor": estimate.settings, "glass": {"detector": "off"}})
    )
    bend, distance = bow(result.trajectory, *reference(bag.with_name("scene4_pose.txt")))
    assert abs(bend) < 2.5
    assert distance < 0.12
