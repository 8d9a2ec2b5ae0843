"""What a run with glass writes beyond the rest."""

import json
from dataclasses import replace

import numpy as np
import pytest
import yaml

from detectors.calibration import Calibration
from detectors.diffuse import DiffuseCurve
from glassslam.glass.beam_labels import BeamLabelLog
from glassslam.glass.ghosts import Ghosts
from glassslam.glass.layer import GlassLayer
from glassslam.glass.observations import GlassObservations
from glassslam.glass.walls import GlassWall
from glassslam.outputs import build_report, write_results
from glassslam.outputs.beam_labels import read_beam_labels
from glassslam.outputs.calibration_file import recording_day, write_learnt
from glassslam.outputs.directory import GLASS_FILES, RESULT_FILES


def layer(**more):
    wall = GlassWall(np.array([0.0, 0.25]), np.array([1.0, 0.25]), 9, 5, 1.0, 0.01, 0.01, 1.0)
    return GlassLayer((wall,), GlassObservations.empty(), np.empty((0, 2)), np.empty(0), **more)


def beams():
    return BeamLabelLog.of(np.array([3.0]), np.array([[2, 2, 3]], np.uint8)).beams()


def ghosts():
    none = np.zeros(4, np.float32)
    return Ghosts(np.array([0, 1, 1, 2], np.uint8), none, none, none)


def test_all_files_of_glass_are_written(tiny_result, tmp_path):
    whole = layer(beams=beams(), calibration=LEARNT)
    written = write_results(replace(tiny_result, glass=whole), tmp_path / "run")
    assert {path.name for path in written} == {*RESULT_FILES, *GLASS_FILES}
    assert read_beam_labels(tmp_path / "run" / "glass_beams.npz").count.tolist() == [2, 1]


def test_without_labels_of_beams_there_is_no_file_of_them(tiny_result, tmp_path):
    write_results(replace(tiny_result, glass=layer()), tmp_path / "run")
    assert not (tmp_path / "run" / "glass_beams.npz").exists()


def test_earlier_labels_are_replaced_with_the_rest(tiny_result, tmp_path):
    write_results(replace(tiny_result, glass=layer(beams=beams())), tmp_path / "run")
    write_results(tiny_result, tmp_path / "run", overwrite=True)
    assert not (tmp_path / "run" / "glass_beams.npz").exists()


def test_the_report_counts_glass_and_ghosts(tiny_result):
    result = replace(tiny_result, glass=layer(beams=beams(), ghosts=ghosts(), ghost_cells=np.zeros((3, 2))))
    found = json.loads(json.dumps(build_report(result)))["glass"]
    assert {name: found[name] for name in ("walls", "wall_length_m", "observations")} == {
        "walls": 1,
        "wall_length_m": 1.0,
        "observations": 0,
    }
    assert (found["labelled_beams"], found["ghost_cells"]) == (3, 3)
    assert (found["returns_seen_through"], found["returns_mirrored"]) == (2, 1)


def test_the_report_of_a_run_without_glass_says_why(tiny_result):
    tiny_result.statistics.glass_reason = "the recording has no intensities"
    assert build_report(tiny_result)["glass"] == {
        "detector": "off",
        "reason": "the recording has no intensities",
    }


def test_the_report_names_the_detector_and_the_reason(tiny_result):
    tiny_result.statistics.glass_detector = "calibrated_peak"
    tiny_result.statistics.glass_reason = "calibrated on 60 scans of this recording"
    found = build_report(replace(tiny_result, glass=layer()))["glass"]
    assert (found["detector"], found["reason"]) == (
        "calibrated_peak",
        "calibrated on 60 scans of this recording",
    )


LEARNT = Calibration("this recording", DiffuseCurve((1.0,), (900.0,)), beams=3, evidence={"scans": 60})


def test_what_a_run_has_learnt_of_its_lidar_is_written_named_and_dated(tiny_result, tmp_path):
    write_results(replace(tiny_result, glass=layer(calibration=LEARNT)), tmp_path / "run")
    text = (tmp_path / "run" / "calibration.yaml").read_text()
    assert text.startswith("# lidar calibration for glass, learnt by glassslam map from the recording itself")
    assert "glassslam map --calibration" in text.splitlines()[0]
    read = Calibration.from_dict(yaml.safe_load(text))
    assert read == replace(
        LEARNT,
        sensor="run",
        date="2002-09-11",
        evidence={"recordings": ["run.clf.gz"], "scans": 60},
    )


def test_without_a_source_the_name_stays(tiny_result, tmp_path):
    result = replace(tiny_result, info=None, glass=layer(calibration=LEARNT))
    written = write_learnt(result, tmp_path / "calibration.yaml")
    assert yaml.safe_load(written.read_text())["sensor"] == "this recording"


def test_a_run_with_a_given_calibration_writes_none(tiny_result, tmp_path):
    assert write_learnt(replace(tiny_result, glass=layer()), tmp_path / "calibration.yaml") is None
    assert write_learnt(tiny_result, tmp_path / "calibration.yaml") is None
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("stamp", [0.0, 12.5, -1e300, 1e300])
def test_stamps_of_no_day(stamp):
    assert recording_day(stamp) == ""
