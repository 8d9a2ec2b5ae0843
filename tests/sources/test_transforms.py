"""The tree of frames."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glassslam.sources.transforms import TransformTree, is_upside_down, matrix_of, planar, tilt


def shift(x, y=0.0, z=0.0, yaw=0.0):
    matrix = np.eye(4)
    matrix[:2, :2] = [[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]]
    matrix[:3, 3] = x, y, z
    return matrix


def transform(position, quaternion):
    return SimpleNamespace(
        translation=SimpleNamespace(**dict(zip("xyz", position, strict=True))),
        rotation=SimpleNamespace(**dict(zip("xyzw", quaternion, strict=True))),
    )


def tree(*edges):
    out = TransformTree()
    for parent, child, matrix, static in edges:
        out.add(parent, child, matrix, static=static)
    return out


def test_down_up_and_across():
    frames = tree(
        ("base", "mast", shift(0, 0, 1, math.pi / 2), True),
        ("mast", "laser", shift(1), True),
        ("base", "imu", shift(-1), True),
    )
    np.testing.assert_allclose(planar(frames.lookup("base", "laser")), (0.0, 1.0, math.pi / 2), atol=1e-12)
    np.testing.assert_allclose(
        frames.lookup("laser", "base") @ frames.lookup("base", "laser"), np.eye(4), atol=1e-12
    )
    np.testing.assert_allclose(planar(frames.lookup("imu", "laser")), (1.0, 1.0, math.pi / 2), atol=1e-12)


def test_leading_slashes_do_not_matter():
    frames = tree(("base", "laser", shift(1), True))
    np.testing.assert_allclose(frames.lookup("/base", "/laser"), shift(1))


def test_unconnected_frames():
    frames = tree(("a", "b", shift(1), True), ("c", "d", shift(1), True))
    assert frames.lookup("a", "d") is None
    assert frames.lookup("nowhere", "a") is None


def test_a_loop_of_frames_ends():
    frames = tree(("a", "b", shift(1), True), ("b", "a", shift(1), True))
    assert frames.lookup("a", "b") is not None
    assert frames.lookup("a", "c") is None


def test_a_fixed_link_goes_before_a_moving_one():
    frames = tree(("odom", "laser", shift(5), False), ("base", "laser", shift(1), True))
    np.testing.assert_allclose(frames.lookup("base", "laser"), shift(1))


def test_the_first_value_stands_and_a_change_is_noticed():
    frames = tree(("base", "arm", shift(1), False), ("base", "laser", shift(2), False))
    frames.add("base", "laser", shift(2.0000001), static=False)
    assert frames.is_rigid("base", "laser")
    frames.add("base", "arm", shift(1, yaw=0.1), static=False)
    assert not frames.is_rigid("base", "arm")
    np.testing.assert_allclose(frames.lookup("base", "arm"), shift(1))
    assert frames.edges["base", "arm"].count == 2


@pytest.mark.parametrize("quaternion", [(0, 0, 0, 0), (math.nan, 0, 0, 1), (math.inf, 0, 0, 1)])
def test_no_rigid_motion(quaternion):
    assert matrix_of(transform((0, 0, 0), quaternion)) is None


@given(st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: sum(v * v for v in q) > 1e-3))
def test_every_quaternion_gives_a_rotation(quaternion):
    rotation = matrix_of(transform((1, 2, 3), quaternion))[:3, :3]
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(rotation) == pytest.approx(1.0)
    # A rotation of a vector by q is the vector part of q v q*.
    x, y, z, w = np.array(quaternion) / np.linalg.norm(quaternion)
    v, axis = np.array([0.3, -0.5, 0.7]), np.array([x, y, z])
    expected = v + 2 * np.cross(axis, np.cross(axis, v) + w * v)
    np.testing.assert_allclose(rotation @ v, expected, atol=1e-12)


def test_upside_down_and_tilt():
    flipped = matrix_of(transform((0, 0, 0), (1, 0, 0, 0)))
    leaning = matrix_of(transform((0, 0, 0), (math.sin(0.1), 0, 0, math.cos(0.1))))
    assert is_upside_down(flipped)
    assert not is_upside_down(leaning)
    assert tilt(flipped) == pytest.approx(0.0)
    assert tilt(leaning) == pytest.approx(0.2)
