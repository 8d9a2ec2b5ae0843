"""Rings of sonars: those shipped, those of a user, and those that cannot be."""

import math

import numpy as np
import pytest

from glassslam.errors import ConfigError, UsageError
from glassslam.sources.rings import load_ring, ring_names


def degrees(ring):
    return np.degrees(ring.poses[:, 2]).round(9).tolist()


PIONEER = [90, 50, 30, 10, -10, -30, -50, -90, -90, -130, -150, -170, 170, 150, 130, 90]


def test_shipped_rings():
    assert ring_names() == ("pioneer-2dx", "pioneer-3dx", "turtlebot-9")


@pytest.mark.parametrize("name", ["pioneer-2dx", "pioneer-3dx"])
def test_pioneers_have_two_arrays_of_eight(name):
    ring = load_ring(name)
    assert degrees(ring) == PIONEER
    assert (ring.name, ring.range_max) == (name, 5.0)
    # left and right mirror each other, and every sonar looks away from the middle of the robot
    mirrored = ring.poses[[7, 6, 5, 4, 3, 2, 1, 0, 15, 14, 13, 12, 11, 10, 9, 8]] * [1, -1, 1]
    np.testing.assert_allclose(mirrored[:, :2], ring.poses[:, :2])
    outward = ring.poses[:, 0] * np.cos(ring.poses[:, 2]) + ring.poses[:, 1] * np.sin(ring.poses[:, 2])
    assert outward.min() > 0.1


def test_the_nine_sonars_of_the_turtlebot():
    ring = load_ring("turtlebot-9")
    assert degrees(ring) == [-80, -60, -40, -20, 0, 20, 40, 60, 80]
    assert ring.range_max == 3.0


def test_a_ring_of_a_user(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text("field_of_view_deg: 20\nrange_max: 4\nsonars: [[0.1, 0.2, 90], [0.1, -0.2, -90]]\n")
    ring = load_ring(path)
    assert (ring.name, ring.range_min, ring.range_max) == ("mine", 0.0, 4.0)
    assert ring.field_of_view == pytest.approx(math.radians(20))
    np.testing.assert_allclose(ring.poses, [[0.1, 0.2, math.pi / 2], [0.1, -0.2, -math.pi / 2]])


@pytest.mark.parametrize(
    ("name", "hint"),
    [
        ("pionier-3dx", "did you mean 'pioneer-3dx'?"),
        ("zzz", "known are pioneer-2dx, pioneer-3dx, turtlebot-9, or name a YAML file"),
    ],
)
def test_an_unknown_ring(name, hint):
    with pytest.raises(UsageError, match=f"unknown sonar ring '{name}'") as caught:
        load_ring(name)
    assert (caught.value.hint, caught.value.exit_code) == (hint, 2)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("field_of_view_deg: 20\nrange_max: 4\nsonars: []\n", "sonars"),
        ("field_of_view_deg: 20\nrange_max: 4\nsonars: [[0, 0]]\n", "sonars"),
        ("field_of_view_deg: 20\nrange_max: .inf\nsonars: [[0, 0, 0]]\n", "range_max"),
        ("field_of_view_deg: 0\nrange_max: 4\nsonars: [[0, 0, 0]]\n", "field_of_view_deg"),
        (
            "field_of_view_deg: 9\nrange_min: 5\nrange_max: 4\nsonars: [[0, 0, 0]]\n",
            "range_min must be below range_max",
        ),
        ("field_of_view: 20\nrange_max: 4\nsonars: [[0, 0, 0]]\n", "unknown name 'field_of_view'|required"),
        ("- 1\n", "expected a mapping"),
    ],
)
def test_a_file_that_describes_no_ring(tmp_path, content, message):
    path = tmp_path / "mine.yaml"
    path.write_text(content)
    with pytest.raises(ConfigError, match=message) as caught:
        load_ring(path)
    assert str(path) in caught.value.message


def test_a_missing_file():
    with pytest.raises(ConfigError, match=r"cannot read nowhere\.yaml: No such file"):
        load_ring("nowhere.yaml")
