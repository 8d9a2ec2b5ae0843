"""Beams made ready: returns, silent beams, motion within the sweep, thinning."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from glassslam.config import SensorConfig
from glassslam.geometry import compose, inverse, transform_points
from glassslam.records import LaserScan
from glassslam.slam.range_data import prepare, thin, thin_adaptively
from glassslam.slam.range_kernels import voxel_filter

STILL = np.zeros(3)
CENTRED = np.zeros(3)
CONFIG = SensorConfig(min_range=0.3, max_range=8.0, missing_data_ray_length=5.0)


def scan(ranges, increment=0.1, time_increment=0.0, angle_min=-0.2, range_max=10.0):
    return LaserScan(7.0, np.array(ranges, np.float32), angle_min, increment, 0.1, range_max, time_increment)


def one_beam(reading, config=CONFIG, range_max=10.0):
    """What a single beam along x says: ("hit" or "free", length), or None."""
    data = prepare(scan([reading], angle_min=0.0, range_max=range_max), CENTRED, STILL, config)
    assert len(data.returns) + len(data.free_ends) <= 1
    if len(data.returns):
        return "hit", pytest.approx(float(data.returns[0, 0]))
    return ("free", pytest.approx(float(data.free_ends[0, 0]))) if len(data.free_ends) else None


@pytest.mark.parametrize(
    ("reading", "meaning"),
    [
        (2.5, ("hit", 2.5)),
        (0.31, ("hit", 0.31)),
        (7.99, ("hit", 7.99)),
        (math.inf, ("free", 5.0)),
        (10.0, ("free", 5.0)),
        (81.83, ("free", 5.0)),
        (9.0, ("free", 5.0)),  # an echo, but beyond what is trusted
        (math.nan, None),
        (-math.inf, None),
        (0.0, None),
        (-0.0, None),
        (-1.0, None),
        (0.05, None),  # nearer than the sensor sees
        (0.2, None),  # nearer than is trusted
    ],
)
def test_what_a_reading_means(reading, meaning):
    assert one_beam(reading) == meaning


def test_a_far_echo_clears_no_farther_than_itself():
    near_sighted = SensorConfig(max_range=2.0, missing_data_ray_length=5.0)
    assert one_beam(3.0, near_sighted) == ("free", 3.0)
    assert one_beam(6.0, near_sighted) == ("free", 5.0)


@pytest.mark.parametrize("silence", [math.inf, 3.5, 65.0])
def test_a_silent_beam_clears_no_farther_than_the_sensor_sees(silence):
    assert one_beam(silence, range_max=3.5) == ("free", 3.5)


@pytest.mark.parametrize("reading", [math.inf, 10.0, 9.0])
def test_without_ray_length_a_silent_beam_says_nothing(reading):
    assert one_beam(reading, SensorConfig(max_range=8.0, missing_data_ray_length=0.0)) is None


def test_the_limits_of_the_sensor_apply_as_well():
    trusting = SensorConfig(min_range=0.0, max_range=1e9)
    assert one_beam(0.05, trusting) is None
    assert one_beam(9.99, trusting) == ("hit", 9.99)
    assert one_beam(10.01, trusting) == ("free", 5.0)


def test_beams_are_laid_out_from_the_first_angle_in_the_frame_of_the_base():
    laser = np.array([0.2, -0.1, math.pi / 2])
    data = prepare(scan([1.0, math.inf, 2.0], increment=math.pi / 2, angle_min=0.0), laser, STILL, CONFIG)
    np.testing.assert_allclose(data.returns, [[0.2, 0.9], [0.2, -2.1]], atol=1e-7)
    np.testing.assert_allclose(data.free_ends, [[-4.8, -0.1]], atol=1e-7)
    assert data.sensor.tolist() == [0.2, -0.1]
    assert data.stamp == 7.0


def test_a_scan_without_beams_or_without_valid_ones_is_empty():
    for ranges in ([], [math.nan, 0.0, -1.0]):
        data = prepare(scan(ranges), CENTRED, STILL, CONFIG)
        assert data.returns.shape == (0, 2)
        assert data.free_ends.shape == (0, 2)


readings = st.one_of(
    st.floats(0.0, 12.0, width=32), st.sampled_from([math.nan, math.inf, -math.inf, 0.0, -2.0, 81.83])
)
poses = st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(-3, 3)).map(np.array)


@given(st.lists(readings, max_size=40), poses, st.floats(-0.1, 0.1), st.floats(-3, 3))
def test_every_beam_goes_where_a_loop_over_beams_puts_it(ranges, laser, increment, angle_min):
    data = prepare(scan(ranges, increment, angle_min=angle_min), laser, STILL, CONFIG)
    returns, free = [], []
    for k, r in enumerate(np.array(ranges, np.float32).astype(float)):
        if math.isnan(r) or r <= 0 or r < 0.3:
            continue
        length = r if r < 8.0 else 5.0
        angle = angle_min + k * increment
        end = transform_points(laser, length * np.array([[math.cos(angle), math.sin(angle)]]))[0]
        (returns if r < 8.0 else free).append(end)
    np.testing.assert_allclose(data.returns, np.reshape(returns, (-1, 2)), atol=1e-9)
    np.testing.assert_allclose(data.free_ends, np.reshape(free, (-1, 2)), atol=1e-9)


def driven(twist, seconds, steps=4000):
    """Pose after a constant twist of the base, integrated in small steps."""
    small = np.asarray(twist) * seconds / steps
    pose = np.zeros(3)
    for _ in range(steps):
        pose = compose(
            pose, compose(compose(np.zeros(3), [*(small[:2] / 2), 0]), [*(small[:2] / 2), small[2]])
        )
    return pose


@pytest.mark.parametrize("twist", [[1.0, 0.0, 0.0], [0.0, 0.0, 2.0], [0.8, -0.3, 1.5], [0.5, 0.1, -0.7]])
def test_a_robot_in_motion_sees_the_same_walls_as_one_at_rest(twist):
    laser, beams, dt = np.array([0.2, 0.1, 0.3]), 9, 0.05
    rng = np.random.default_rng(3)
    world = rng.uniform(1.0, 4.0, (beams, 1)) * np.stack(
        (np.cos(0.4 * np.arange(beams)), np.sin(0.4 * np.arange(beams))), axis=1
    )
    angles, ranges = [], []
    for k, point in enumerate(world):
        from_laser = transform_points(inverse(compose(driven(twist, k * dt), laser)), point[None])[0]
        angles.append(math.atan2(from_laser[1], from_laser[0]))
        ranges.append(math.hypot(*from_laser))
    for k in range(beams):
        # only beam k of a sweep whose beam k points at the point
        sweep = np.full(beams, np.nan)
        sweep[k] = ranges[k]
        moving = scan(sweep, 0.1, dt, angles[k] - 0.1 * k)
        data = prepare(moving, laser, np.array(twist), CONFIG)
        np.testing.assert_allclose(data.returns[0], world[k], atol=2e-4)


def test_silent_beams_are_moved_as_well():
    data = prepare(scan([math.inf] * 3, 0.0, 0.5, 0.0), CENTRED, np.array([1.0, 0.0, 0.0]), CONFIG)
    np.testing.assert_allclose(data.free_ends, [[5.0, 0.0], [5.5, 0.0], [6.0, 0.0]])


def test_without_time_between_beams_motion_does_not_matter():
    data = prepare(scan([1.0, 2.0]), CENTRED, np.array([5.0, 1.0, 2.0]), CONFIG)
    still = prepare(scan([1.0, 2.0]), CENTRED, STILL, CONFIG)
    np.testing.assert_array_equal(data.returns, still.returns)


coordinates = st.one_of(st.floats(-30, 30), st.integers(-30, 30).map(float))
clouds = st.integers(0, 60).flatmap(lambda n: arrays(np.float64, (n, 2), elements=coordinates))


def first_of_every_voxel(points, edge):
    first = {}
    for k, (x, y) in enumerate(points):
        first.setdefault((math.floor(x / edge), math.floor(y / edge)), k)
    return sorted(first.values())


@given(clouds, st.sampled_from([0.05, 0.3, 1.0, 7.0]))
def test_the_voxel_filter_keeps_the_first_point_of_every_voxel(points, edge):
    kept = voxel_filter(points, edge)
    assert kept.tolist() == first_of_every_voxel(points, edge)
    np.testing.assert_array_equal(thin(points, edge), points[kept])


def test_voxels_that_collide_in_the_table_stay_apart():
    k = np.arange(4000.0)
    points = np.stack((k % 64, k // 64), axis=1) * 64.0 + 0.5
    assert len(voxel_filter(points, 1.0)) == len(points)


@pytest.mark.parametrize("edge", [0.0, -1.0])
def test_without_an_edge_nothing_is_thinned(edge):
    points = np.zeros((5, 2))
    assert thin(points, edge) is points


def test_thinning_no_points():
    assert thin(np.empty((0, 2)), 0.1).shape == (0, 2)
    assert thin_adaptively(np.empty((0, 2)), 0.5, 10).shape == (0, 2)


@given(clouds, st.integers(1, 40), st.sampled_from([0.2, 1.0, 10.0]))
def test_adaptive_thinning_leaves_enough_of_the_points_in_order(points, least, edge):
    kept = thin_adaptively(points, edge, least)
    assert len(kept) >= min(least, len(points))
    rest = iter(points.tolist())
    assert all(row in rest for row in kept.tolist())  # a subsequence: each is found after the one before


def wall(count):
    return np.stack((np.linspace(0.0, 10.0, count), np.ones(count)), axis=1)


def test_adaptive_thinning_stops_at_the_largest_edge():
    np.testing.assert_array_equal(thin_adaptively(wall(500), 0.5, 10), thin(wall(500), 0.5))


def test_adaptive_thinning_takes_about_the_coarsest_edge_that_leaves_enough():
    kept = thin_adaptively(wall(2000), 0.5, 100)
    assert 100 <= len(kept) <= 112  # an edge of 0.1 m, to a tenth


def test_few_points_are_all_kept():
    points = wall(90)
    assert thin_adaptively(points, 0.5, 100) is points


def test_points_in_one_heap_cannot_be_thinned_to_the_least_number():
    heap = np.random.default_rng(0).uniform(0, 1e-6, (200, 2))
    assert thin_adaptively(heap, 0.5, 100) is heap
