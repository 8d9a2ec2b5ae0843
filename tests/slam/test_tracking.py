"""What a match leaves behind: a run can be told again from it, scan by scan."""

from dataclasses import asdict, replace

import numpy as np
from slam_worlds import ROOM, Lidar, drive, prediction, range_data

from glassslam.config import Config
from glassslam.slam.extrapolator import PoseExtrapolator
from glassslam.slam.local import LocalSlam, prepared
from glassslam.slam.tracking import Event, How, Match, MatchLog, Tracking

PATH = drive((1.2, 0.8), (5.5, 0.8), (5.5, 4.2))
CONFIG = Config.from_mapping({"submap": {"num_range_data": 6}})


def scans(poses=PATH):
    lidar = Lidar(ROOM)
    return [prepared(range_data(lidar.look(0.1 * k, pose)), 0.025) for k, pose in enumerate(poses)]


def test_a_run_told_again_from_its_matches_is_the_same():
    first, again, extrapolator = LocalSlam(CONFIG), LocalSlam(CONFIG), PoseExtrapolator()
    for k, data in enumerate(scans()):
        expected = extrapolator.predict(0.1 * k, None)
        match = first.match(data, expected)
        left = replace(first.tracking)
        one = first.enter(match, data)
        again.tracking = left
        two = again.enter(match, data)
        extrapolator.add_pose(0.1 * k, one.pose_in_local, None)
        assert (one.node is None) == (two.node is None)
        assert [s.nodes for s in one.submaps] == [s.nodes for s in two.submaps]
        assert len(one.finished) == len(two.finished)
        for mine, other in zip(one.submaps, two.submaps, strict=True):
            np.testing.assert_array_equal(mine.grid.cells, other.grid.cells)
    assert asdict(first.tracking) == asdict(again.tracking)
    np.testing.assert_array_equal(first.log.arrays().hold, again.log.arrays().hold)


def test_matching_alone_changes_nothing_but_tracking():
    local, data = LocalSlam(CONFIG), scans()
    local.add(data[0], prediction((0, 0, 0)))
    before = replace(local.tracking)
    one = local.match(data[1], prediction((0.05, 0, 0)))
    local.tracking = before
    two = local.match(data[1], prediction((0.05, 0, 0)))
    np.testing.assert_array_equal(one.pose, two.pose)
    assert replace(one, pose=two.pose) == two
    assert len(local.log) == 1


def test_a_match_tells_how_it_came_about_and_what_it_rests_on():
    local, data = LocalSlam(CONFIG), scans()
    first = local.add(data[0], prediction((0, 0, 0))).match
    assert (first.how, first.points, first.hold, first.overlap) == (How.FIRST, 0, 0.0, 0.0)
    second = local.add(data[1], prediction((0.05, 0, 0))).match
    assert second.how is How.MATCHED
    assert second.points > 100
    assert second.overlap > 0.5
    few = type(data[2])(0.2, data[2].sensor, data[2].returns[:3], data[2].free_ends)
    assert local.add(few, prediction((0.1, 0, 0))).match.how is How.UNMATCHED


class TestBreaks:
    def run(self, event, count):
        """Local SLAM after some scans and one more that comes with an event."""
        local, data = LocalSlam(CONFIG), scans()
        for k in range(count):
            local.add(data[k], prediction((0.05 * k, 0, 0)))
        found = local.add(data[count], prediction((0.05 * count, 0, 0), event=event))
        return local, found

    def test_a_break_completes_the_submaps_and_begins_a_node(self):
        local, found = self.run(Event.CLOCK_BACK, 20)
        assert found.match.how is How.FIRST
        assert found.node is not None
        assert found.node.begins
        assert all(submap.finished for submap in found.finished)
        assert [submap.nodes for submap in found.submaps] == [[found.node.index]]
        assert local.tracking.since_start <= 0

    def test_the_first_scan_lies_where_it_fits_in_the_map_of_before(self):
        _, found = self.run(Event.GAP, 20)
        np.testing.assert_allclose(found.pose_in_local, [1.0, 0, 0], atol=0.03)

    def test_other_events_break_nothing(self):
        _, found = self.run(Event.ODOMETRY_JUMP, 20)
        assert found.match.how is How.MATCHED
        assert found.match.event == Event.ODOMETRY_JUMP

    def test_a_stretch_of_a_few_scans_is_not_broken_again(self):
        _, found = self.run(Event.GAP, 4)
        assert found.match.how is How.MATCHED

    def test_a_break_without_returns_begins_where_the_robot_is_expected(self):
        local, data = LocalSlam(CONFIG), scans()
        for k in range(20):
            local.add(data[k], prediction((0.05 * k, 0, 0)))
        blind = type(data[20])(2.0, data[20].sensor, data[20].returns[:0], data[20].free_ends)
        found = local.add(blind, prediction((3.0, 1.0, 0.5), event=Event.GAP))
        assert found.match.how is How.FIRST
        np.testing.assert_array_equal(found.pose_in_local, [3.0, 1.0, 0.5])


def test_the_log_gives_back_what_was_added():
    log = MatchLog()
    assert len(log.arrays()) == 0
    log.add(Match(np.zeros(3), 0.3, 70, 0.1, -0.5, 0.9, How.COASTED, Event.GAP | Event.ODOMETRY_JUMP))
    log.add(Match(np.zeros(3), 0.4))
    arrays = log.arrays()
    assert len(log) == len(arrays) == 2
    assert arrays.residual.tolist() == [0.3, 0.4]
    assert arrays.points.tolist() == [70, 0]
    assert arrays.hold.tolist() == [0.1, 0.0]
    assert arrays.free_heading.tolist() == [-0.5, 0.0]
    assert arrays.overlap.tolist() == [0.9, 0.0]
    assert arrays.how.tolist() == [How.COASTED, How.MATCHED]
    assert arrays.event.tolist() == [5, 0]


def test_tracking_is_plain_numbers():
    assert all(type(value) in (int, float, bool) for value in asdict(Tracking()).values())
