"""A simulated robot maps a storeroom by itself: tables and lamps are where its own map has them."""

import numpy as np
import pytest
from volume_worlds import STOREROOM_EDGES, line, occupied_share

import glassslam as gs
from glassslam.geometry import inverse, transform_points
from glassslam.outputs.volume_maps import write_volume_maps
from glassslam.simulation import Scene, find_scene, simulate, write_recording

# the pallet is 0.14 m high
CONFIG = gs.Config.from_mapping({"volume": {"band_low": 0.05}})
SCENE = Scene.load(find_scene("storeroom"))


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    path = tmp_path_factory.mktemp("storeroom") / "storeroom.bag"
    write_recording(simulate(SCENE, seed=1), path)
    return path


@pytest.fixture(scope="module")
def result(bag, tmp_path_factory):
    """The run, with its session."""
    path = tmp_path_factory.mktemp("session") / "session.db"
    with gs.Session.create(path, [bag], CONFIG) as session:
        return gs.map_recording(bag, CONFIG, session=session), path


@pytest.fixture(scope="module")
def to_map(bag):
    """World coordinates (n, 2) in the frame of the map, which is that of the first pose."""
    start = gs.read_tum(bag.with_name("storeroom.bag.truth.tum")).poses[0]
    return lambda points: transform_points(inverse(start), np.asarray(points, dtype=np.float64))


@pytest.mark.parametrize("thing", STOREROOM_EDGES)
def test_what_hangs_over_the_lidar_or_lies_below_it_is_in_the_map_of_the_volume(result, to_map, thing):
    made, edge = result[0], to_map(STOREROOM_EDGES[thing])
    assert occupied_share(made.volume.map, edge) >= 0.9
    assert occupied_share(made.map, edge) <= 0.1


def test_glass_that_the_lidar_sees_through_is_there(result, to_map):
    panes = to_map(line((1.7, 0.0), (5.3, 0.0)))
    assert occupied_share(result[0].volume.map, panes) > 0.9
    assert occupied_share(result[0].lidar_map, panes) < 0.3


def test_the_height_of_the_lidar_is_that_of_the_recording(result):
    made = result[0]
    assert made.info.laser_height == pytest.approx(SCENE.laser_height)
    assert made.volume.lidar_height == pytest.approx(SCENE.laser_height)
    assert made.info.points_topics == ("/ultrasonic",)


def test_nothing_is_left_out(result):
    made = result[0]
    assert made.volume.dropped == {}
    assert made.volume.counts["scans"] == made.volume.counts["pairs"] == len(made.nodes)
    assert made.volume.counts["point_sets"] == 493


def test_the_path_of_the_robot_is_free_below_its_height(result):
    made = result[0]
    path = made.trajectory.poses[::5, :2]
    below = made.volume.tree.log_odds_at(np.column_stack((path, np.full(len(path), 0.27))))
    assert (below < 0.0).mean() > 0.95


def test_the_session_draws_the_same_volume_again(result, tmp_path):
    made, path = result
    with gs.Session.open(path) as session:
        again = session.load().result()
    folders = tmp_path / "one", tmp_path / "two"
    for folder, run in zip(folders, (made, again), strict=True):
        folder.mkdir()
        names = {file.name for file in write_volume_maps(run, folder)}
    for name in names:
        assert (folders[0] / name).read_bytes() == (folders[1] / name).read_bytes(), name


def test_a_session_draws_a_volume_with_other_parameters(result):
    with gs.Session.open(result[1]) as session:
        run = session.load()
    config = gs.Config.from_mapping({"volume": {"resolution": 0.1, "band_low": 0.6, "band_high": 0.9}})
    other = run.with_config(config).result().volume
    assert (other.tree.resolution, other.band) == (0.1, (0.6, 0.9))
    assert len(other.tree.occupied()) < len(result[0].volume.tree.occupied())
