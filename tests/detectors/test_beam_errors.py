"""Errors of the beams as plain data: written, read back, and every damage named."""

from dataclasses import replace

import pytest
import yaml

from detectors.beam_errors import NAMES, BeamErrors
from detectors.calibration import Calibration
from detectors.diffuse import DiffuseCurve

FOUND = BeamErrors(0.008, 0.002, -0.023, -0.005, (0.0004, 0.001, 0.0009, 0.001), 685, 0.004, 0.0037)
LIDAR = Calibration("mine", DiffuseCurve((1.0,), (900.0,)), beam_errors=FOUND)


def test_a_calibration_keeps_them_when_written_as_yaml():
    assert Calibration.from_dict(yaml.safe_load(yaml.safe_dump(LIDAR.to_dict()))) == LIDAR


def test_a_calibration_without_them_says_so():
    plain = replace(LIDAR, beam_errors=None).to_dict()
    assert plain["beam_errors"] is None
    assert Calibration.from_dict(plain).beam_errors is None


def test_they_are_named_as_the_configuration_names_them():
    assert FOUND.settings == dict(zip(NAMES, (0.008, 0.002, -0.023, -0.005), strict=True))


def test_three_standard_deviations_are_significant():
    assert FOUND.significant == ("bearing_cosine", "lateral_offset", "range_offset")
    assert replace(FOUND, sigma=(0.01, 0.001, 0.1, 0.1)).significant == ()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"bearing_cosine": "x"}, "beam_errors.bearing_cosine is no number: 'x'"),
        ({"lateral_offset": 0.3}, r"beam_errors.lateral_offset is not from -0.2 to 0.2: 0.3"),
        ({"bend_before": -1.0}, "beam_errors.bend_before is not 0 or more: -1.0"),
        ({"walls": 1.5}, "beam_errors.walls is no whole number of 0 or more: 1.5"),
        ({"sigma": 1.0}, "beam_errors.sigma is no list of numbers: 1.0"),
        ({"sigma": [1.0, 2.0]}, "beam_errors.sigma has 2 numbers, not 4"),
        ({"sigma": [0.0, 0.0, 0.0, -1.0]}, r"beam_errors.sigma\[3\] is not 0 or more: -1.0"),
        ({"turn": 1.0}, "not a calibration: there is no 'beam_errors.turn'; known are bearing_cosine"),
    ],
)
def test_damaged_errors_are_named(changes, message):
    with pytest.raises(ValueError, match=message):
        Calibration.from_dict(LIDAR.to_dict() | {"beam_errors": FOUND.to_dict() | changes})


@pytest.mark.parametrize("name", [*NAMES, "sigma", "walls", "bend_before", "bend_after"])
def test_they_are_whole_or_absent(name):
    partly = {key: value for key, value in FOUND.to_dict().items() if key != name}
    with pytest.raises(ValueError, match=f"a calibration needs 'beam_errors.{name}'"):
        Calibration.from_dict(LIDAR.to_dict() | {"beam_errors": partly})


def test_errors_that_are_no_mapping():
    with pytest.raises(ValueError, match="beam_errors is no mapping of names: 3"):
        Calibration.from_dict(LIDAR.to_dict() | {"beam_errors": 3})
