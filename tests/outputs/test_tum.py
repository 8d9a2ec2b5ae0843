"""trajectory.tum."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from glassslam.errors import OutputError
from glassslam.outputs import read_tum, write_tum
from glassslam.records import Trajectory


def test_lines_have_nine_decimals_and_no_negative_zero(tmp_path):
    trajectory = Trajectory(
        np.array([1134864645.90321, 0.5]), np.array([[1.0, -2.5, np.pi / 2], [-0.0, -1e-12, 0.0]])
    )
    write_tum(trajectory, tmp_path / "t.tum")
    assert (tmp_path / "t.tum").read_text() == (
        "1134864645.903209925 1.000000000 -2.500000000 0.000000000 "
        "0.000000000 0.000000000 0.707106781 0.707106781\n"
        "0.500000000 0.000000000 0.000000000 0.000000000 0.000000000 0.000000000 0.000000000 1.000000000\n"
    )


poses = st.integers(1, 8).flatmap(lambda n: arrays(np.float64, (n, 3), elements=st.floats(-1e4, 1e4)))


@given(poses, st.floats(0, 2e9))
def test_what_is_written_is_read_back_in_its_order(tmp_path_factory, poses, start):
    path = tmp_path_factory.mktemp("tum") / "t.tum"
    poses[:, 2] = (poses[:, 2] + np.pi) % (2 * np.pi) - np.pi
    stamps = start - 0.1 * np.arange(len(poses))
    write_tum(Trajectory(stamps, poses), path)
    loaded = read_tum(path)
    np.testing.assert_allclose(loaded.stamps, stamps, rtol=0, atol=1e-9)
    np.testing.assert_allclose(loaded.poses[:, :2], poses[:, :2], rtol=0, atol=1e-9)
    np.testing.assert_allclose(np.exp(1j * loaded.poses[:, 2]), np.exp(1j * poses[:, 2]), atol=1e-8)


def test_big_stamps_come_back_to_the_bit(tmp_path):
    stamps = np.array([1031745824.658, 976052905.167303, 1134864645.90321])
    write_tum(Trajectory(stamps, np.zeros((3, 3))), tmp_path / "t.tum")
    np.testing.assert_array_equal(read_tum(tmp_path / "t.tum").stamps, stamps)


def test_evo_reads_the_same_trajectory(tmp_path):
    from evo.tools import file_interface

    trajectory = Trajectory(np.array([1e9, 1e9 + 0.1]), np.array([[1.0, 2.0, 3.0], [4.0, 5.0, -1.0]]))
    write_tum(trajectory, tmp_path / "t.tum")
    read = file_interface.read_tum_trajectory_file(str(tmp_path / "t.tum"))
    np.testing.assert_allclose(read.timestamps, trajectory.stamps)
    np.testing.assert_allclose(read.positions_xyz[:, :2], trajectory.poses[:, :2])
    yaw = [np.arctan2(pose[1, 0], pose[0, 0]) for pose in read.poses_se3]
    np.testing.assert_allclose(yaw, trajectory.poses[:, 2], atol=1e-8)


def test_comments_and_long_quaternions_are_read(tmp_path):
    path = tmp_path / "t.tum"
    path.write_text("# t x y z qx qy qz qw\n\n1 2 3 9 0 0 2 2 # turned left\n")
    np.testing.assert_allclose(read_tum(path).poses, [[2.0, 3.0, np.pi / 2]])


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        (b"", "holds no data"),
        (b"# only a comment\n", "holds no data"),
        (b"1 2 3\n", "line 1: 3 columns"),
        (b"1 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 x\n", "line 2: 'x' is not a finite number"),
        (b"1 nan 0 0 0 0 0 1\n", "line 1: 'nan' is not a finite number"),
        (b"1 0 0 0 0 0 0 0\n", "pose 1 has a zero quaternion"),
        (b"\xff\xfe\x00", "is not a text file"),
    ],
)
def test_what_is_no_trajectory_is_refused(tmp_path, content, complaint):
    path = tmp_path / "t.tum"
    path.write_bytes(content)
    with pytest.raises(OutputError, match=complaint):
        read_tum(path)


def test_a_missing_file_is_named():
    with pytest.raises(OutputError, match=r"cannot read nowhere\.tum: No such file or directory"):
        read_tum("nowhere.tum")
