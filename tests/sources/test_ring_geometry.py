"""The sonars behind a cloud of one point per sonar."""

import numpy as np
import pytest

from glassslam.sources.ringgeometry import ring_behind, ring_ranges
from glassslam.sources.rings import load_ring

RNG = np.random.default_rng(7)


def clouds_of(poses, ranges):
    """What a driver publishes: end points of all sonars, in the frame of the base."""
    axes = np.stack([np.cos(poses[:, 2]), np.sin(poses[:, 2])], axis=1)
    points = poses[:, :2] + ranges[..., None] * axes
    return np.concatenate([points, np.zeros((*ranges.shape, 1))], axis=-1).astype(np.float32)


@pytest.mark.parametrize("name", ["pioneer-3dx", "pioneer-2dx", "turtlebot-9"])
def test_a_shipped_ring_is_recognised(name):
    ring = load_ring(name)
    found = ring_behind(clouds_of(ring.poses, RNG.uniform(0.3, 4.5, (40, len(ring.poses)))))
    assert found is not None
    assert found.name == name


def test_ranges_are_those_that_made_the_points():
    poses = load_ring("pioneer-3dx").poses
    ranges = RNG.uniform(0.2, 5.0, 16).round(3)
    found = ring_ranges(clouds_of(poses, ranges), poses)
    np.testing.assert_allclose(found, ranges, atol=1e-6)
    np.testing.assert_array_equal(ring_ranges(clouds_of(poses, np.full(16, 5.0)), poses), np.full(16, 5.0))


def test_an_unknown_ring_keeps_its_end_points():
    poses = np.array([[0.1, 0.2, 0.5], [0.3, -0.1, -1.0], [-0.2, 0.0, 3.0]])
    ranges = np.minimum(RNG.uniform(0.3, 6.0, (60, 3)), 4.0)
    clouds = clouds_of(poses, ranges)
    found = ring_behind(clouds)
    assert found is not None
    assert found.range_max == pytest.approx(4.0, abs=0.4)
    np.testing.assert_allclose(found.poses[:, 2], poses[:, 2], atol=1e-3)
    again = clouds_of(found.poses, np.array([ring_ranges(cloud, found.poses) for cloud in clouds]))
    np.testing.assert_allclose(again, clouds, atol=1e-3)


def test_a_sonar_that_hears_nothing_looks_where_its_point_is():
    ranges = np.full((30, 2), 3.0)
    ranges[:, 1] = RNG.uniform(1.0, 3.0, 30)
    found = ring_behind(clouds_of(np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]), ranges))
    assert found is not None
    np.testing.assert_allclose(found.poses[:, 2], [1.0, -1.0], atol=1e-6)


@pytest.mark.parametrize(("count", "spread"), [(30, 0.0), (9, 1.0)])
def test_too_still_or_too_few_to_tell(count, spread):
    """A few still points may as well be those of a 3D sensor."""
    ranges = 2.0 + spread * RNG.uniform(0.0, 1.0, (count, 2))
    assert ring_behind(clouds_of(np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]), ranges)) is None


def test_points_anywhere_are_no_ring():
    assert ring_behind(RNG.uniform(-3, 3, (30, 4, 3)).astype(np.float32)) is None


def test_points_of_several_heights_are_no_ring():
    clouds = clouds_of(load_ring("turtlebot-9").poses, RNG.uniform(0.3, 2.5, (30, 9)))
    clouds[..., 2] = RNG.uniform(-1, 1, (30, 9))
    assert ring_behind(clouds) is None


def test_points_that_are_not_finite():
    ring = load_ring("pioneer-3dx")
    clouds = clouds_of(ring.poses, RNG.uniform(0.3, 4.5, (40, 16)))
    clouds[::3, 5] = np.nan
    clouds[1, 2, 0] = np.inf
    found = ring_behind(clouds)
    assert found is not None
    assert found.name == "pioneer-3dx"
    assert np.isnan(ring_ranges(clouds[0], ring.poses)[5])
    assert np.isnan(ring_ranges(clouds[1], ring.poses)[2])
    assert ring_behind(np.full((5, 3, 3), np.nan, dtype=np.float32)) is None
