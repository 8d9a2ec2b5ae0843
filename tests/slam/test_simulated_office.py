"""The simulated office, whose truth is known to the millimetre."""

import pytest

import glassslam as gs
from glassslam.outputs import RESULT_FILES
from glassslam.simulation import Scene, find_scene, simulate, write_recording


@pytest.fixture(scope="module")
def office():
    """90 m through offices, 5.8 scans a second, each swept over a sixth of one."""
    return simulate(Scene.load(find_scene("office")), "rplidar", seed=3)


@pytest.fixture(scope="module")
def bag(office, tmp_path_factory):
    return write_recording(office, tmp_path_factory.mktemp("office") / "office.bag").bag


@pytest.mark.parametrize("odometry", [None, "none"], ids=["with odometry", "without odometry"])
def test_the_trajectory_is_true_to_three_centimetres(office, bag, odometry):
    result = gs.map_recording(bag, source_options=gs.SourceOptions(odom_topic=odometry))
    errors = gs.absolute_trajectory_error(result.trajectory, office.truth)
    assert errors.count == len(office.truth.stamps)
    assert errors.translation.rmse < 0.03
    assert errors.translation.max < 0.12
    assert errors.rotation.rmse < 1.0
    assert result.statistics.closures_accepted > 3
    assert result.statistics.scans_dropped == {}
    assert result.statistics.warnings == []


def test_the_map_is_as_large_as_the_building(office, bag):
    grid = gs.map_recording(bag).map
    walls = office.plan.segments.reshape(-1, 2)
    width, height = walls.max(axis=0) - walls.min(axis=0)
    occupied = (grid.probability > 0.65).nonzero()
    assert (occupied[1].max() - occupied[1].min()) * grid.resolution < width * 1.1 + 0.3
    assert (occupied[0].max() - occupied[0].min()) * grid.resolution < height * 1.1 + 0.3
    assert len(occupied[0]) > 1500


def test_two_runs_write_the_same_bytes(bag, tmp_path):
    for name in ("one", "two"):
        gs.write_results(gs.map_recording(bag), tmp_path / name)
    for name in set(RESULT_FILES) - {"report.json", "report.html"}:
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()
