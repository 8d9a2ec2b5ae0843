"""A calibration at work: in the configuration, in the detector, on recordings it was not made from."""

import numpy as np
import pytest
import yaml
from pane_recordings import STEP, bearings, driving, scan_at, standing

from detectors.profiles import load_profile
from glassslam.api import map_recording
from glassslam.calibration import Roi, Session, calibrate
from glassslam.config import Config
from glassslam.errors import ConfigError
from glassslam.evaluation import evaluate_glass, read_true_glass
from glassslam.slam.glass_detectors import make_detector


def glass(**values):
    return {"glass": {"detector": "calibrated_peak", **values}}


def test_a_configuration_holds_the_whole_calibration():
    config = Config.from_mapping(glass(calibration=load_profile("ust10lx").to_dict()))
    again = Config.from_mapping(yaml.safe_load(config.dump()))
    assert again == config
    assert config.glass.calibration["no_echo"] == 65.533


def test_what_is_left_out_is_completed():
    short = {"sensor": "mine", "diffuse": {"ranges": [1], "levels": [900]}}
    config = Config.from_mapping(glass(calibration=short))
    assert config.glass.calibration["faint"] == 0.45


def test_a_wrong_entry_is_named():
    with pytest.raises(ConfigError) as caught:
        Config.from_mapping(glass(calibration={"sensor": "x", "diffuse": {"ranges": [1], "levels": ["a"]}}))
    assert caught.value.message == ("configuration: glass.calibration: diffuse.levels[0] is no number: 'a'")


def mine(beams=541, step=STEP, **changes):
    plain = load_profile("utm30lx").to_dict() | {
        "sensor": "mine",
        "beams": beams,
        "angle_increment": float(step),
    }
    return plain | changes


def detector(**values):
    return make_detector(Config.from_mapping(glass(**values)).glass)


def test_the_calibration_goes_before_the_named_sensor():
    facing = scan_at((1.5, 0.0, 0.0), pane_x=2.5)
    assert len(detector(calibration=mine(), sensor="lms511")(facing)) > 0
    # in the unit of the LMS511 the pane is a hundred times as bright as a wall
    assert len(detector(sensor="lms511")(facing)) == 0


def test_the_first_scan_must_be_of_the_sensor():
    coarse = scan_at((0, 0, 0), angles=bearings(270, step=np.radians(1.0)))
    with pytest.raises(ConfigError) as caught:
        detector(calibration=mine())(coarse)
    assert caught.value.message == (
        "glass.calibration: the calibration of mine is for steps of 0.008727 rad, the recording has 0.017453"
    )
    assert caught.value.hint == "calibrate this sensor, or map without the calibration"


def test_beams_may_be_fewer_but_not_more():
    assert detector(calibration=mine(beams=600))(scan_at((0, 0, 0))) is not None
    with pytest.raises(ConfigError, match="is for 500 beams, the recording has 541"):
        detector(calibration=mine(beams=500))(scan_at((0, 0, 0)))


def test_a_sensor_that_varies_is_not_checked():
    coarse = scan_at((0, 0, 0), angles=bearings(270, step=np.radians(1.0)))
    assert detector(calibration=mine(beams=0, step=0.0))(coarse) is not None


def test_a_run_stops_at_its_first_scan(tmp_path):
    bag = standing(tmp_path / "run.bag", count=3)
    with pytest.raises(ConfigError, match=r"glass.calibration: the calibration of utm30lx"):
        map_recording(bag, Config.from_mapping(glass(calibration=load_profile("utm30lx").to_dict())))


def test_calibrated_on_one_recording_the_pane_of_another_is_mapped(tmp_path):
    made = calibrate([Session(standing(tmp_path / "one.bag", 1.0), "glass", 1.0)])
    config = Config.from_mapping(glass(calibration=made.calibration.to_dict()))
    result = map_recording(driving(tmp_path / "other.bag"), config)
    walls = [np.array([[wall.start, wall.end]]) for wall in result.glass.walls]
    errors = evaluate_glass(walls, [np.array([[[2.0, -0.3], [2.0, 1.3]]])])
    assert errors.within[0].found_percent > 90.0
    assert errors.false_length < 0.1


def test_a_real_corridor_with_a_calibration_from_other_runs(data_dir):
    """Found and false length as required of the corridor; the calibration has not seen this run."""
    folder = data_dir / "glass_corridor"
    made = calibrate(
        [
            Session(folder / "67807dc50e.bag", "glass", 1.1, roi=Roi.parse("-115:-60")),
            Session(folder / "ade451af16.bag", "no-glass"),
            Session(folder / "fd2df1b87f.bag", "no-glass"),
        ]
    )
    shipped = load_profile("utm30lx")
    assert made.calibration.diffuse.level(1.2) == pytest.approx(shipped.diffuse.level(1.2), rel=0.03)
    assert made.calibration.pane.decay == pytest.approx(shipped.pane.decay, rel=0.05)
    config = Config.from_mapping(glass(calibration=made.calibration.to_dict()))
    result = map_recording(folder / "57068e0c49.bag", config)
    walls = [np.array([[wall.start, wall.end]]) for wall in result.glass.walls]
    errors = evaluate_glass(walls, read_true_glass(folder / "glass_line_approx.json"), align=True)
    assert errors.within[0].found_percent >= 95.0
    assert errors.false_length < 0.5


def test_real_matte_walls_at_four_distances(data_dir):
    stated = {"0.5m_0": 0.5, "1m__0": 1.0, "1.5m__0": 1.5, "2m__0": 2.0}
    made = calibrate(
        [
            Session(data_dir / "wall" / f"lidar_calibration_{name}.mcap", "matte", distance)
            for name, distance in stated.items()
        ]
    )
    for row in made.recordings:
        assert row.measured == pytest.approx(row.distance, abs=0.03)
        assert row.with_surface == row.scans
    assert made.calibration.diffuse.ranges[0] < 0.6
    assert made.calibration.diffuse.ranges[-1] > 2.0
    assert "intensities saturate at 234" in made.warnings
