"""Glass in whole runs: a real corridor, logs that have no glass to tell of, buildings with a known truth."""

import numpy as np
import pytest

import glassslam as gs
from glassslam.evaluation.glass import evaluate_glass
from glassslam.evaluation.glass_lines import read_true_glass
from glassslam.simulation import Scene, find_scene, simulate, write_recording


def walls(result):
    return [np.array([[wall.start, wall.end]]) for wall in result.glass.walls]


def test_a_real_corridor_is_closed_without_a_word_about_its_lidar(data_dir):
    folder = data_dir / "glass_corridor"
    result = gs.map_recording(folder / "57068e0c49.bag")
    truth = read_true_glass(folder / "glass_line_approx.json")
    errors = evaluate_glass(walls(result), truth, align=True)
    assert errors.within[0].found_percent > 95.0
    assert errors.false_length < 0.5


def test_without_intensities_a_run_is_the_same_to_the_last_bit(data_dir):
    log = data_dir / "freiburg" / "mit-csail.clf.gz"
    runs = [
        gs.map_recording(
            log,
            gs.Config.from_mapping({"glass": {"detector": detector}}),
            source_options=gs.SourceOptions(duration=120.0),
        )
        for detector in ("auto", "off")
    ]
    looked, not_asked = runs
    assert looked.statistics.glass_reason == "the recording has no intensities"
    assert looked.glass is None
    assert looked.map.probability.tobytes() == not_asked.map.probability.tobytes()
    assert looked.trajectory.poses.tobytes() == not_asked.trajectory.poses.tobytes()


@pytest.mark.parametrize(
    "recording", ["museum/b0-2014-07-21-12-42-53-tiny.bag", "sick/20210125-tim781s-scandata.bag"]
)
def test_where_no_glass_is_known_none_is_found(data_dir, recording):
    result = gs.map_recording(data_dir / recording)
    assert result.statistics.glass_detector == "calibrated_peak"
    assert result.glass.walls == ()


def recorded(name, folder):
    """A shipped scene as a recording, with its true glass."""
    written = write_recording(simulate(Scene.load(find_scene(name)), "utm30lx"), folder / f"{name}.bag")
    return folder / f"{name}.bag", read_true_glass(written.true_glass)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["glass_building_1", "glass_building_2"])
def test_buildings_of_glass(name, tmp_path):
    bag, truth = recorded(name, tmp_path)
    errors = evaluate_glass(walls(gs.map_recording(bag)), truth)
    assert errors.within[0].found_percent > 97.0
    assert errors.false_length < 7.0


@pytest.mark.slow
def test_a_building_without_glass_but_with_traps(tmp_path):
    bag, truth = recorded("no_glass_building", tmp_path)
    assert evaluate_glass(walls(gs.map_recording(bag)), truth).false_length < 0.5


@pytest.mark.parametrize("scheme", ["off", "local", "global", "lite", "anchored"])
def test_every_scheme_locks_what_it_should(data_dir, scheme):
    bag = data_dir / "glass_corridor" / "57068e0c49.bag"
    glass = {"scheme": scheme, "detector": "calibrated_peak", "sensor": "utm30lx"}
    result = gs.map_recording(bag, gs.Config.from_mapping({"glass": glass}))
    cells = result.glass.locked_cells
    assert (len(cells) > 0) == (scheme != "off")
    columns, rows = np.floor((cells - np.asarray(result.map.origin)) / result.map.resolution).astype(int).T
    assert (result.map.probability[rows, columns] > 0.65).all()
