"""Records in, a map out: good runs and odd recordings."""

import math
import threading
from dataclasses import replace

import numpy as np
import pytest
from slam_worlds import RING, ROOM, Lidar, drive, in_first_frame, odometry, recording, round_trip

from glassslam.config import Config
from glassslam.errors import NoScansError
from glassslam.geometry import between, compose
from glassslam.outputs import RESULT_FILES, write_results
from glassslam.records import Imu, LaserScan, Odometry, RecordingInfo
from glassslam.slam.mapper import Mapper

PATH = drive((1.2, 0.8), (5.5, 0.8), (5.5, 4.2), (2.0, 4.2))


def run(records, config=None, **options):
    mapper = Mapper(config, **options)
    for record in records:
        mapper.add(record)
    return mapper.finish()


def errors(result, truth):
    """Distances of the trajectory from the true one, m, both seen from their first pose."""
    error = between(in_first_frame(truth), between(result.trajectory.poses[0], result.trajectory.poses))
    return np.hypot(error[:, 0], error[:, 1])


def off(result, truth):
    """Largest of those distances, m."""
    return float(errors(result, truth).max())


@pytest.fixture(scope="module")
def plain():
    """A short run with wheels that err, as it should be."""
    return recording(ROOM, PATH, odometry(PATH, scale=1.02, drift=0.02))


def scans_only(records):
    return [record for record in records if isinstance(record, LaserScan)]


class TestGoodRuns:
    def test_every_scan_gets_a_pose_in_the_order_of_the_recording(self, plain):
        result = run(plain)
        np.testing.assert_array_equal(
            result.trajectory.stamps, [record.stamp for record in scans_only(plain)]
        )
        assert off(result, PATH) < 0.05

    def test_nodes_lie_on_the_trajectory(self, plain):
        result = run(plain)
        at = np.searchsorted(result.trajectory.stamps, result.node_stamps)
        np.testing.assert_allclose(result.node_poses, result.trajectory.poses[at], atol=1e-9)
        assert result.submap_nodes == (0,)
        assert len(result.constraints) == len(result.node_poses) - 1

    def test_the_map_shows_the_room(self, plain):
        grid = run(plain).map
        occupied = grid.probability > 0.65
        rows, columns = np.nonzero(occupied)
        assert np.ptp(columns) * grid.resolution == pytest.approx(8.0, abs=0.25)
        assert np.ptp(rows) * grid.resolution == pytest.approx(5.0, abs=0.25)
        assert (grid.probability < 0.196).sum() * grid.resolution**2 == pytest.approx(38, abs=4)

    def test_the_statistics_tell_what_happened(self, plain):
        info = RecordingInfo(("a.bag",), "rosbag1", 10.0, len(PATH))
        mapper = Mapper()
        for record in plain:
            mapper.add(record)
        result = mapper.finish(info)
        statistics = result.statistics
        assert statistics.scans_read == statistics.scans_used == len(PATH)
        assert statistics.scans_dropped == statistics.messages_dropped == {}
        assert statistics.recording_seconds == pytest.approx(0.1 * (len(PATH) - 1))
        assert statistics.nodes == len(result.node_poses)
        assert statistics.submaps == len(result.submap_nodes) == 1
        assert set(statistics.stages) >= {"local SLAM", "rendering"}
        assert statistics.warnings == []
        assert result.info is info
        assert result.config == Config()

    def test_it_needs_no_odometry(self, plain):
        assert off(run(scans_only(plain)), PATH) < 0.05

    def test_yaw_rates_help_where_there_are_no_wheels(self):
        """A robot that starts to turn faster than scans can follow: 34 deg from one to the next."""
        poses = np.array([[2.0, 1.2, 0.0]] * 5 + [[2.0, 1.2, 0.6 * k] for k in range(12)])
        lidar, records, stamp = Lidar(ROOM), [], 0.0
        for k, pose in enumerate(poses):
            for j in range(10):
                rate = 6.0 if k >= 5 else 0.0
                records.append(Imu(stamp + 0.01 * j, rate))
            records.append(lidar.look(stamp, pose))
            stamp += 0.1
        result = run(records)
        turn = between(in_first_frame(poses), result.trajectory.poses)[:, 2]
        assert np.abs(turn).max() < 0.05

    def test_the_laser_may_sit_anywhere_on_the_robot(self):
        mount = np.array([0.25, -0.1, 2.5])
        seen_from = compose(PATH, np.broadcast_to(mount, PATH.shape))
        records = recording(ROOM, seen_from, None)
        result = run(records, base_from_laser=mount)
        assert off(result, PATH) < 0.05

    def test_a_loop_is_closed(self):
        truth = round_trip(1.15)[::2]
        records = recording(RING, truth, odometry(truth, scale=1.03, drift=0.02), beams=240)
        config = Config.from_mapping(
            {
                "sensor": {"max_range": 4.0},
                "submap": {"num_range_data": 30},
                "loop_closure": {"min_node_gap": 60},
                "optimization": {"optimize_every_n_nodes": 60},
            }
        )
        result = run(records, config)
        assert result.statistics.closures_accepted >= 1
        assert result.statistics.closures_tried >= result.statistics.closures_accepted
        disabled = config.loop_closure.model_copy(update={"enabled": False})
        left_open = run(records, config.model_copy(update={"loop_closure": disabled}))
        assert left_open.statistics.closures_tried == 0
        assert errors(result, truth)[-1] < 0.2
        assert errors(result, truth)[-1] < 0.6 * errors(left_open, truth)[-1]


