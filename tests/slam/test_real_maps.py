"""Real recordings, where they are at hand: how good the maps are."""

import gzip
import json

import numpy as np
import pytest

import glassslam as gs
from glassslam.cli import main
from glassslam.evaluation import evaluate_relations, read_relations
from glassslam.outputs import RESULT_FILES, read_tum


def travelled(result):
    return np.hypot(*np.diff(result.trajectory.poses[:, :2], axis=0).T).sum()


def occupied(result):
    """Occupied cells (n, 2) in the map frame, m."""
    rows, columns = np.nonzero(result.map.probability > 0.65)
    return np.stack((columns, rows), axis=1) * result.map.resolution + result.map.origin


def test_the_first_scans_of_aces_through_the_command_line(data_dir, tmp_path):
    log = data_dir / "freiburg" / "aces.clf.gz"
    words = ["map", str(log), "-o", str(tmp_path / "out"), "--duration", "97", "--quiet"]
    assert main(words) == 0
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert 590 <= report["scans"]["used"] <= 620
    errors = evaluate_relations(
        read_tum(tmp_path / "out" / "trajectory.tum"), read_relations(log.with_name("aces.relations"))
    )
    assert errors.count > 80
    assert errors.translation.mean < 0.05
    assert errors.rotation.mean < 0.5


FIGURES = {
    "aces": (0.0375, 0.373),
    "mit-csail": (0.0319, 0.369),
    "intel": (0.0195, 0.364),
    "mit-killian": (0.0395, 0.352),
}


@pytest.mark.slow
@pytest.mark.parametrize("log", FIGURES)
def test_logs_are_mapped_as_accurately_as_the_best_known_result(data_dir, log):
    folder = data_dir / "freiburg"
    result = gs.map_recording(folder / f"{log}.clf.gz")
    errors = evaluate_relations(result.trajectory, read_relations(folder / f"{log}.relations"))
    translation, rotation = FIGURES[log]
    assert errors.unmatched == 0
    assert errors.translation.mean <= translation
    assert errors.rotation.mean <= rotation
    assert result.statistics.scans_dropped == {}


@pytest.mark.slow
def test_aces_twice_is_the_same_bytes(data_dir, tmp_path):
    log = data_dir / "freiburg" / "aces.clf.gz"
    for name in ("one", "two"):
        gs.write_results(gs.map_recording(log), tmp_path / name)
    for name in set(RESULT_FILES) - {"report.json", "report.html"}:
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()


def test_a_hallway_without_odometry_stays_straight(data_dir):
    """One wall and glass for 25 m: the robot leaves the straight line by less than the hallway is wide."""
    result = gs.map_recording(data_dir / "pimap" / "scene4.bag")
    assert len(result.trajectory.stamps) == 1264
    assert 27.0 < travelled(result) < 31.0
    walls = occupied(result)
    assert len(walls) > 450
    assert np.ptp(walls[:, 0]) < 34.0
    assert np.ptp(walls[:, 1]) < 10.0
    along = result.trajectory.poses[result.trajectory.poses[:, 0] < 25.0, :2]
    chord = along[-1] / np.hypot(*along[-1])
    assert np.abs(along @ np.array([-chord[1], chord[0]])).max() < 1.0


MOVING = {
    "ust10lx/localization_bag1_2022-03-29-19-23-29.bag": (281, (9, 11), (31, 37), 1500),
    "turtlebot3/rosbag2_2026_02_02-14_33_55_0.mcap": (549, (4, 6), (21, 31), 1200),
    "museum/b0-2014-07-21-12-42-53-tiny.bag": (222, (1, 2), (32, 36), 1500),
    "urg04/before1.bag": (770, (14, 16), (17, 22), 1500),
    "tiago/scan_lidar.bag": (274, (2.5, 4.5), (12, 14), 900),
    "glass_corridor/57068e0c49.bag": (45, (35, 41), (21, 58), 1900),
    "glass_corridor/67807dc50e.bag": (15, (6, 8), (17, 36), 700),
    "glass_corridor/ade451af16.bag": (28, (10, 12), (20, 42), 1000),
}
"""Scans, metres travelled, extent of the walls, occupied cells at least."""


@pytest.mark.parametrize("name", MOVING)
def test_recordings_of_many_robots_give_sensible_maps(data_dir, name):
    scans, (least, most), (shorter, longer), cells = MOVING[name]
    result = gs.map_recording(data_dir / name)
    walls = occupied(result)
    extent = np.sort(np.ptp(walls, axis=0))
    assert len(result.trajectory.stamps) == scans
    assert least < travelled(result) < most
    assert extent[0] < shorter
    assert extent[1] < longer
    assert len(walls) > cells
    assert np.isfinite(result.trajectory.poses).all()


STANDING = [
    "wall/lidar_calibration_0.5m_0.mcap",
    "wall/lidar_calibration_1m__0.mcap",
    "wall/lidar_calibration_1.5m__0.mcap",
    "wall/lidar_calibration_2m__0.mcap",
    "sick/20210125-tim781s-scandata.bag",
    "sick/20210301_lms511.bag",
    "sick/20210302_lms111.bag",
    "sick/rms_1xxx_lms_1xx_movement_off.bag",
    "ust10lx/rosbag2_2026_03_07-23_31_14_0.db3",
]


@pytest.mark.parametrize("name", STANDING)
def test_a_lidar_that_stands_stays_where_it_is(data_dir, name):
    result = gs.map_recording(data_dir / name)
    poses = result.trajectory.poses
    assert np.hypot(poses[:, 0], poses[:, 1]).max() < 0.08
    assert np.abs(poses[:, 2]).max() < 0.06
    assert len(occupied(result)) > 100


def test_a_log_cut_in_the_middle_of_a_line_is_mapped_as_far_as_it_goes(data_dir, tmp_path):
    whole = gzip.decompress((data_dir / "freiburg" / "mit-csail.clf.gz").read_bytes())
    cut = tmp_path / "cut.clf"
    cut.write_bytes(whole[:600_000])
    result = gs.map_recording(cut)
    assert len(result.trajectory.stamps) > 50
    assert travelled(result) > 5
