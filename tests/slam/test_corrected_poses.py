"""Every scan carried along with the nodes around it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from glassslam.geometry import between, compose, wrap_angle
from glassslam.slam.trajectory import corrected_poses

number = st.floats(-20.0, 20.0)


@st.composite
def runs(draw):
    """Local poses of some scans and which of them are nodes, the first always."""
    count = draw(st.integers(1, 25))
    poses = draw(arrays(np.float64, (count, 3), elements=number))
    others = draw(st.sets(st.integers(0, count - 1)))
    return poses, np.array(sorted({0} | others))


def assert_same(actual, expected, atol=1e-9):
    np.testing.assert_allclose(actual[:, :2], expected[:, :2], atol=atol)
    np.testing.assert_allclose(wrap_angle(actual[:, 2] - expected[:, 2]), 0.0, atol=atol)


@given(runs(), st.data())
def test_nodes_get_their_optimised_poses(run, data):
    poses, scans = run
    moved = data.draw(arrays(np.float64, (len(scans), 3), elements=number))
    assert_same(corrected_poses(poses, scans, poses[scans], moved)[scans], moved)


@given(runs())
def test_nodes_that_stay_leave_the_trajectory_as_it_is(run):
    poses, scans = run
    assert_same(corrected_poses(poses, scans, poses[scans], poses[scans]), poses)


@given(runs(), arrays(np.float64, 3, elements=number))
def test_a_rigid_motion_of_the_nodes_moves_everything_rigidly(run, motion):
    poses, scans = run
    moved = corrected_poses(poses, scans, poses[scans], compose(motion, poses[scans]))
    assert_same(moved, compose(motion, poses), atol=1e-8)


def test_a_correction_grows_along_the_way_driven():
    poses = np.array([[0.0, 0, 0], [1.0, 0, 0], [3.0, 0, 0], [4.0, 0, 0]])
    scans = np.array([0, 3])
    moved = np.array([[0.0, 0, 0], [4.0, 0.8, 0]])
    actual = corrected_poses(poses, scans, poses[scans], moved)
    np.testing.assert_allclose(actual[:, 1], [0.0, 0.2, 0.6, 0.8], atol=1e-8)


def test_scans_after_the_last_node_follow_it():
    poses = np.array([[0.0, 0, 0], [1.0, 0, 0], [2.0, 0, 0.1]])
    scans, moved = np.array([0]), np.array([[5.0, 5.0, np.pi / 2]])
    actual = corrected_poses(poses, scans, poses[scans], moved)
    assert_same(actual, compose(moved, between(poses[:1], poses)))


def test_a_robot_that_stands_between_nodes_is_no_division_by_zero():
    poses = np.zeros((4, 3))
    moved = np.array([[0.0, 0, 0], [0.2, 0, 0]])
    actual = corrected_poses(poses, np.array([0, 3]), poses[[0, 3]], moved)
    assert np.isfinite(actual).all()
    np.testing.assert_allclose(actual[-1], moved[-1], atol=1e-8)


@pytest.mark.parametrize("count", [0, 3])
def test_without_nodes_the_poses_are_copied(count):
    poses = np.arange(3.0 * count).reshape(count, 3)
    nothing = np.empty((0, 3))
    actual = corrected_poses(poses, np.empty(0, dtype=np.int64), nothing, nothing)
    np.testing.assert_array_equal(actual, poses)
    assert actual is not poses


def test_scans_before_a_break_go_along_with_the_nodes_before_it_only():
    local = np.array([[0.1 * k, 0.0, 0.0] for k in range(6)])
    scans, begins = np.array([0, 1, 4]), np.array([False, False, True])
    moved = local[scans] + np.array([[0, 0, 0], [0, 0, 0], [5.0, 7.0, 0]])
    poses = corrected_poses(local, scans, local[scans], moved, begins)
    assert_same(poses[:4], local[:4])
    assert_same(poses[4:], local[4:] + np.array([5.0, 7.0, 0.0]))
