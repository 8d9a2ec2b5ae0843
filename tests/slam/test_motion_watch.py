"""Odometry that stands still while the scans do not, and walls that all run one way."""

import math
from dataclasses import replace

import numpy as np
import pytest
from slam_worlds import CORRIDOR, RING, ROOM, Lidar, drive, odometry, recording

from glassslam.config import Config
from glassslam.records import LaserScan
from glassslam.slam.bare_kernels import wall_spread
from glassslam.slam.mapper import Mapper
from glassslam.slam.motion_watch import MotionWatch
from glassslam.slam.restless import by_direction, restless_share

ALONG_CORRIDOR = drive((-10.0, 1.0), (10.0, 1.0), step=0.2)
STRAIGHT = drive((1.25, 1.25), (14.0, 1.25), step=0.1)
"""Along one side of RING: most of what is seen are two walls."""


def standing(place, count=100):
    return np.repeat(np.array([place], dtype=np.float64), count, axis=0)


def told(records):
    """Kinds, first and last scan of what a mapper tells of a run, and its warnings."""
    mapper = Mapper(Config())
    try:
        for record in records:
            mapper.add(record)
        statistics = mapper.settle().statistics
    finally:
        mapper.close()
    return [(one.kind, one.first_scan, one.last_scan) for one in statistics.degeneracies], statistics.warnings


def scans_only(records):
    return [record for record in records if isinstance(record, LaserScan)]


def spread_of(scan):
    return wall_spread(scan.ranges, scan.angle_min, scan.angle_increment, 0.05, 30.0)


def naive_spread(ranges, first, step, nearest, farthest):
    """The same, echo by echo."""
    points = {
        k: (r * math.cos(first + k * step), r * math.sin(first + k * step))
        for k, r in enumerate(ranges.tolist())
        if nearest <= r <= farthest
    }
    vectors, asked = [], 0
    most = max(1, int(min(len(ranges), 0.5 / abs(step))))
    for k, point in points.items():
        width = int(min(most, max(1.0, 0.3 / (abs(step) * float(ranges[k])))))
        while width <= most and k - width in points and k + width in points:
            chord = np.subtract(points[k + width], points[k - width])
            if np.hypot(*chord) >= 0.6 or width == most:
                asked += 1
                arm = np.subtract(point, points[k - width])
                if abs(arm[0] * chord[1] - arm[1] * chord[0]) <= 0.05 * np.hypot(*chord):
                    vectors.append(np.exp(2j * math.atan2(chord[1], chord[0])))
                break
            width += 1
    if asked == 0:
        return 0.5, 0.0
    total = sum(vectors) if vectors else 0.0
    return 0.5 * (1.0 - abs(total) / asked), 0.5 * float(np.angle(total))


class TestWallSpread:
    @pytest.mark.parametrize("noise", [0.01, 0.02])
    def test_a_bare_corridor_has_one_direction_from_everywhere(self, noise):
        lidar = Lidar(CORRIDOR, noise=noise)
        for x, y, turn in [(-5.0, 1.0, 0.0), (0.0, 0.4, 0.3), (4.0, 1.5, -1.2)]:
            spread, heading = spread_of(lidar.look(0.0, (x, y, turn)))
            assert spread < 0.03
            assert math.sin(heading + turn) == pytest.approx(0.0, abs=0.02)

    def test_rooms_and_corridors_that_end_have_more(self):
        assert spread_of(Lidar(ROOM).look(0.0, (2.0, 1.0, 0.4)))[0] > 0.2
        assert spread_of(Lidar(RING).look(0.0, (7.0, 1.25, 0.0)))[0] > 0.08

    def test_nothing_tells_nothing(self):
        assert wall_spread(np.full(90, np.inf, dtype=np.float32), 0.0, 0.1, 0.05, 30.0) == (0.5, 0.0)
        assert wall_spread(np.ones(2, dtype=np.float32), 0.0, 1e-30, 0.05, 30.0) == (0.5, 0.0)

    @pytest.mark.parametrize("beams", [60, 181, 720])
    @pytest.mark.parametrize("world", [ROOM, CORRIDOR], ids=["room", "corridor"])
    def test_it_is_what_the_words_say(self, world, beams):
        scan = Lidar(world, beams=beams, noise=0.02).look(0.0, (2.0, 1.0, 0.4))
        ranges = scan.ranges.copy()
        ranges[::17] = np.nan
        found = wall_spread(ranges, scan.angle_min, scan.angle_increment, 0.05, 30.0)
        expected = naive_spread(ranges, scan.angle_min, scan.angle_increment, 0.05, 30.0)
        assert found == pytest.approx(expected, abs=1e-6)