class TestMotionInTheSweep:
    """A lidar that takes a tenth of a second to look around while the robot turns at 80 deg/s."""

    TWIST = np.array([0.3, 0.0, 1.4])

    def records(self, *, told):
        lidar, pose, out, truth = Lidar(ROOM, beams=720), np.array([3.5, 1.2, 0.0]), [], []
        for k in range(50):
            twist = self.TWIST if k > 5 else np.zeros(3)
            truth.append(pose)
            out.append(Odometry(0.1 * k, tuple(pose)))
            scan = lidar.look(0.1 * k, pose, twist=twist, sweep=0.1)
            out.append(scan if told else replace(scan, time_increment=0.0))
            pose = compose(pose, twist * 0.1)
        return out, np.array(truth)

    def test_it_is_undone_when_the_time_between_beams_is_known(self):
        told, truth = self.records(told=True)
        untold, _ = self.records(told=False)
        sharp, blurred = run(told), run(untold)
        assert off(sharp, truth) < 0.05
        assert off(sharp, truth) < off(blurred, truth)
        # the same walls in fewer cells
        assert (sharp.map.probability > 0.65).sum() < 0.9 * (blurred.map.probability > 0.65).sum()

    def test_a_lidar_that_stands_does_not_drift_away(self):
        """Without odometry the velocity that undoes motion is a guess; it must not feed on itself."""
        lidar = Lidar(ROOM, beams=240, noise=0.03)
        scans = [lidar.look(0.1 * k, (2.0, 1.0, 0.3), sweep=0.1) for k in range(120)]
        poses = run(scans).trajectory.poses
        assert np.hypot(poses[:, 0], poses[:, 1]).max() < 0.06
        assert np.abs(poses[:, 2]).max() < 0.04


