"""`glassslam calibrate` and `map --calibration`: what they pass on, print and return."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

import glassslam.calibration
from detectors.beam_errors import BeamErrors
from detectors.diffuse_fit import SurfaceSamples
from detectors.profiles import load_profile
from glassslam.calibration import CalibrationResult, RecordingSummary
from glassslam.cli import main
from glassslam.cli.calibrate_tables import value_rows
from glassslam.cli.settings import calibration_assignments, calibration_warnings, resolve_config
from glassslam.errors import ConfigError


@pytest.fixture
def result():
    none = np.empty(0)
    return CalibrationResult(
        calibration=load_profile("utm30lx"),
        recordings=(RecordingSummary("one.bag", "glass", 1.0, 15, 12, 11, 10, 1.143),),
        warnings=("panes were tried from 10 places",),
        panes=(),
        surfaces=SurfaceSamples(none, none, none),
        proven=True,
    )


@pytest.fixture
def calls(monkeypatch, result):
    """Sessions and options of the calibration, which itself is replaced."""
    seen = []

    def calibrate(sessions, **options):
        seen.append((sessions, options))
        return result

    monkeypatch.setattr(glassslam.calibration, "calibrate", calibrate)
    return seen


def test_the_procedure_of_two_distances(calls, tmp_path, capsys):
    words = [
        "one.bag",
        "two.bag",
        "--distance",
        "1",
        "--distance",
        "2",
        "--material",
        "glass",
        "--roi",
        "-20:20",
    ]
    assert main(["calibrate", *words, "-o", str(tmp_path / "out"), "--name", "mine"]) == 0
    ((sessions, options),) = calls
    assert [(s.name, s.material, s.distance) for s in sessions] == [
        ("one.bag", "glass", 1.0),
        ("two.bag", "glass", 2.0),
    ]
    assert str(sessions[1].roi) == "at bearings from -20 to 20 deg"
    assert (options["name"], options["align"], options["geometry"]) == ("mine", False, False)
    captured = capsys.readouterr()
    assert captured.err == ""
    for text in ("1.14 m", "thresh 10254", "11 of 11 = 100.0% (74% to 100%)", "warning: panes were tried"):
        assert text in captured.out
    assert (tmp_path / "out" / "calibration.yaml").is_file()
    assert (tmp_path / "out" / "calibration.png").is_file()


def test_a_mixed_call(calls, tmp_path):
    words = ["a.bag", "b.bag", "c.bag", "--distance", "1", "--distance", "-", "--distance", "-"]
    words += ["--panes", "-", "--panes", "p.geojson", "--panes", "-", "--align"]
    words += ["--material", "acrylic", "--material", "glass", "--material", "no-glass"]
    words += ["--start", "2", "--duration", "9", "--scan-topic", "/front"]
    assert main(["calibrate", *words, "-o", str(tmp_path / "out"), "-q"]) == 0
    ((sessions, options),) = calls
    assert [(s.material, s.distance, s.panes) for s in sessions] == [
        ("acrylic", 1.0, None),
        ("glass", None, Path("p.geojson")),
        ("no-glass", None, None),
    ]
    assert options["align"]
    source = options["options"]
    assert (source.start, source.duration, source.scan_topic) == (2.0, 9.0, "/front")


def test_without_a_directory_it_is_named_after_the_recording(calls, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["calibrate", "some/run.bag", "--quiet"]) == 0
    assert [path.name for path in tmp_path.iterdir()] == ["run-calibration"]


def test_json_is_the_calibration_and_nothing_else(calls, tmp_path, capsys):
    assert main(["calibrate", "run.bag", "-o", str(tmp_path / "out"), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["directory"] == str(tmp_path / "out")
    assert report["calibration"]["thresh"] == 10254.0
    assert report["calibration"]["saturation"] is None
    assert report["proven"] is True


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("a.bag b.bag --distance 1 --distance 2 --distance 3", "3 values of --distance for 2 recordings"),
        ("a.bag --material glass", "a.bag: nothing says where the glass is"),
        ("a.bag --roi left", "--roi left: no region"),
        ("a.bag --distance 1 --align", "--align needs --panes"),
        ("a.bag --start -1", "--start must be a time of 0 s or more, not -1"),
        ("a.bag b.bag x/../a.bag --distance 1", "x/../a.bag is named twice (its scans would count twice"),
    ],
)
def test_wrong_usage(calls, tmp_path, capsys, words, message):
    assert main(["calibrate", *words.split(), "-o", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"error: {message}")
    assert error.count("\n") == 1
    assert calls == []


def test_an_earlier_calibration_is_found_before_any_work_is_done(calls, tmp_path, capsys):
    (tmp_path / "calibration.yaml").write_text("old")
    assert main(["calibrate", "run.bag", "-o", str(tmp_path)]) == 2
    assert "already holds results (use --overwrite to replace them)" in capsys.readouterr().err
    assert calls == []


def test_a_recording_that_is_none(tmp_path, capsys):
    assert main(["calibrate", str(tmp_path / "none.bag"), "-o", str(tmp_path / "out")]) == 1
    assert "none.bag" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_unproven_thresholds_are_called_so(result):
    rows = dict(value_rows(replace(result, proven=False)))
    assert rows["calibrated_peak"].endswith("(unproven)")
    assert "pane" not in rows


BEAMS = BeamErrors(0.0079, 0.0021, -0.0233, -0.0048, (0.0004, 0.0008, 0.0009, 0.0012), 685, 0.00396, 0.00369)


def test_the_errors_of_the_beams_are_asked_for_and_shown(calls, result, tmp_path, capsys):
    assert main(["calibrate", "run.bag", "--geometry", "-o", str(tmp_path / "out")]) == 0
    ((_, options),) = calls
    assert options["geometry"] is True
    assert "bearing_cosine" not in capsys.readouterr().out
    rows = dict(value_rows(replace(result, calibration=replace(result.calibration, beam_errors=BEAMS))))
    assert rows["bearing_cosine"] == "0.0079 +- 0.0004 rad (0.45 deg)"
    assert rows["lateral_offset"] == "-23.3 +- 0.9 mm"
    assert rows["bend of walls"] == "3.96 mm without, 3.69 mm with it, 685 walls"


def test_of_a_lidar_without_intensities_only_the_beams_are_shown(result):
    silent = replace(result.calibration, informative=False, detector="off", beam_errors=BEAMS)
    rows = dict(value_rows(replace(result, calibration=silent, proven=False)))
    assert {"sensor", "limits", "detector", "range_offset"} <= set(rows)
    assert not {"diffuse level", "calibrated_peak", "intensity_peak"} & set(rows)


def written(tmp_path, **changes):
    path = tmp_path / "calibration.yaml"
    path.write_text(yaml.safe_dump(load_profile("utm30lx").to_dict() | changes))
    return path


def test_map_embeds_the_calibration(asked_runs, tmp_path):
    path = written(tmp_path)
    assert main(["map", "run.bag", "--calibration", str(path), "-o", str(tmp_path / "out"), "-q"]) == 0
    config = asked_runs[0].config
    assert config.glass.detector == "calibrated_peak"
    assert config.glass.calibration == load_profile("utm30lx").to_dict()
    assert (config.glass.thresh, config.glass.grad, config.glass.width) == (10254.0, 512.7, 20)


def test_later_assignments_go_before_it(asked_runs, tmp_path):
    words = ["--calibration", str(written(tmp_path)), "--set", "glass.detector=intensity_peak"]
    assert main(["map", "run.bag", *words, "-o", str(tmp_path / "out"), "-q"]) == 0
    assert asked_runs[0].config.glass.detector == "intensity_peak"


def used(config):
    names = ("bearing_cosine", "bearing_sine", "lateral_offset", "range_offset")
    return tuple(getattr(config.sensor, name) for name in names)


def test_the_errors_of_the_beams_become_part_of_the_configuration(asked_runs, tmp_path):
    path = written(tmp_path, beam_errors=BEAMS.to_dict())
    assert main(["map", "run.bag", "--calibration", str(path), "-o", str(tmp_path / "out"), "-q"]) == 0
    assert used(asked_runs[0].config) == (0.0079, 0.0021, -0.0233, -0.0048)
    assert calibration_warnings(asked_runs[0].config) == []


def test_a_calibration_without_them_leaves_those_of_the_configuration(tmp_path):
    stated = tmp_path / "config.yaml"
    stated.write_text("sensor: {range_offset: 0.01}")
    config = resolve_config(stated, calibration_assignments(written(tmp_path), None, stated))
    assert used(config) == (0.0, 0.0, 0.0, 0.01)


def test_what_is_set_goes_before_the_calibrated_beams(asked_runs, tmp_path):
    words = ["--calibration", str(written(tmp_path, beam_errors=BEAMS.to_dict()))]
    words += ["--set", "sensor.bearing_cosine=0.001"]
    assert main(["map", "run.bag", *words, "-o", str(tmp_path / "out"), "-q"]) == 0
    assert used(asked_runs[0].config) == (0.001, 0.0021, -0.0233, -0.0048)
    assert calibration_warnings(asked_runs[0].config) == [
        "the beams are not corrected as calibrated: sensor.bearing_cosine is 0.001, not 0.0079"
    ]


def test_a_file_of_parameters_goes_before_the_calibrated_beams(asked_runs, tmp_path):
    path, stated = written(tmp_path, beam_errors=BEAMS.to_dict()), tmp_path / "config.yaml"
    stated.write_text("sensor: {max_range: 8, lateral_offset: 0.0}")
    words = ["--calibration", str(path), "--config", str(stated)]
    assert main(["map", "run.bag", *words, "-o", str(tmp_path / "out"), "-q"]) == 0
    assert used(asked_runs[0].config) == (0.0079, 0.0021, 0.0, -0.0048)
    assert asked_runs[0].config.sensor.max_range == 8.0


def test_a_damaged_entry_is_named(tmp_path):
    path = written(tmp_path, beam_errors=BEAMS.to_dict() | {"walls": "many"})
    with pytest.raises(ConfigError, match=r"beam_errors.walls is no whole number of 0 or more: 'many'"):
        calibration_assignments(path, None)


def test_a_calibration_without_thresholds_leaves_the_defaults(tmp_path):
    path = written(tmp_path, thresh=0.0, grad=0.0, width=0)
    assert resolve_config(None, calibration_assignments(path, None)).glass.thresh == 3000.0


def test_a_calibration_that_rules_glass_out_is_told(tmp_path):
    path = written(tmp_path, detector="off", sensor="lms511")
    config = resolve_config(None, calibration_assignments(path, None))
    assert config.glass.detector == "off"
    assert calibration_warnings(config) == [
        "glass is not looked for: by its calibration the intensities of lms511 cannot show it"
    ]
    assert calibration_warnings(resolve_config(None, ["glass.detector=off"])) == []


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, "cannot read calibration {path}: No such file or directory"),
        ("a: 1", "{path} is no calibration"),
        ("sensor: x\ndiffuse: {ranges: [1], levels: [0]}", "calibration {path}: ranges of a diffuse curve"),
    ],
)
def test_a_file_that_is_no_calibration(asked_runs, tmp_path, capsys, text, message):
    path = tmp_path / "c.yaml"
    if text is not None:
        path.write_text(text)
    assert main(["map", "run.bag", "--calibration", str(path), "-o", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"error: {message.format(path=path)}")
    assert error.count("\n") == 1
    assert asked_runs == []


def test_a_calibration_and_a_sensor_exclude_each_other(asked_runs, tmp_path, capsys):
    words = ["--calibration", str(written(tmp_path)), "--sensor", "utm30lx"]
    assert main(["map", "run.bag", *words, "-o", str(tmp_path / "out")]) == 2
    assert capsys.readouterr().err.startswith("error: --calibration and --sensor exclude each other")
    assert asked_runs == []
