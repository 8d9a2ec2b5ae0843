"""Sonars that come as point clouds: rings of one point per sonar, and 3D sensors."""

import math

import numpy as np
import pytest
from tiny_bags import T0, odom, scan, tf
from tiny_sonar import cloud, cloud2, echoes, only, ranges_of

from glassslam.errors import UsageError
from glassslam.records import PointSet, RangeRing
from glassslam.sources.ringgeometry import ring_ranges
from glassslam.sources.rings import load_ring

RNG = np.random.default_rng(3)
NAN = math.nan


def sweeps(poses, count=30, far=5.0):
    """Ranges of a robot that drives about, and the end points a driver makes of them."""
    ranges = np.minimum(RNG.uniform(0.4, 1.2 * far, (count, len(poses))), far).round(3)
    axes = np.stack([np.cos(poses[:, 2]), np.sin(poses[:, 2])], axis=1)
    points = poses[:, :2] + ranges[..., None] * axes
    return ranges, np.concatenate([points, np.full((*ranges.shape, 1), 0.2)], axis=-1)


@pytest.mark.parametrize("make", [cloud, cloud2])
def test_the_cloud_of_a_pioneer(any_bag, make):
    ranges, points = sweeps(load_ring("pioneer-3dx").poses)
    recording = any_bag(
        odom(0.0), scan(0.0), *(make(k / 10, p, topic="/RosAria/sonar") for k, p in enumerate(points))
    )
    assert recording.info.sonar_ring.name == "pioneer-3dx"
    assert recording.info.sonar_topics == ("/RosAria/sonar",)
    expected = np.where(ranges >= 5.0, math.inf, ranges)
    np.testing.assert_allclose(ranges_of(recording), expected, atol=1e-3)
    assert only(recording, RangeRing)[3].stamp == pytest.approx(T0 + 0.3)


def test_a_cloud_in_a_frame_of_its_own(ros1):
    poses = load_ring("turtlebot-9").poses
    _, points = sweeps(poses, far=3.0)
    mount = tf(0.0, "base_link", "ring", (0.5, 0.0, 0.0), (0.0, 0.0, math.pi), topic="/tf_static")
    recording = ros1(
        mount, odom(0.0), scan(0.0), *(cloud(k / 10, p, frame="ring") for k, p in enumerate(points))
    )
    ring = recording.info.sonar_ring
    assert ring.name == ""
    np.testing.assert_allclose(np.cos(ring.poses[:, 2]), -np.cos(poses[:, 2]), atol=1e-3)
    # the end points are exact, wherever on its axis a sonar is taken to sit
    ends = np.array([[0.5 - x, -y] for x, y, _ in points[4]])
    readings = only(recording, RangeRing)[4].ranges
    heard = np.isfinite(readings)
    axes = np.stack([np.cos(ring.poses[:, 2]), np.sin(ring.poses[:, 2])], axis=1)
    np.testing.assert_allclose((ring.poses[:, :2] + readings[:, None] * axes)[heard], ends[heard], atol=2e-3)


def test_the_transform_of_a_described_ring_is_applied(ros1):
    ring = load_ring("pioneer-2dx")
    ranges, points = sweeps(ring.poses)
    mount = tf(0.0, "base_link", "ring", (0.0, 0.0, 0.1), (0.0, 0.0, math.pi / 2), topic="/tf_static")
    turned = np.stack([points[..., 1], -points[..., 0], points[..., 2]], axis=-1)
    clouds = [cloud(k / 10, p, frame="ring") for k, p in enumerate(turned)]
    recording = ros1(mount, odom(0.0), scan(0.0), *clouds, sonar_ring="pioneer-2dx")
    expected = np.where(ranges >= 5.0, math.inf, ranges)
    np.testing.assert_allclose(ranges_of(recording), expected, atol=1e-3)


def test_a_cloud_of_another_size_is_counted(ros1):
    _, points = sweeps(load_ring("pioneer-3dx").poses)
    clouds = [cloud(k / 10, p) for k, p in enumerate(points)]
    recording = ros1(
        odom(0.0),
        scan(0.0),
        *clouds,
        cloud(9.0, points[0][:5]),
        sonar_ring="pioneer-3dx",
        sonar_topic="/sonar",
    )
    assert len(ranges_of(recording)) == 30
    assert recording.dropped == {"sonar message with another number of readings than the ring has": 1}