class TestOddRecordings:
    def test_a_scan_before_any_odometry_is_placed_too(self, plain):
        first, *rest = scans_only(plain)[:1] + plain[2:]
        result = run([first, *rest])
        assert len(result.trajectory.stamps) == len(PATH)
        assert off(result, PATH) < 0.05

    def test_odometry_may_come_later_than_its_scan(self):
        wheels = odometry(PATH, scale=1.02)
        scans = recording(ROOM, PATH)
        records = []
        for k, scan in enumerate(scans):
            records.append(scan)
            if k >= 4:
                records.append(Odometry(scans[k - 4].stamp, tuple(wheels[k - 4])))
        result = run(records)
        assert off(result, PATH) < 0.05
        assert result.statistics.warnings == []

    def test_slow_scans_find_their_place_in_fast_odometry(self):
        """A scan a second, half a metre further each, and 500 odometry poses in between."""
        poses = np.array([[1.0 + 0.4 * k, 1.0, 0.0] for k in range(14)])
        lidar, records = Lidar(ROOM), []
        for k in range(14 * 500):
            share = k / 500
            records.append(Odometry(share, (0.4 * share, 0.0, 0.0)))
            if k % 500 == 0:
                records.append(lidar.look(share + 1e-4, poses[k // 500]))
        result = run(records)
        assert off(result, poses) < 0.05
        assert result.statistics.warnings == []

    def test_stamps_that_step_back_keep_the_order_of_the_file(self, plain):
        stepped = [
            replace(record, stamp=record.stamp - 50.0) if record.stamp > 105.0 else record for record in plain
        ]
        result = run(stepped)
        assert (np.diff(result.trajectory.stamps) < 0).sum() == 1
        assert off(result, PATH) < 0.05

    @pytest.mark.parametrize("late", [0.05, 0.25, 0.9])
    def test_single_late_stamps_do_no_harm(self, plain, late):
        records = [
            replace(record, stamp=record.stamp + late) if k % 40 in {30, 31} else record
            for k, record in enumerate(plain)
        ]
        assert off(run(records), PATH) < 0.05

    def test_equal_stamps_do_no_harm(self, plain):
        frozen = [replace(record, stamp=7.0) for record in scans_only(plain)]
        result = run(frozen)
        assert off(result, PATH) < 0.06
        assert result.statistics.recording_seconds == 0.0

    def test_odometry_of_another_clock_is_told(self, plain):
        records = [
            replace(record, stamp=record.stamp + 3600.0) if isinstance(record, Odometry) else record
            for record in plain
        ]
        result = run(records)
        assert off(result, PATH) < 0.05
        (warning,) = result.statistics.warnings
        assert warning == (
            f"odometry does not reach {len(PATH)} of {len(PATH)} scans: its stamps may be of another clock"
        )

    def test_odometry_that_is_reset_is_survived_and_told(self, plain):
        records = [
            replace(record, pose=(record.pose[0] + 500.0, record.pose[1] + 9.0, record.pose[2]))
            if isinstance(record, Odometry) and record.stamp > 106.0
            else record
            for record in plain
        ]
        result = run(records)
        assert off(result, PATH) < 0.05
        assert result.statistics.warnings == ["odometry jumped 1 times; those steps are not used"]

    def test_odometry_that_is_not_finite_is_dropped_and_counted(self, plain):
        records = [
            replace(record, pose=(math.nan, 0.0, 0.0))
            if isinstance(record, Odometry) and k % 20 == 10
            else record
            for k, record in enumerate(plain)
        ]
        result = run(records)
        assert off(result, PATH) < 0.05
        count = sum(isinstance(record, Odometry) and not math.isfinite(record.pose[0]) for record in records)
        assert result.statistics.messages_dropped == {"odometry not finite": count}

    @pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 0.0, -1.0])
    def test_invalid_beams_are_left_out(self, plain, value):
        records = []
        for scan in scans_only(plain):
            ranges = scan.ranges.copy()
            ranges[::3] = value
            records.append(replace(scan, ranges=ranges))
        result = run(records)
        assert off(result, PATH) < 0.1
        assert result.statistics.scans_dropped == {}

    def test_a_dark_stretch_is_bridged_by_odometry_and_told(self, plain):
        dark = range(60, 75)
        records = [
            replace(record, ranges=record.ranges * np.float32(np.nan))
            if isinstance(record, LaserScan) and k // 2 in dark
            else record
            for k, record in enumerate(plain)
        ]
        result = run(records)
        assert off(result, PATH) < 0.08
        assert result.statistics.warnings == [
            f"15 of {len(PATH)} scans had too few returns to match: their poses are predictions"
        ]

    def test_empty_and_senseless_scans_are_dropped_with_their_reason(self, plain):
        first = plain[1]
        records = [
            replace(first, ranges=np.empty(0, dtype=np.float32)),
            replace(first, ranges=np.empty(0, dtype=np.float32)),
            replace(first, stamp=math.nan),
            replace(first, angle_increment=0.0),
            *plain,
        ]
        statistics = run(records).statistics
        assert statistics.scans_dropped == {"angles not usable": 1, "no beams": 2, "stamp not finite": 1}
        assert statistics.scans_read == len(PATH) + 4
        assert statistics.scans_used == len(PATH)

    def test_beam_counts_may_change_from_scan_to_scan(self):
        records = [Lidar(ROOM, beams=200 + k % 7, seed=k).look(0.1 * k, pose) for k, pose in enumerate(PATH)]
        assert off(run(records), PATH) < 0.05

    def test_a_header_in_milliseconds_does_not_tear_scans_apart(self, plain):
        records = [replace(scan, time_increment=0.1 / 360 * 1000) for scan in scans_only(plain)]
        assert off(run(records), PATH) < 0.05

    def test_a_lidar_upside_down_turns_its_beams_the_other_way(self, plain):
        records = [
            replace(scan, ranges=scan.ranges[::-1].copy(), angle_min=np.pi - scan.angle_increment,
                    angle_increment=-scan.angle_increment)
            for scan in scans_only(plain)
        ]  # fmt: skip
        assert off(run(records), PATH) < 0.05

    def test_one_scan_is_a_map(self, plain):
        result = run(plain[1:2])
        assert result.trajectory.poses.shape == (1, 3)
        assert (result.map.probability > 0.5).sum() > 100


class TestNothingToMap:
    def test_no_records_at_all(self):
        with pytest.raises(NoScansError, match="no usable laser scan in the recording") as caught:
            Mapper().finish()
        assert caught.value.hint == "0 scans read; dropped: none"

    def test_no_usable_scan(self, plain):
        bad = replace(plain[1], stamp=math.nan)
        empty = replace(plain[1], ranges=np.empty(0, dtype=np.float32))
        with pytest.raises(NoScansError, match="no usable laser scan in the recording") as caught:
            run([bad, empty, bad])
        assert caught.value.hint == "3 scans read; dropped: 1 x no beams, 2 x stamp not finite"

    @pytest.mark.parametrize("value", [np.nan, np.inf, 0.0, -1.0, 99.0])
    def test_not_one_return(self, plain, value):
        scans = [replace(scan, ranges=np.full(360, value, np.float32)) for scan in scans_only(plain)[:30]]
        with pytest.raises(NoScansError, match="not one of 30 scans has a return") as caught:
            run(scans)
        assert caught.value.hint == "used are ranges the scans call valid, from 0 to 30 m"


def searching():
    return [thread for thread in threading.enumerate() if thread.name.startswith("loop-closing")]


@pytest.mark.parametrize("leave", ["close", "finish"])
def test_no_thread_is_left_behind(leave):
    truth = round_trip(1.15)[::4]
    config = Config.from_mapping(
        {
            "sensor": {"max_range": 4.0},
            "submap": {"num_range_data": 20},
            "loop_closure": {"min_node_gap": 10},
            "optimization": {"optimize_every_n_nodes": 60},
        }
    )
    before = set(searching())
    mapper = Mapper(config)
    for record in recording(RING, truth, odometry(truth), beams=180):
        mapper.add(record)
    started = set(searching()) - before
    assert started
    getattr(mapper, leave)()
    for thread in started:
        thread.join(60)
        assert not thread.is_alive()


def test_the_same_records_give_the_same_bytes(tmp_path):
    truth = round_trip(1.15)[::4]
    records = recording(RING, truth, odometry(truth, scale=1.02, drift=0.01), beams=180)
    config = Config.from_mapping(
        {
            "sensor": {"max_range": 4.0},
            "submap": {"num_range_data": 20},
            "loop_closure": {"min_node_gap": 40},
            "optimization": {"optimize_every_n_nodes": 60},
        }
    )
    for name in ("one", "two"):
        result = run(records, config)
        assert result.statistics.closures_tried > 0
        write_results(result, tmp_path / name)
    compared = set(RESULT_FILES) - {"report.json", "report.html"}
    assert {"map.pgm", "map.yaml", "map.png", "trajectory.tum", "graph.g2o", "config.yaml"} <= compared
    for name in compared:
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()
