"""ATE and RPE, against their meaning and against evo."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glassslam.errors import EvaluationError
from glassslam.evaluation import absolute_trajectory_error, align, associate, relative_pose_error
from glassslam.geometry import compose
from glassslam.outputs import write_tum
from glassslam.records import Trajectory


def wander(count, seed, noise=0.0):
    rng = np.random.default_rng(seed)
    heading = np.cumsum(rng.normal(0, 0.2, count))
    steps = 0.1 * np.column_stack((np.cos(heading), np.sin(heading)))
    poses = np.column_stack((np.cumsum(steps, axis=0), heading))
    return poses + np.random.default_rng(seed + 1).normal(0, noise, poses.shape) if noise else poses


@pytest.fixture
def pair():
    stamps = 1e9 + 0.1 * np.arange(200)
    moved = compose(np.array([3.0, -2.0, 2.5]), wander(200, 5, noise=0.05))
    return Trajectory(stamps[:180] + 0.004, moved[:180]), Trajectory(stamps, wander(200, 5))


def test_a_moved_trajectory_has_no_absolute_error():
    truth = Trajectory(np.arange(50.0), wander(50, 1))
    moved = Trajectory(truth.stamps, compose(np.array([10.0, 20.0, 3.0]), truth.poses))
    errors = absolute_trajectory_error(moved, truth)
    assert errors.count == 50
    assert errors.translation.max < 1e-12
    assert errors.rotation.max < 1e-10


@given(st.floats(-100, 100), st.floats(-100, 100), st.floats(-3.1, 3.1), st.integers(0, 1000))
def test_alignment_finds_the_motion(x, y, theta, seed):
    poses = wander(20, seed)
    motion = np.array([x, y, theta])
    np.testing.assert_allclose(align(poses, compose(motion, poses)), motion, atol=1e-8)


def test_a_robot_that_stands_still_is_aligned_without_turning():
    poses = np.tile([1.0, 2.0, 0.5], (4, 1))
    np.testing.assert_allclose(align(poses, poses + np.array([1.0, 1.0, 0.0])), [1.0, 1.0, 0.0])


def test_relative_error_sees_a_single_jump_once():
    truth = Trajectory(np.arange(6.0), np.column_stack((np.arange(6.0), np.zeros((6, 2)))))
    jumped = truth.poses.copy()
    jumped[3:, 1] += 0.5
    errors = relative_pose_error(Trajectory(truth.stamps, jumped), truth)
    assert errors.count == 5
    assert errors.translation.max == pytest.approx(0.5)
    assert errors.translation.mean == pytest.approx(0.1)


def test_steps_of_metres_follow_the_reference():
    truth = Trajectory(np.arange(9.0), np.column_stack((0.5 * np.arange(9), np.zeros((9, 2)))))
    stretched = Trajectory(truth.stamps, truth.poses * [1.1, 1.0, 1.0])
    errors = relative_pose_error(stretched, truth, step=2.0, unit="metres")
    assert errors.count == 2
    assert errors.translation.mean == pytest.approx(0.2)


def test_poses_are_paired_with_the_nearest_in_time_whatever_their_order():
    estimate = Trajectory(np.array([5.0, 1.001, 3.0]), np.array([[5.0, 0, 0], [1, 0, 0], [3, 0, 0]]))
    reference = Trajectory(
        np.array([3.004, 1.0, 4.9, 9.0]), np.array([[30.0, 0, 0], [10, 0, 0], [49, 0, 0], [90, 0, 0]])
    )
    own, other = associate(estimate, reference)
    np.testing.assert_array_equal(own[:, 0], [1, 3])
    np.testing.assert_array_equal(other[:, 0], [10, 30])
    other, own = associate(reference, estimate)
    np.testing.assert_array_equal(own[:, 0], [1, 3])
    np.testing.assert_array_equal(other[:, 0], [10, 30])


def test_a_reference_of_another_time_is_refused():
    with pytest.raises(EvaluationError, match=r"no pose of the trajectory is within 0\.01 s") as caught:
        absolute_trajectory_error(
            Trajectory(np.array([1.0]), np.zeros((1, 3))), Trajectory(np.array([5.0]), np.zeros((1, 3)))
        )
    assert caught.value.hint == "the trajectory spans 1.000 to 1.000 s, the reference 5.000 to 5.000 s"


def test_a_trajectory_shorter_than_a_step_is_refused():
    truth = Trajectory(np.arange(3.0), wander(3, 0))
    with pytest.raises(EvaluationError, match="shorter than one step of 10 metres"):
        relative_pose_error(truth, truth, step=10, unit="metres")


def evo_pair(pair, folder, evo_align):
    from evo.core import sync
    from evo.tools import file_interface

    estimate, reference = pair
    write_tum(estimate, folder / "estimate.tum")
    write_tum(reference, folder / "reference.tum")
    true = file_interface.read_tum_trajectory_file(str(folder / "reference.tum"))
    estimated = file_interface.read_tum_trajectory_file(str(folder / "estimate.tum"))
    true, estimated = sync.associate_trajectories(true, estimated, max_diff=0.01)
    if evo_align:
        estimated.align(true)
    return true, estimated


def same_statistics(summary, metric):
    expected = metric.get_all_statistics()
    for name in ("rmse", "mean", "median", "std", "min", "max"):
        assert getattr(summary, name) == pytest.approx(expected[name], abs=1e-6), name


def test_absolute_error_agrees_with_evo(pair, tmp_path):
    from evo.core import metrics

    errors = absolute_trajectory_error(*pair)
    for summary, relation in (
        (errors.translation, metrics.PoseRelation.translation_part),
        (errors.rotation, metrics.PoseRelation.rotation_angle_deg),
    ):
        metric = metrics.APE(relation)
        metric.process_data(evo_pair(pair, tmp_path, evo_align=True))
        same_statistics(summary, metric)
        assert errors.count == len(metric.error) == 180


@pytest.mark.parametrize(("step", "unit"), [(1, "poses"), (7, "poses"), (0.95, "metres")])
def test_relative_error_agrees_with_evo(pair, tmp_path, step, unit):
    from evo.core import metrics

    errors = relative_pose_error(*pair, step=step, unit=unit)
    evo_unit = metrics.Unit.frames if unit == "poses" else metrics.Unit.meters
    for summary, relation in (
        (errors.translation, metrics.PoseRelation.translation_part),
        (errors.rotation, metrics.PoseRelation.rotation_angle_deg),
    ):
        metric = metrics.RPE(relation, delta=step, delta_unit=evo_unit, pairs_from_reference=True)
        metric.process_data(evo_pair(pair, tmp_path, evo_align=False))
        same_statistics(summary, metric)
        assert errors.count == len(metric.error)
