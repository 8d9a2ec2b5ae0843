"""The relation metric."""

import gzip

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glassslam.errors import EvaluationError
from glassslam.evaluation import Relations, evaluate_relations, poses_at, read_relations
from glassslam.records import Trajectory


def matrix(pose):
    c, s = np.cos(pose[2]), np.sin(pose[2])
    return np.array([[c, -s, pose[0]], [s, c, pose[1]], [0.0, 0.0, 1.0]])


def naive_errors(trajectory, relations, cartographer=False):
    """The metric with matrices, one relation after the other, stamps matched exactly."""
    distances, angles = [], []
    for t1, t2, true in zip(relations.first, relations.second, relations.first_from_second, strict=True):
        a, b = (matrix(trajectory.poses[list(trajectory.stamps).index(t)]) for t in (t1, t2))
        estimated = np.linalg.inv(a) @ b
        inverse_true = np.linalg.inv(matrix(true))
        error = estimated @ inverse_true if cartographer else inverse_true @ estimated
        distances.append(np.hypot(error[0, 2], error[1, 2]))
        angles.append(abs(np.degrees(np.arctan2(error[1, 0], error[0, 0]))))
    return np.array(distances), np.array(angles)


def relations_of(*rows):
    table = np.array(rows, dtype=float)
    return Relations(table[:, 0], table[:, 1], table[:, 2:])


STRAIGHT = Trajectory(np.arange(4.0), np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]]))


def test_a_perfect_trajectory_has_no_error():
    errors = evaluate_relations(STRAIGHT, relations_of((0, 1, 1, 0, 0), (1, 3, 2, 0, 0)))
    assert (errors.count, errors.unmatched) == (2, 0)
    assert errors.translation.mean == errors.translation.std == errors.rotation.mean == 0.0


def test_means_and_deviations_are_those_of_the_single_errors():
    errors = evaluate_relations(STRAIGHT, relations_of((0, 1, 1.1, 0, 0), (1, 2, 1, 0.3, np.pi / 180)))
    assert errors.translation.mean == pytest.approx(0.2)
    assert errors.translation.std == pytest.approx(0.2 / np.sqrt(2))
    assert errors.translation_squared.mean == pytest.approx(0.05)
    assert errors.rotation.mean == pytest.approx(0.5)
    assert errors.rotation_squared.mean == pytest.approx(0.5)


def test_a_turned_relation_costs_the_lever_arm_only_in_the_way_of_cartographer():
    truth = relations_of((0, 3, 3, 0, 0.1))
    assert evaluate_relations(STRAIGHT, truth).translation.mean == pytest.approx(0.0)
    other = evaluate_relations(STRAIGHT, truth, cartographer=True)
    assert other.translation.mean == pytest.approx(2 * 3 * np.sin(0.05))
    assert other.rotation.mean == pytest.approx(np.degrees(0.1))


coordinate = st.floats(-50, 50)
angle = st.floats(-3, 3)


@given(
    st.lists(st.tuples(coordinate, coordinate, angle), min_size=2, max_size=6),
    st.lists(st.tuples(coordinate, coordinate, angle), min_size=1, max_size=4),
    st.booleans(),
    st.data(),
)
def test_metric_agrees_with_the_naive_one(poses, truths, cartographer, data):
    trajectory = Trajectory(100.0 + 7.0 * np.arange(len(poses)), np.array(poses))
    pick = st.sampled_from(list(trajectory.stamps))
    relations = relations_of(*((data.draw(pick), data.draw(pick), *true) for true in truths))
    distances, angles = naive_errors(trajectory, relations, cartographer)
    errors = evaluate_relations(trajectory, relations, cartographer=cartographer)
    assert errors.translation.mean == pytest.approx(distances.mean(), abs=1e-9)
    assert errors.translation_squared.mean == pytest.approx((distances**2).mean(), abs=1e-8)
    assert errors.rotation.mean == pytest.approx(angles.mean(), abs=1e-6)
    if len(distances) > 1:
        assert errors.translation.std == pytest.approx(distances.std(ddof=1), abs=1e-9)


def test_relations_without_poses_are_counted():
    errors = evaluate_relations(STRAIGHT, relations_of((0, 1, 1, 0, 0), (0, 9, 1, 0, 0), (-5, 1, 1, 0, 0)))
    assert (errors.count, errors.unmatched) == (1, 2)


def test_a_truth_of_another_time_is_refused():
    with pytest.raises(EvaluationError, match="none of the 1 relations") as caught:
        evaluate_relations(STRAIGHT, relations_of((50, 60, 1, 0, 0)))
    assert caught.value.hint == "the relations span 50.000 to 60.000 s, the trajectory 0.000 to 3.000 s"