def test_a_ring_of_another_size_than_the_cloud(ros1):
    _, points = sweeps(load_ring("pioneer-3dx").poses)
    clouds = [cloud(k / 10, p) for k, p in enumerate(points)]
    with pytest.raises(
        UsageError, match="the ring turtlebot-9 has 9 sonars, /sonar sends 16 ranges"
    ) as caught:
        ros1(odom(0.0), scan(0.0), *clouds, sonar_topic="/sonar", sonar_ring="turtlebot-9")
    assert caught.value.hint == "choose another ring with --sonar-ring"


def test_two_rings_ask(ros1):
    _, points = sweeps(load_ring("pioneer-3dx").poses)
    twice = [
        make(k / 10, p, topic=name)
        for k, p in enumerate(points)
        for make, name in ((cloud, "/a"), (cloud2, "/b"))
    ]
    recording = ros1(odom(0.0), scan(0.0), *twice)
    assert recording.info.sonar_ring is None
    assert recording.warnings[-1].startswith("sonar is not used: several sonar topics: /a")
    assert ros1(odom(0.0), scan(0.0), *twice, sonar_topic="/b").info.sonar_topics == ("/b",)


@pytest.mark.parametrize(("number", "padding"), [("<f4", 0), ("<f8", 0), (">f4", 0), (">f8", 5)])
def test_points_of_a_3d_sensor(any_bag, number, padding):
    mount = tf(0.0, "base_link", "toposens", (0.5, 0.1, 0.4), (0.0, 0.0, math.pi / 2), topic="/tf_static")
    points = [[[1.0, 2.0, 3.0], [NAN, 0.0, 0.0]], [], [[2.0, 0.0, 0.5]]]
    clouds = [
        cloud2(k / 10, p, frame="toposens", number=number, padding=padding) for k, p in enumerate(points)
    ]
    recording = any_bag(mount, odom(0.0), scan(0.0), *clouds)
    assert (recording.info.sonar_ring, recording.info.sonar_topics) == (None, ("/points",))
    found = only(recording, PointSet)
    assert [len(record.points) for record in found] == [1, 0, 1]
    np.testing.assert_allclose(found[0].points, [[0.5 - 2.0, 0.1 + 1.0, 3.4]], atol=1e-6)
    np.testing.assert_allclose(found[0].origin, [0.5, 0.1, 0.4])
    assert found[2].stamp == pytest.approx(T0 + 0.2)


def test_points_without_a_place_are_seen_from_the_base(ros1):
    recording = ros1(odom(0.0), scan(0.0), echoes(0.1, [[1.0, 0.5, 0.2], [2.0, 0.0, 1.0]]), echoes(0.2, []))
    assert recording.warnings[-1] == (
        "no transform from base_link to toposens: /ts_scans is taken to be seen from the base"
    )
    first, second = only(recording, PointSet)
    np.testing.assert_allclose(first.points, [[1.0, 0.5, 0.2], [2.0, 0.0, 1.0]])
    assert (first.origin.tolist(), len(second.points)) == ([0.0, 0.0, 0.0], 0)


def test_dense_clouds_are_no_sonar(ros1):
    recording = ros1(odom(0.0), scan(0.0), cloud2(0.1, RNG.uniform(-5, 5, (500, 3))))
    assert (recording.info.sonar_topics, recording.warnings[1:]) == ((), [])
    named = ros1(odom(0.0), scan(0.0), cloud2(0.1, RNG.uniform(-5, 5, (500, 3))), sonar_topic="/points")
    assert len(only(named, PointSet)[0].points) == 500


@pytest.mark.parametrize(("names", "number"), [("xyw", "<f4"), ("xyz", "<i4")])
def test_clouds_without_coordinates_are_counted(ros1, names, number):
    bad = [cloud2(1.0 + k / 10, [[1.0, 1.0, 1.0]], names=names, number=number) for k in range(2)]
    recording = ros1(
        odom(0.0), scan(0.0), cloud2(0.1, [[1.0, 2.0, 3.0]]), cloud2(0.2, [[1.0, 2.0, 0.0]]), *bad
    )
    assert len(only(recording, PointSet)) == 2
    assert recording.dropped == {"point cloud without x, y and z as numbers": 2}


def test_ring_ranges_of_nothing():
    assert ring_ranges(np.empty((0, 3), dtype=np.float32), np.empty((0, 3))).shape == (0,)
