"""A simulated robot with a lidar and a 3D ultrasonic sensor: what each finds, and what the map gains."""

import numpy as np
import pytest
from volume_worlds import STOREROOM_EDGES, line, occupied_share

from glassslam.geometry import inverse, transform_points
from glassslam.records import LaserScan, PointSet, Trajectory
from glassslam.simulation import Scene, find_scene, simulate
from glassslam.volume.mapper import build_volume
from glassslam.volume.options import VolumeOptions
from glassslam.volume.projection import project

BAND = (0.05, 1.8)


@pytest.fixture(scope="module")
def storeroom():
    """The shipped scene, recorded, and its volume in the world frame along the true trajectory."""
    scene = Scene.load(find_scene("storeroom"))
    simulation = simulate(scene, seed=1)
    options = VolumeOptions(lidar_height=scene.laser_height)
    records = list(simulation.records())
    return scene, build_volume(records, simulation.truth, options, scene.laser_pose), records, simulation


@pytest.mark.parametrize(
    ("thing", "share"), [("table top", 0.9), ("shelf", 0.9), ("lamp", 0.9), ("pallet", 0.9)]
)
def test_the_fused_map_holds_what_the_lidar_cannot_see(storeroom, thing, share):
    _, volume, _, _ = storeroom
    assert occupied_share(project(volume.fused, BAND), STOREROOM_EDGES[thing]) >= share
    assert occupied_share(project(volume.lidar, BAND), STOREROOM_EDGES[thing]) <= 0.1


@pytest.mark.parametrize(
    ("thing", "low", "high"), [("table top", 0.6, 0.85), ("lamp", 1.1, 1.6), ("pallet", 0.0, 0.25)]
)
def test_things_are_found_at_their_height(storeroom, thing, low, high):
    _, volume, _, _ = storeroom
    at_height = project(volume.fused, (low, high))
    elsewhere = project(volume.fused, (1.65, 2.0) if thing == "lamp" else (1.0, 1.1))
    assert occupied_share(at_height, STOREROOM_EDGES[thing]) >= 0.6
    assert occupied_share(elsewhere, STOREROOM_EDGES[thing]) <= 0.2


def test_the_glass_front_is_in_the_fused_map_where_the_lidar_sees_through(storeroom):
    _, volume, _, _ = storeroom
    panes = line((1.7, 0.0), (5.3, 0.0))
    assert occupied_share(project(volume.fused, BAND), panes) > 0.95
    assert occupied_share(project(volume.lidar, BAND), panes) < 0.3


def test_walls_stay_where_the_lidar_has_them(storeroom):
    _, volume, _, _ = storeroom
    for wall in (line((0.5, 5.0), (6.5, 5.0)), line((7.0, 0.5), (7.0, 4.5))):
        assert occupied_share(project(volume.fused, BAND), wall) > 0.98


def test_little_is_found_where_there_is_nothing(storeroom):
    scene, volume, _, simulation = storeroom
    # the robot itself was everywhere along its path
    path = simulation.motion.poses[::50, :2]
    assert occupied_share(project(volume.fused, (0.1, 0.6)), path) < 0.02
    driven = project(volume.fused, (0.1, 1.1))
    column, row = np.floor((path - driven.origin) / driven.resolution).astype(int).T
    assert (driven.probability[row, column] < 0.196).mean() > 0.95
    voxels = volume.fused.centres(volume.fused.occupied().voxels())
    assert voxels[:, 2].min() > -0.25
    assert voxels[:, 2].max() < scene.ceiling + 0.2


def test_every_ping_has_a_scan_beside_it_or_none(storeroom):
    _, volume, records, _ = storeroom
    scans = sum(isinstance(r, LaserScan) for r in records)
    pings = sum(isinstance(r, PointSet) for r in records)
    assert (volume.counts["scans"], volume.counts["point_sets"]) == (scans, pings)
    assert volume.counts["pairs"] == scans
    assert volume.dropped == {}


def test_a_volume_in_the_frame_of_a_run_is_the_same_volume_moved(storeroom):
    scene, _, records, simulation = storeroom
    start = simulation.truth.poses[0]
    moved = simulation.truth.poses.copy()
    moved[:, :2] = transform_points(inverse(start), moved[:, :2])
    moved[:, 2] -= start[2]
    again = build_volume(
        records, Trajectory(simulation.truth.stamps, moved),
        VolumeOptions(lidar_height=scene.laser_height), scene.laser_pose,
    )  # fmt: skip
    far_corner = transform_points(inverse(start), line((3.0, 3.95), (4.0, 3.95)))
    assert occupied_share(project(again.fused, BAND), far_corner) > 0.9
