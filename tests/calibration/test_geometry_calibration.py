"""`calibrate --geometry`: the errors of the beams become a part of the calibration."""

from dataclasses import replace

import numpy as np
import pytest
from crooked_lidar import walk
from pane_recordings import T0, driving, standing

from detectors.beam_errors import BeamErrors
from detectors.calibration import Calibration
from detectors.diffuse import DiffuseCurve
from glassslam.api import map_recording
from glassslam.calibration import Session, calibrate, read_calibration, write_calibration
from glassslam.calibration.geometry import find_beam_errors, geometry_advice
from glassslam.calibration.mapped import mapping_config
from glassslam.cli.settings import calibration_assignments, resolve_config
from glassslam.errors import CalibrationError
from glassslam.evaluation import evaluate_glass
from glassslam.simulation.rosbag1 import write_rosbag1
from glassslam.slam.beam_errors import errors_of

TRUE = (0.008, 0.002, -0.023, -0.005)


def hall(path, *, steps=60, echoing=True):
    """A recording of a low-cost lidar: whole degrees, crooked beams, intensities that fall with range."""
    random = np.random.default_rng(1)
    scans = []
    for scan in walk(TRUE, noise=0.003, steps=steps):
        levels = 200.0 / np.maximum(scan.ranges, 1.0) * (1.0 + random.normal(0.0, 0.03, len(scan.ranges)))
        intensities = levels.astype(np.float32) if echoing else np.empty(0, np.float32)
        scans.append(replace(scan, stamp=T0 + scan.stamp, intensities=intensities))
    write_rosbag1(scans, path)
    return path


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    return calibrate([Session(hall(tmp_path_factory.mktemp("hall") / "hall.bag"))], geometry=True)


def estimated(errors):
    return np.array(list(errors.settings.values()))


def test_the_errors_of_the_beams_are_in_the_calibration(made):
    errors = made.calibration.beam_errors
    assert estimated(errors) == pytest.approx(TRUE, abs=2e-3)
    assert errors.walls > 100
    assert errors.bend_after < 0.9 * errors.bend_before
    assert made.calibration.detector == "narrow_return"


def test_they_are_rounded_to_what_can_be_read(made):
    for value in made.calibration.beam_errors.settings.values():
        assert value == round(value, 6)


def test_without_being_asked_for_they_are_absent(tmp_path):
    plain = calibrate([Session(hall(tmp_path / "hall.bag", steps=20))])
    assert plain.calibration.beam_errors is None
    assert not any("beams:" in text for text in plain.warnings)


def test_the_file_gives_them_to_the_configuration(made, tmp_path):
    write_calibration(made, tmp_path / "out")
    assert read_calibration(tmp_path / "out") == made.calibration
    config = resolve_config(None, calibration_assignments(tmp_path / "out", None))
    assert errors_of(config.sensor).tolist() == list(made.calibration.beam_errors.settings.values())


def test_all_recordings_count(tmp_path):
    bag = hall(tmp_path / "hall.bag")
    once, twice = (find_beam_errors([Session(bag)] * count) for count in (1, 2))
    assert twice.walls == 2 * once.walls


def test_a_lidar_without_intensities_has_a_geometry(tmp_path):
    bag = hall(tmp_path / "silent.bag", echoing=False)
    made = calibrate([Session(bag)], geometry=True)
    assert estimated(made.calibration.beam_errors) == pytest.approx(TRUE, abs=2e-3)
    assert (made.calibration.detector, made.calibration.informative) == ("off", False)
    assert not made.has_curve
    assert made.warnings[0] == ("silent.bag: the recording has no intensities; glass cannot be told by them")
    assert [row.scans for row in made.recordings] == [60]
    assert all(path.stat().st_size > 500 for path in write_calibration(made, tmp_path / "out"))
    assert read_calibration(tmp_path / "out") == made.calibration


def test_but_not_without_being_asked_for(tmp_path):
    with pytest.raises(CalibrationError, match=r"silent\.bag: the recording has no intensities") as caught:
        calibrate([Session(hall(tmp_path / "silent.bag", steps=5, echoing=False))])
    assert caught.value.hint == (
        "a lidar is calibrated for glass by its intensities; without, --geometry can be calibrated"
    )


def test_a_stated_pane_needs_intensities_all_the_same(tmp_path):
    bag = hall(tmp_path / "silent.bag", steps=5, echoing=False)
    with pytest.raises(CalibrationError, match=r"silent\.bag: the recording has no intensities"):
        calibrate([Session(bag, "glass", 1.0)], geometry=True)


