from dataclasses import replace

import numpy as np
import pytest
from tiny_scene import scene

from glassslam.errors import ConfigError, UsageError
from glassslam.geometry import compose, transform_points
from glassslam.records import LaserScan, Odometry
from glassslam.simulation import Scene, find_scene, lidar, simulate

QUIET = replace(lidar("ust10lx"), noise_floor=0.0, noise_slope=0.0, resolution=1e-6, scan_period=0.1)


def scans(simulation):
    return [record for record in simulation.records() if isinstance(record, LaserScan)]


def world_points(simulation, scan, *, deskewed):
    """Ends of the beams in the world, with the pose of every beam or with that of the first."""
    beam = np.arange(scan.ranges.size)
    time = scan.stamp - simulation.scene.start_time + beam * scan.time_increment * deskewed
    laser = compose(simulation.motion.at(time), np.array(simulation.scene.laser_pose))
    angle = laser[:, 2] + scan.angle_min + beam * scan.angle_increment
    return laser[:, :2] + scan.ranges[:, None] * np.stack((np.cos(angle), np.sin(angle)), axis=1)


def distance_to_room(points):
    x, y = points.T
    return np.min(np.abs([x, 6 - x, y, 6 - y]), axis=0)


def test_beams_end_on_the_walls_seen_from_the_true_pose_of_their_own_instant():
    simulation = simulate(scene(laser_pose=[0.2, 0.1, 0.5]), QUIET)
    for scan in scans(simulation)[::5]:
        assert distance_to_room(world_points(simulation, scan, deskewed=True)).max() < 2e-6


def test_a_moving_robot_distorts_its_scans():
    spin = {"waypoints": [{"at": [2, 3]}, {"at": [4, 3]}, {"at": [2, 3.1]}]}
    simulation = simulate(scene(drive=spin), QUIET)
    turning = np.abs(simulation.motion.yaw_rates).argmax() * 0.005
    scan = min(scans(simulation), key=lambda s: abs(s.stamp - simulation.scene.start_time - turning))
    assert distance_to_room(world_points(simulation, scan, deskewed=False)).max() > 0.01
    assert distance_to_room(world_points(simulation, scan, deskewed=True)).max() < 2e-6


def test_the_truth_is_the_pose_of_the_base_at_every_scan():
    simulation = simulate(scene(), "rplidar")
    found = scans(simulation)
    assert simulation.truth.stamps.tolist() == [scan.stamp for scan in found]
    times = simulation.truth.stamps - simulation.scene.start_time
    assert simulation.truth.poses == pytest.approx(simulation.motion.at(times))
    assert simulation.truth.poses[0] == pytest.approx([2, 3, 0])


def test_records_come_in_the_order_of_recording_and_scans_after_their_sweep():
    stream = list(simulate(scene(), "rplidar").records())
    recorded = [record.record_stamp for record in stream]
    assert recorded == sorted(recorded)
    for scan in (record for record in stream if isinstance(record, LaserScan)):
        assert scan.record_stamp > scan.stamp + 359 * scan.time_increment
    assert sum(isinstance(record, Odometry) for record in stream) > 100


def test_the_same_seed_gives_the_same_records_and_another_one_others():
    def ranges(seed):
        return np.concatenate([scan.ranges for scan in scans(simulate(scene(), "rplidar", seed))])

    assert ranges(5).tobytes() == ranges(5).tobytes()
    assert ranges(5).tobytes() != ranges(6).tobytes()


def test_odometry_does_not_depend_on_the_lidar():
    def poses(sensor):
        return [r.pose for r in simulate(scene(), sensor, 3).records() if isinstance(r, Odometry)]

    assert poses("rplidar") == poses("lms200")


def test_the_scene_says_which_lidar_is_carried():
    assert simulate(scene(sensor="lms200")).sensor.name == "lms200"


def test_a_path_through_a_wall_is_refused():
    through = {"waypoints": [{"at": [2, 3]}, {"at": [8, 3]}]}
    with pytest.raises(ConfigError) as caught:
        simulate(scene(drive=through))
    assert caught.value.message.startswith("drive: the robot comes within 0.0")
    assert caught.value.hint == "move a way point; its radius is 0.22 m"


def test_the_office_is_worth_mapping():
    simulation = simulate(Scene.load(find_scene("office")), scan_rate=1.0)
    assert 60.0 <= simulation.driven <= 100.0
    first, last = simulation.motion.poses[0, :2], simulation.motion.poses[-1, :2]
    assert np.hypot(*(last - first)) < 0.5
    assert len(set(simulation.plan.names)) > 30
    odometry = [r.pose for r in simulation.records() if isinstance(r, Odometry)]
    drift = np.hypot(*odometry[-1][:2])
    assert 0.3 < drift < 10.0, "without drift there is no loop to close"


@pytest.mark.parametrize(("rate", "hint"), [(41.0, "at most 40"), (0.0, "above 0"), (-1.0, "above 0")])
def test_a_rate_the_lidar_cannot_give_is_refused(rate, hint):
    with pytest.raises(UsageError) as caught:
        simulate(scene(), "ust10lx", scan_rate=rate)
    assert caught.value.message == f"a ust10lx does not give {rate:g} scans per second"
    assert hint in caught.value.hint


def test_the_rate_of_a_scene_is_only_a_limit():
    assert simulate(scene(scan_rate=10.0), "ust10lx").sensor.scan_period == pytest.approx(0.1)
    assert simulate(scene(scan_rate=10.0), "rplidar").sensor.scan_period == pytest.approx(1 / 5.8)
    assert simulate(scene(scan_rate=10.0), "ust10lx", scan_rate=20.0).sensor.scan_period == pytest.approx(
        0.05
    )


def test_points_of_the_office_lie_on_its_walls():
    simulation = simulate(Scene.load(find_scene("office")), replace(QUIET, scan_period=10.0))
    a, b = simulation.plan.segments[:, None, :2], simulation.plan.segments[:, None, 2:]
    for scan in scans(simulation)[:3]:
        points = world_points(simulation, scan, deskewed=True)[np.isfinite(scan.ranges)]
        f = np.clip(((points - a) * (b - a)).sum(-1) / ((b - a) ** 2).sum(-1), 0, 1)[..., None]
        assert np.hypot(*np.moveaxis(a + f * (b - a) - points, -1, 0)).min(axis=0).max() < 1e-5


def test_transforming_by_the_truth_agrees_with_the_geometry_of_the_package():
    simulation = simulate(scene(), replace(QUIET, time_increment=0.0))
    scan, pose = scans(simulation)[0], simulation.truth.poses[0]
    angle = scan.angle_min + np.arange(scan.ranges.size) * scan.angle_increment
    points = scan.ranges[:, None] * np.stack((np.cos(angle), np.sin(angle)), axis=1)
    assert distance_to_room(transform_points(pose, points)).max() < 2e-6