class TestRestless:
    def rows(self, world, poses, change=lambda k, ranges: ranges):
        lidar, rows = Lidar(world), []
        for k, pose in enumerate(poses):
            scan = lidar.look(0.1 * k, pose)
            rows.append(
                by_direction(change(k, scan.ranges), scan.angle_min, scan.angle_increment, (0.05, 30))
            )
        return rows

    def test_a_robot_that_stands_sees_the_same(self):
        assert restless_share(self.rows(ROOM, standing((2.0, 1.0, 0.4)))) == 0.0

    def test_however_many_people_walk_by(self):
        def crowd(k, ranges):
            seen = ranges.copy()
            for person in range(6):
                begin = (97 * person + 11 * k) % 330
                seen[begin : begin + 25] = np.minimum(seen[begin : begin + 25], 0.8)
            return seen

        assert restless_share(self.rows(ROOM, standing((2.0, 1.0, 0.4)), crowd)) < 0.1

    def test_a_robot_that_drives_does_not(self):
        assert restless_share(self.rows(ROOM, drive((1.2, 0.8), (4.5, 0.8)))) > 0.35
        assert restless_share(self.rows(RING, STRAIGHT)) > 0.25

    def test_nor_one_that_turns_or_drives_after_it_stood(self):
        turning = standing((2.0, 1.0, 0.0))
        turning[:, 2] = 0.05 * np.arange(len(turning))
        assert restless_share(self.rows(ROOM, turning)) > 0.5
        late = np.vstack((standing((1.2, 0.8, 0.0), 150), drive((1.2, 0.8), (4.5, 0.8))))
        assert restless_share(self.rows(ROOM, late)) > 0.3

    def test_too_few_scans_and_echoes_say_nothing(self):
        assert restless_share([]) == 0.0
        assert restless_share(self.rows(ROOM, STRAIGHT[:15])) == 0.0
        assert restless_share([np.full(180, np.nan)] * 40) == 0.0

    def test_ranges_are_sorted_by_their_direction(self):
        ranges = np.array([1.0, np.nan, 3.0, 50.0, 0.01], dtype=np.float32)
        around = by_direction(ranges, -np.pi / 2, np.pi / 2, (0.05, 30.0))
        assert np.flatnonzero(np.isfinite(around)).tolist() == [90 // 2, 270 // 2]
        assert around[135] == 1.0


class TestStuckOdometry:
    def watched(self, scans, poses):
        watch = MotionWatch()
        for scan, pose in zip(scans, poses, strict=True):
            watch.add(scan, None if pose is None else np.array(pose))
        return [(one.first, one.last) for one in watch.report().stuck]

    def test_odometry_that_stops_on_the_way_is_found(self):
        scans = scans_only(recording(ROOM, drive((1.2, 0.8), (6.0, 0.8), (6.0, 3.0), (1.5, 3.0))))
        path = [(0.05 * min(k, 80), 0.0, 0.0) for k in range(len(scans))]
        assert self.watched(scans, path) == [(80, len(scans) - 1)]

    def test_a_short_stop_is_not_worth_a_word(self):
        scans = scans_only(recording(ROOM, STRAIGHT))[:90]
        path = [(0.05 * (k if k < 30 else max(30, k - 45)), 0.0, 0.0) for k in range(90)]
        assert self.watched(scans, path) == []

    def test_nor_is_a_silence_of_the_recording(self):
        scans = [replace(scan, stamp=7.0 * k) for k, scan in enumerate(scans_only(recording(ROOM, STRAIGHT)))]
        assert self.watched(scans, [(0.0, 0.0, 0.0)] * len(scans)) == []

    def test_where_odometry_does_not_reach_walls_are_looked_at(self):
        scans = scans_only(recording(CORRIDOR, ALONG_CORRIDOR[:3]))
        watch = MotionWatch(laser_yaw=0.5)
        watch.add(scans[0], np.zeros(3))
        watch.add(scans[1], None)
        report = watch.report()
        assert np.isnan([report.wall_spread[0], report.wall_heading[0]]).all()
        assert report.wall_spread[1] < 0.01
        assert report.wall_heading[1] == pytest.approx(0.5, abs=0.01)


class TestWholeRuns:
    def test_a_bare_corridor_without_odometry_is_told_though_nothing_seems_to_move(self):
        kinds, warnings = told(scans_only(recording(CORRIDOR, ALONG_CORRIDOR)))
        ((kind, first, last),) = kinds
        assert kind == "featureless, no odometry"
        assert (first, last) == (1, len(ALONG_CORRIDOR) - 1)
        assert warnings == [
            "for 10 s nothing told how far the robot drove along bare walls: the map may be much too short:"
            " see report"
        ]

    def test_a_few_seconds_without_odometry_are_not(self):
        assert told(scans_only(recording(CORRIDOR, standing((0.0, 1.0, 0.0), 40)))) == ([], [])

    def test_a_robot_that_stands_in_a_corridor_and_says_so_is_not(self):
        still = standing((0.0, 1.0, 0.0))
        assert told(recording(CORRIDOR, still, odometry(still))) == ([], [])

    def test_a_robot_without_odometry_that_has_something_to_see_is_not(self):
        assert told(scans_only(recording(ROOM, standing((2.0, 1.0, 0.4))))) == ([], [])

    def test_wheels_that_never_turn_are_told(self):
        kinds, warnings = told(recording(RING, STRAIGHT, np.zeros((len(STRAIGHT), 3))))
        assert ("odometry stuck", 0, len(STRAIGHT) - 1) in kinds
        assert any("the odometry stood still for 13 s while the scans changed" in text for text in warnings)

    def test_wheels_of_a_robot_that_stands_in_a_room_are_not(self):
        still = standing((2.0, 1.0, 0.4))
        assert told(recording(ROOM, still, odometry(still))) == ([], [])

    def test_motion_that_the_map_misses_is_told(self):
        fast = drive((1.25, 1.25), (14.0, 1.25), step=0.2)
        kinds, warnings = told(scans_only(recording(RING, fast, beams=240)))
        assert [kind for kind, _, _ in kinds] == ["motion missed"]
        assert any("the robot rests in the map while the scans change" in text for text in warnings)

    @pytest.mark.parametrize("wheels", [True, False])
    def test_of_a_crowd_around_a_robot_that_stands_odometry_knows(self, wheels):
        random = np.random.default_rng(1)
        still = standing((2.0, 1.0, 0.4), 150)
        records = recording(ROOM, still, odometry(still) + random.normal(0.0, 0.005, (150, 3)))
        for k, record in enumerate(records):
            if isinstance(record, LaserScan):
                ranges = record.ranges.copy()
                ranges[: len(ranges) // 4] = random.uniform(0.3, 1.8, len(ranges) // 4)
                records[k] = replace(record, ranges=ranges)
        kinds, _ = told(records if wheels else scans_only(records))
        assert ("motion missed" in [kind for kind, _, _ in kinds]) is not wheels
