"""Scans wait for their odometry."""

import numpy as np
import pytest

from glassslam.records import LaserScan, Odometry
from glassslam.slam.odometry_track import OdometryTrack
from glassslam.slam.scan_queue import ScanQueue


class World:
    """A queue fed by hand."""

    def __init__(self):
        self.track = OdometryTrack()
        self.queue = ScanQueue(self.track)

    def scan(self, *stamps):
        for stamp in stamps:
            self.queue.add(LaserScan(stamp, np.ones(3, dtype=np.float32), 0.0, 0.1, 0.1, 10.0))

    def odometry(self, *stamps):
        """Poses whose x is their time."""
        for stamp in stamps:
            self.track.add(Odometry(stamp, (stamp, 0.0, 0.0)))

    def take(self, **options):
        return [
            (timed.scan.stamp, timed.time, None if timed.odometry_pose is None else timed.odometry_pose[0])
            for timed in self.queue.take(**options)
        ]


@pytest.fixture
def world():
    return World()


def test_a_scan_is_given_out_when_odometry_has_passed_it(world):
    world.scan(1.0, 1.1, 1.2, 1.3, 1.4)
    world.odometry(0.9, 1.05, 1.15)
    assert world.take() == [(1.0, 1.0, pytest.approx(1.0)), (1.1, 1.1, pytest.approx(1.1))]
    assert len(world.queue) == 3


def test_without_odometry_it_waits_for_a_second(world):
    world.scan(1.0, 1.3, 1.6, 1.9)
    assert world.take() == []
    world.scan(2.2)
    assert world.take() == [(1.0, 1.0, None)]


def test_it_does_not_wait_for_ever_where_stamps_stand_still(world):
    world.scan(*[5.0] * 201)
    assert len(world.take()) == 1


def test_the_last_three_wait_for_what_their_followers_tell_of_their_stamps(world):
    world.odometry(0.0, 9.0)
    world.scan(1.0, 2.0, 3.0)
    assert world.take() == []
    assert world.take(everything=True) == [(1.0, 1.0, 1.0), (2.0, 2.0, 2.0), (3.0, 3.0, 3.0)]
    assert len(world.queue) == 0


def test_a_late_stamp_is_mended_for_the_odometry_and_kept_for_the_result(world):
    world.odometry(0.0, 9.0)
    world.scan(1.0, 1.9, 1.4, 1.6)
    assert world.take(everything=True)[1] == (1.9, pytest.approx(1.2), pytest.approx(1.2))


def test_odometry_of_the_very_same_stamp_belongs_to_the_scan(world):
    """As in logs that write both on one line, whatever their clock does."""
    for stamp in (5.0, 6.0, 2.0, 3.0, 2.5):
        world.odometry(stamp)
        world.scan(stamp)
    assert [pose for _, _, pose in world.take(everything=True)] == [5.0, 6.0, 2.0, 3.0, 2.5]


def test_a_batch_is_full_after_sixteen(world):
    world.scan(*range(16))
    assert not world.queue.is_full
    world.scan(16)
    assert world.queue.is_full


def test_order_is_that_of_the_recording(world):
    stamps = [3.0, 1.0, 2.0, 2.0, 500.0, 0.0]
    world.scan(*stamps)
    assert [stamp for stamp, _, _ in world.take(everything=True)] == stamps