def test_a_robot_that_stands_sees_too_few_walls(tmp_path):
    with pytest.raises(CalibrationError) as caught:
        calibrate([Session(standing(tmp_path / "one.bag"), "glass", 1.0)], geometry=True)
    assert caught.value.message.startswith("the errors of the beams cannot be told: ")
    assert caught.value.message.endswith(" straight walls seen, 100 are needed")
    assert caught.value.hint == "record while driving through rooms or a corridor, or leave out --geometry"


def test_errors_that_no_lidar_has_are_refused(tmp_path, monkeypatch):
    wild = BeamErrors(0.3, 0.0, 0.0, 0.0, (0.1,) * 4, 500, 0.1, 0.1)
    monkeypatch.setattr("glassslam.calibration.geometry.estimate_beam_errors", lambda scans: wild)
    with pytest.raises(CalibrationError, match=r"cannot be told: more than 0\.2 rad or m come out"):
        find_beam_errors([Session(tmp_path / "any.bag")])


SURE = BeamErrors(0.008, 0.002, -0.023, -0.005, (0.0004, 0.001, 0.0009, 0.001), 685, 0.004, 0.0037)


@pytest.mark.parametrize(
    ("changes", "warnings"),
    [
        ({}, []),
        ({"walls": 299}, ["errors of the beams: 299 walls only; from 300 on they are sure"]),
        (
            {"sigma": (0.1,) * 4},
            ["errors of the beams: none reaches 3 standard deviations; calibrate without --geometry"],
        ),
        (
            {"bend_after": 0.00396},
            [
                "errors of the beams: they take 1.0% of the bend away, which door frames and turning do as "
                "well: unless maps bend, calibrate without --geometry"
            ],
        ),
    ],
)
def test_doubts_are_told(changes, warnings):
    assert list(geometry_advice(replace(SURE, **changes))) == warnings


def test_nothing_asked_for_is_nothing_to_doubt():
    assert list(geometry_advice(None)) == []


def test_recordings_with_stated_panes_are_mapped_with_corrected_beams():
    lidar = Calibration("mine", DiffuseCurve((1.0,), (900.0,)), beam_errors=SURE)
    assert mapping_config(lidar, align=False).sensor.lateral_offset == -0.023
    assert mapping_config(lidar, align=False).glass.detector == "off"
    assert mapping_config(replace(lidar, beam_errors=None), align=True).sensor.lateral_offset == 0.0
    assert mapping_config(lidar, align=True).glass.calibration["sensor"] == "mine"


def test_the_calibration_a_run_has_made_of_itself_finds_the_same_again(tmp_path):
    """Written with the results, looked at, and given to the next run."""
    from glassslam.outputs import write_results

    bag = driving(tmp_path / "run.bag")
    first = map_recording(bag)
    assert (first.statistics.glass_detector, first.glass.calibration is None) == ("calibrated_peak", False)
    write_results(first, tmp_path / "run")
    learnt = read_calibration(tmp_path / "run" / "calibration.yaml")
    assert (learnt.sensor, learnt.date, learnt.detector) == ("run", "2020-09-13", "calibrated_peak")
    assert learnt.evidence["recordings"] == ["run.bag"]
    again = map_recording(bag, resolve_config(None, calibration_assignments(tmp_path / "run", None)))
    assert again.glass.calibration is None
    ((wall,), (other,)) = (run.glass.walls for run in (first, again))
    assert np.concatenate((other.start, other.end)) == pytest.approx(
        np.concatenate((wall.start, wall.end)), abs=0.02
    )


@pytest.mark.slow
def test_the_glass_of_a_bent_hallway_is_found_where_it_is(data_dir, tmp_path):
    """No pane is known in the recording; without the geometry its map bends by eight degrees."""
    bag = data_dir / "pimap" / "scene4.bag"
    write_calibration(calibrate([Session(bag)], geometry=True), tmp_path / "made")
    result = map_recording(bag, resolve_config(None, calibration_assignments(tmp_path / "made", None)))
    walls = [np.array([[wall.start, wall.end]]) for wall in result.glass.walls]
    ends = np.array([4.2, 27.0])
    truth = [np.stack((ends, 1.22 + 0.0036 * ends), axis=1)[None]]
    errors = evaluate_glass(walls, truth, align=True)
    within = {band.tolerance: band.found_percent for band in errors.within}
    assert within[0.15] > 85.0
    assert errors.false_length < 0.5
