"""The pose of every sweep: four kinds, awkward clocks."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glassslam.geometry import wrap_angle
from glassslam.records import Trajectory
from glassslam.slam.trajectory import PoseTracks
from glassslam.sonar.poses import sweep_poses


def track(stamps, x, theta=None):
    x = np.array(x, dtype=np.float64)
    theta = np.zeros(len(x)) if theta is None else np.array(theta, dtype=np.float64)
    return Trajectory(np.array(stamps, dtype=np.float64), np.column_stack((x, np.zeros(len(x)), theta)))


def tracks(**given_tracks):
    """Tracks that x tells apart: local at 0 to 3, partial from 10, nodes at 20 and 23, final from 30."""
    usual = {
        "local": track([0, 1, 2, 3], [0, 1, 2, 3]),
        "partial": track([0, 1, 2, 3], [10, 11, 12, 13]),
        "nodes": track([0, 3], [20, 23]),
        "final": track([0, 1, 2, 3], [30, 31, 32, 33]),
    }
    return PoseTracks(**{**usual, **given_tracks})


@pytest.mark.parametrize(
    ("kind", "expected"),
    [
        ("Loc", [0, 1, 2, 3]),
        ("PG", [10, 11, 12, 13]),
        ("FG", [20, 20, 23, 23]),
        ("FGfit", [30.4, 31.4, 32.4, 33]),
    ],
)
def test_each_kind_takes_its_own_track(kind, expected):
    poses, inside = sweep_poses(tracks(), np.array([0.4, 1.4, 2.4, 3.0]), kind)
    assert poses[:, 0] == pytest.approx(expected)
    assert inside.all()


def test_only_fgfit_moves_between_scans():
    stamps = np.linspace(1.0, 1.99, 12)
    assert len(np.unique(sweep_poses(tracks(), stamps, "FGfit")[0][:, 0])) == 12
    for kind in ("Loc", "PG"):
        assert len(np.unique(sweep_poses(tracks(), stamps, kind)[0][:, 0])) == 1


def test_the_heading_turns_the_short_way():
    final = track([0, 1], [0, 0], [math.radians(170), math.radians(-170)])
    poses, _ = sweep_poses(tracks(final=final), np.array([0.25, 0.5, 0.75]), "FGfit")
    expected = np.radians([175, 180, 185])
    assert np.abs(wrap_angle(poses[:, 2] - expected)) == pytest.approx(np.zeros(3), abs=1e-12)


def test_sweeps_outside_the_time_of_the_track_are_told_and_hold_its_ends():
    poses, inside = sweep_poses(tracks(), np.array([-0.5, 0.0, 3.0, 3.5]), "FGfit")
    assert inside.tolist() == [False, True, True, False]
    assert poses[:, 0] == pytest.approx([30, 30, 33, 33])


def test_sweeps_may_come_in_any_order_and_share_stamps():
    stamps = np.array([2.5, 0.5, 0.5, 1.5])
    poses, _ = sweep_poses(tracks(), stamps, "FGfit")
    assert poses[:, 0] == pytest.approx([32.5, 30.5, 30.5, 31.5])


def test_equal_stamps_of_scans_do_not_divide_by_zero():
    final = track([0, 1, 1, 2], [0, 1, 5, 6])
    poses, _ = sweep_poses(tracks(final=final), np.array([0.5, 1.0, 1.5]), "FGfit")
    assert poses[:, 0] == pytest.approx([0.5, 5.0, 5.5])


def test_a_clock_that_steps_back_keeps_the_order_of_the_motion():
    final = track([0, 1, 3, 2, 4], [0, 1, 2, 3, 4])
    poses, inside = sweep_poses(tracks(final=final), np.linspace(0, 4, 41), "FGfit")
    assert (np.diff(poses[:, 0]) >= 0).all()
    assert inside.all()


def test_a_single_pose_serves_its_own_time():
    lonely = track([1], [7])
    for kind in ("Loc", "PG", "FG", "FGfit"):
        every = tracks(local=lonely, partial=lonely, nodes=lonely, final=lonely)
        poses, inside = sweep_poses(every, np.array([0.0, 1.0]), kind)
        assert poses[:, 0].tolist() == [7, 7]
        assert inside.tolist() == [False, True]


def test_without_poses_every_sweep_is_outside():
    nothing = Trajectory(np.empty(0), np.empty((0, 3)))
    poses, inside = sweep_poses(tracks(final=nothing), np.array([0.0, 1.0]), "FGfit")
    assert poses.shape == (2, 3)
    assert not inside.any()


@given(st.lists(st.floats(0.0, 3.0), min_size=1, max_size=20))
def test_interpolated_poses_stay_between_their_neighbours(stamps):
    stamps = np.array(stamps)
    poses, inside = sweep_poses(tracks(), stamps, "FGfit")
    assert inside.all()
    assert poses[:, 0] == pytest.approx(30.0 + stamps)
