"""Tracking against the submap being built."""

import numpy as np
import pytest
from slam_worlds import ROOM, Lidar, drive, in_first_frame, odometry, prediction, range_data

from glassslam.config import Config
from glassslam.geometry import between
from glassslam.slam.extrapolator import PoseExtrapolator
from glassslam.slam.local import LocalSlam, prepared

PATH = drive((1.2, 0.8), (5.5, 0.8), (5.5, 4.2), (2.0, 4.2))
"""11 m through the room with two turns on the spot."""


def configured(**sections):
    return Config.from_mapping(sections)


def track(poses, wheels=None, *, config=None, stamps=None):
    """Local poses of a run, and the tracker."""
    lidar, extrapolator, local = Lidar(ROOM), PoseExtrapolator(), LocalSlam(config or Config())
    stamps = 0.1 * np.arange(len(poses)) if stamps is None else stamps
    found = []
    for k, (stamp, pose) in enumerate(zip(stamps, poses, strict=True)):
        measured = None if wheels is None else wheels[k]
        expected = extrapolator.predict(stamp, measured)
        result = local.add(prepared(range_data(lidar.look(stamp, pose)), 0.025), expected)
        extrapolator.add_pose(stamp, result.pose_in_local, measured)
        found.append(result.pose_in_local)
    return np.array(found), local


def errors(found, poses):
    """Distances, m, and turns, rad, from the truth, both seen from their first pose."""
    off = between(in_first_frame(poses), found)
    return np.hypot(off[:, 0], off[:, 1]), np.abs(off[:, 2])


def test_wheels_that_err_are_corrected():
    wheels = odometry(PATH, scale=1.05, drift=0.05)
    drifted, _ = errors(wheels, PATH)
    assert drifted.max() > 0.5
    distance, turn = errors(track(PATH, wheels)[0], PATH)
    assert distance.max() < 0.05
    assert turn.max() < 0.02


def test_it_tracks_without_odometry():
    distance, turn = errors(track(PATH)[0], PATH)
    assert distance.max() < 0.05
    assert turn.max() < 0.02


def test_odometry_that_freezes_and_catches_up_in_a_jump_is_survived():
    path = drive((1.2, 0.8), (7.0, 0.8), (7.0, 4.2), step=0.15)
    wheels = odometry(path)
    for k in (12, 13, 14, 30, 31):
        wheels[k] = wheels[11 if k < 20 else 29]
    found, local = track(path, wheels)
    assert errors(found, path)[0].max() < 0.06
    assert local.tracking.coasted > 0


def test_after_a_gap_in_the_recording_a_robot_that_turned_and_moved_is_found_again():
    turned = PATH[45] + np.array([0.7, 0.3, 1.4])
    poses = np.vstack((PATH[:46], [turned] * 4))
    stamps = 0.1 * np.arange(50) + np.where(np.arange(50) > 45, 60.0, 0.0)
    found, local = track(poses, stamps=stamps)
    distance, turn = errors(found, poses)
    assert distance[46:].max() < 0.05
    assert turn[46:].max() < 0.02
    assert local.tracking.relocalised >= 1


def test_scans_with_too_few_returns_keep_their_prediction():
    found, local = track(PATH[:40])
    full = range_data(Lidar(ROOM).look(9.0, PATH[40]))
    few = type(full)(9.0, full.sensor, full.returns[:9], full.free_ends)
    expected = found[-1] + np.array([0.08, 0.04, 0.01])
    assert local.tracking.unmatched == 0
    np.testing.assert_array_equal(local.add(few, prediction(expected)).pose_in_local, expected)
    assert local.tracking.unmatched == 1
    assert np.abs(local.add(full, prediction(expected)).pose_in_local - expected).max() > 0.02
    assert local.tracking.unmatched == 1


def test_a_scan_without_any_return_is_no_error():
    local = LocalSlam(Config())
    data = range_data(Lidar(ROOM, reach=0.1).look(0.0, PATH[0]))
    assert len(data.returns) == 0
    for k in range(3):
        local.add(data, prediction((0.3 * k, 0, 0)))
    assert local.tracking.unmatched == 2
    assert len(local.finish()) == 1


@pytest.mark.parametrize(("mode", "searches"), [("always", 19), ("never", 0)])
def test_the_correlative_search_can_be_asked_for_or_left_out(mode, searches):
    found, local = track(PATH[:20], config=configured(local={"correlative_search": mode}))
    assert local.tracking.searches == searches
    assert errors(found, PATH[:20])[0].max() < 0.05


def test_a_doubtful_match_is_searched_around():
    """The robot slips aside while its wheels stand still: too far for the gradient alone."""
    poses = np.vstack((PATH[:60], [PATH[59] + np.array([0.15, 0.15, 0.25])] * 3))
    wheels = odometry(PATH[:60])
    found, local = track(poses, np.vstack((wheels, [wheels[-1]] * 3)))
    assert local.tracking.searches_taken >= 1
    assert errors(found, poses)[0].max() < 0.05


class TestNodes:
    def test_a_robot_that_stands_makes_one_node(self):
        lidar, local = Lidar(ROOM), LocalSlam(configured(motion_filter={"max_angle_deg": 5}))
        nodes = [
            local.add(range_data(lidar.look(0.1 * k, PATH[0])), prediction((0, 0, 0))).node for k in range(5)
        ]
        assert nodes[0] is not None
        assert nodes[1:] == [None] * 4

    def test_a_node_holds_what_global_slam_needs(self):
        lidar, local = Lidar(ROOM), LocalSlam(Config())
        data = range_data(lidar.look(3.0, PATH[0]))
        local.add(data, prediction((0, 0, 0)))
        local.add(range_data(lidar.look(3.1, PATH[0])), prediction((0, 0, 0)))
        node = local.add(range_data(lidar.look(3.2, PATH[6])), prediction((0.3, 0, 0))).node
        assert (node.index, node.scan, node.stamp) == (1, 2, 3.2)
        np.testing.assert_allclose(node.pose_in_local, [0.3, 0, 0], atol=0.03)
        assert node.returns.dtype == np.float32
        assert node.returns.shape == data.returns.shape
        assert 0.0 < node.residual < 0.6

    def test_submaps_overlap_by_half_and_are_finished_in_turn(self):
        lidar, local = Lidar(ROOM), LocalSlam(configured(submap={"num_range_data": 2}))
        entered, finished = [], []
        for k in range(9):
            pose = in_first_frame(PATH)[6 * k]
            result = local.add(range_data(lidar.look(0.1 * k, PATH[6 * k])), prediction(pose))
            entered.append([submap.index for submap in result.submaps])
            finished += result.finished
        assert entered == [[0], [0], [0, 1], [0, 1], [1, 2], [1, 2], [2, 3], [2, 3], [3, 4]]
        assert [submap.nodes for submap in finished] == [[0, 1, 2, 3], [2, 3, 4, 5], [4, 5, 6, 7]]
        assert all(submap.finished for submap in finished)
        assert [submap.nodes for submap in local.finish()] == [[6, 7, 8], [8]]


def test_prepared_thins_returns_and_keeps_the_rest():
    data = range_data(Lidar(ROOM, beams=2000).look(5.0, PATH[0]))
    thinned = prepared(data, 0.1)
    assert len(thinned.returns) < len(data.returns) / 3
    assert thinned.stamp == 5.0
    assert thinned.free_ends is data.free_ends
    assert thinned.sensor is data.sensor