def test_a_time_takes_the_nearest_stamp_within_the_tolerance():
    poses, found = poses_at(STRAIGHT, np.array([1.004, 1.996]), tolerance=0.005)
    np.testing.assert_array_equal(poses[:, 0], [1.0, 2.0])
    assert found.all()


def test_a_time_between_two_near_scans_is_interpolated_along_the_shorter_arc():
    trajectory = Trajectory(np.array([0.0, 0.4]), np.array([[0.0, 0, 3.0], [4.0, 2, -3.0]]))
    poses, found = poses_at(trajectory, np.array([0.1]))
    assert found.all()
    expected = 3.0 + 0.25 * (2 * np.pi - 6.0) - 2 * np.pi
    np.testing.assert_allclose(poses, [[1.0, 0.5, (expected + np.pi) % (2 * np.pi) - np.pi]])


def test_a_time_in_a_wide_gap_or_outside_is_not_found():
    trajectory = Trajectory(np.array([0.0, 5.0]), np.zeros((2, 3)))
    poses, found = poses_at(trajectory, np.array([2.5, -0.1, 5.1, 5.0]))
    np.testing.assert_array_equal(found, [False, False, False, True])
    assert np.isnan(poses[:3]).all()


def test_stamps_that_step_back_are_found_like_any():
    trajectory = Trajectory(
        np.array([10.0, 11.0, 10.5, 11.5]), np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]])
    )
    poses, found = poses_at(trajectory, np.array([10.0, 10.5, 11.0, 11.5, 10.75]))
    assert found.all()
    np.testing.assert_allclose(poses[:, 0], [0.0, 2.0, 1.0, 3.0, 1.5])


def test_a_single_pose_and_doubled_stamps_are_enough():
    poses, found = poses_at(Trajectory(np.array([3.0]), np.ones((1, 3))), np.array([2.0, 3.0, 4.0]))
    np.testing.assert_array_equal(found, [False, True, False])
    doubled = Trajectory(np.array([3.0, 3.0]), np.array([[1.0, 0, 0], [2.0, 0, 0]]))
    poses, found = poses_at(doubled, np.array([3.0]))
    assert found.all()
    assert np.isfinite(poses).all()


def test_relation_files_are_read_with_their_planar_part(tmp_path):
    path = tmp_path / "r.relations"
    path.write_text("# t1 t2 x y z roll pitch yaw\n1134864645.90321 1134864646.32420 0.3 0.02 9 8 7 0.24\n")
    relations = read_relations(path)
    np.testing.assert_array_equal(relations.first, [1134864645.90321])
    np.testing.assert_array_equal(relations.second, [1134864646.32420])
    np.testing.assert_array_equal(relations.first_from_second, [[0.3, 0.02, 0.24]])


@pytest.mark.parametrize(
    ("text", "complaint"),
    [("", "holds no data"), ("1 2 3\n", "line 1: 3 columns"), ("1 2 3 4 5 6 7 x\n", "line 1: 'x' is not")],
)
def test_what_is_no_relation_file_is_refused(tmp_path, text, complaint):
    path = tmp_path / "r.relations"
    path.write_text(text)
    with pytest.raises(EvaluationError, match=complaint):
        read_relations(path)


@pytest.mark.parametrize(
    ("log", "count"), [("intel", 2984), ("aces", 1279), ("mit-csail", 1172), ("mit-killian", 4677)]
)
def test_every_relation_of_the_real_logs_is_read(data_dir, log, count):
    relations = read_relations(data_dir / "freiburg" / f"{log}.relations")
    assert relations.first_from_second.shape == (count, 3)


@pytest.mark.parametrize(
    ("log", "metres", "degrees"), [("aces", 0.549, 2.3), ("mit-csail", 1.682, 5.1), ("intel", 7.370, 39.2)]
)
def test_the_published_error_of_the_raw_odometry_is_found_again(data_dir, log, metres, degrees):
    stamps, poses = [], []
    with gzip.open(data_dir / "freiburg" / f"{log}.clf.gz", "rt") as lines:
        for line in lines:
            if line.startswith("FLASER"):
                fields = line.split()
                beams = int(fields[1])
                stamps.append(float(fields[-3]))
                poses.append([float(value) for value in fields[beams + 5 : beams + 8]])
    relations = read_relations(data_dir / "freiburg" / f"{log}.relations")
    errors = evaluate_relations(Trajectory(np.array(stamps), np.array(poses)), relations)
    assert errors.unmatched == 0
    assert errors.translation.mean == pytest.approx(metres, abs=1e-3)
    assert errors.rotation.mean == pytest.approx(degrees, abs=0.05)
