"""`glassslam map`: what it passes on, writes, prints and returns."""

import json

import numpy as np
import pytest

from glassslam import api
from glassslam.cli import main
from glassslam.cli.progress import amount, progress_bar, speed
from glassslam.cli.summary import summary_rows
from glassslam.cli.terminal import emit_rich
from glassslam.errors import RecordingError
from glassslam.outputs import RESULT_FILES, Usage, build_report
from glassslam.records import LaserScan, RecordingInfo
from glassslam.simulation.rosbag1 import write_rosbag1
from glassslam.slam.result import Degeneracy


def test_results_are_written_and_told(asked_runs, tmp_path, capsys):
    assert main(["map", "run.bag", "-o", str(tmp_path / "out")]) == 0
    captured = capsys.readouterr()
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == sorted([*RESULT_FILES, "session.db"])
    for name in RESULT_FILES:
        assert name in captured.out
    assert "2 read, 2 used, none dropped" in captured.out
    assert captured.err == ""


def test_options_reach_the_source_and_the_configuration(asked_runs, tmp_path):
    words = "--scan-topic /a --odom-topic /b --imu-topic /c --laser-pose -0.1,0,3 --start 1 --duration 2"
    words += " --every 3 --echo last --set sensor.max_range=7"
    assert main(["map", "a.bag", "b.bag", "-o", str(tmp_path / "out"), *words.split()]) == 0
    (asked,) = asked_runs
    config, options = asked.config, asked.options
    assert [path.name for path in asked.recordings] == ["a.bag", "b.bag"]
    assert config.sensor.max_range == 7.0
    assert (options.scan_topic, options.odom_topic, options.imu_topic) == ("/a", "/b", "/c")
    assert options.laser_pose == (-0.1, 0.0, 3.0)
    assert (options.start, options.duration, options.every, options.echo) == (1.0, 2.0, 3, "last")


def test_intensities_can_be_required(asked_runs, tmp_path):
    assert main(["map", "a.bag", "-o", str(tmp_path / "out"), "--require-intensity", "-q"]) == 0
    assert main(["map", "a.bag", "-o", str(tmp_path / "out"), "--overwrite", "-q"]) == 0
    assert [asked.config.glass.require_intensity for asked in asked_runs] == [True, False]


@pytest.mark.parametrize("detector", ["off", "narrow_return"])
def test_intensities_cannot_be_required_of_a_run_that_uses_none(asked_runs, tmp_path, capsys, detector):
    words = ["--require-intensity", "--set", f"glass.detector={detector}"]
    assert main(["map", "a.bag", "-o", str(tmp_path / "out"), *words]) == 2
    assert capsys.readouterr().err == (
        f"error: --require-intensity: the detector {detector} uses no intensities "
        "(leave one of them out, or choose another detector)\n"
    )
    assert asked_runs == []


def test_required_intensities_that_are_missing_are_an_error(tmp_path, capsys):
    wall = 2.0 / np.cos(-0.8 + 0.0175 * np.arange(90)).astype(np.float32)
    scans = [LaserScan(0.1 * k, wall, -0.8, 0.0175, 0.1, 10.0) for k in range(5)]
    write_rosbag1(scans, tmp_path / "run.bag")
    words = ["map", str(tmp_path / "run.bag"), "-o", str(tmp_path / "out"), "-q"]
    assert main([*words, "--require-intensity"]) == 1
    assert capsys.readouterr().err == (
        "error: glass cannot be looked for: the recording has no intensities "
        "(map without --require-intensity)\n"
    )
    assert not (tmp_path / "out").exists()
    assert main(words) == 0


def test_the_summary_says_why_glass_was_not_looked_for(tiny_result):
    tiny_result.statistics.glass_reason = "the recording has no intensities"
    rows = dict(summary_rows(build_report(tiny_result)))
    assert rows["glass"] == "not looked for (the recording has no intensities)"


def test_paths_and_warnings_are_not_cut_to_the_width_of_the_terminal(capsys):
    emit_rich("wrote " + "/folder" * 40)
    assert capsys.readouterr().out == "wrote " + "/folder" * 40 + "\n"


def test_the_summary_counts_glass(tiny_result):
    glass = {"detector": "calibrated_peak", "reason": "the calibration given", "walls": 1}
    glass |= {"wall_length_m": 2.04, "observations": 9}
    rows = dict(summary_rows(build_report(tiny_result) | {"glass": glass}))
    assert rows["glass"] == "1 wall of 2.0 m, 9 observations by calibrated_peak (the calibration given)"


def test_sonar_options_reach_the_source(asked_runs, tmp_path):
    words = "--sonar ring.txt --sonar-topic /a --sonar-topic /b --sonar-ring pioneer-3dx"
    assert main(["map", "a.bag", "-o", str(tmp_path / "out"), *words.split()]) == 0
    options = asked_runs[0].options
    assert (options.sonar.name, options.sonar_topic, options.sonar_ring) == (
        "ring.txt",
        ("/a", "/b"),
        "pioneer-3dx",
    )


def test_without_a_directory_results_are_named_after_the_recording(asked_runs, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["map", "some/run.bag", "--quiet"]) == 0
    assert [path.name for path in tmp_path.iterdir()] == ["run-map"]


def test_json_is_the_report_and_nothing_else(asked_runs, tmp_path, capsys):
    assert main(["map", "run.bag", "-o", str(tmp_path / "out"), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["directory"] == str(tmp_path / "out")
    assert report["nodes"] == 2


def test_quiet_prints_nothing(asked_runs, tmp_path, capsys):
    assert main(["map", "run.bag", "-o", str(tmp_path / "out"), "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize("drop", ["scans_dropped", "messages_dropped"])
def test_dropped_data_is_told_and_gives_code_3(asked_runs, tiny_result, tmp_path, capsys, drop):
    getattr(tiny_result.statistics, drop)["no range"] = 5
    assert main(["map", "run.bag", "-o", str(tmp_path / "out")]) == 3
    assert "5 x no range" in capsys.readouterr().out
    assert (tmp_path / "out" / "map.pgm").exists()


def test_earlier_results_are_found_before_any_work_is_done(asked_runs, tmp_path, capsys):
    (tmp_path / "map.pgm").write_text("old")
    assert main(["map", "run.bag", "-o", str(tmp_path)]) == 2
    assert capsys.readouterr().err == (
        f"error: {tmp_path} already holds results (use --overwrite to replace them)\n"
    )
    assert asked_runs == []
    assert main(["map", "run.bag", "-o", str(tmp_path), "--overwrite", "--quiet"]) == 0
    assert (tmp_path / "map.pgm").read_bytes().startswith(b"P5")


@pytest.mark.parametrize(
    "words", ["--every 0", "--start -1", "--duration nan", "--echo loudest", "--set x=1"]
)
def test_values_out_of_their_domain_are_wrong_usage(asked_runs, tmp_path, capsys, words):
    assert main(["map", "run.bag", "-o", str(tmp_path / "out"), *words.split()]) == 2
    assert capsys.readouterr().err.startswith("error: ")
    assert asked_runs == []


def test_a_failure_leaves_nothing_behind(tmp_path, monkeypatch, capsys):
    def fail(*_, **__):
        raise RecordingError("run.bag is truncated", "record it again")

    monkeypatch.setattr("glassslam.sources.open_recording", fail)
    assert main(["map", "run.bag", "-o", str(tmp_path / "deep" / "out")]) == 1
    assert capsys.readouterr().err == "error: run.bag is truncated (record it again)\n"
    assert list(tmp_path.iterdir()) == []


def test_a_missing_recording_is_one_line(tmp_path, capsys):
    assert main(["map", str(tmp_path / "none.bag"), "-o", str(tmp_path / "out")]) == 1
    error = capsys.readouterr().err
    assert "none.bag" in error
    assert error.count("\n") == 1


def test_summary_tells_what_the_run_found_and_cost(tiny_result):
    rows = dict(summary_rows(build_report(tiny_result, Usage(0.02, 0.03, 123.4))))
    assert rows["scans"] == "2 read, 2 used, none dropped"
    assert rows["recorded"] == "0.4 s, 0.5 m travelled"
    assert rows["map"] == "2.0 x 1.5 m, 0.5 m per cell"
    assert rows["graph"] == "2 nodes, 1 submaps"
    assert rows["loop closures"] == "1 of 3 tried; rejected: 2 x low score"
    assert rows["residual"] == "loop_translation_rms 0.01"
    assert rows["time"] == "matching 0.25 s (0.50 s CPU)"
    assert rows["total"] == "0.02 s (0.03 s CPU), 22x real time"
    assert rows["peak memory"] == "123 MB"
    assert rows["warning"] == "no odometry"


def test_speed_is_told_in_multiples_of_real_time():
    assert speed(74.0, 2.0) == "37x real time"
    assert speed(3.0, 2.0) == "1.5x real time"


@pytest.mark.parametrize(
    ("count", "duration", "expected"),
    [(100, 60.0, (30, 100)), (20, 60.0, (20, 20)), (0, 60.0, (12.0, 60.0)), (0, 0.0, (30, None))],
)
def test_progress_is_measured_in_scans_or_else_in_time(count, duration, expected):
    info = RecordingInfo(("run.bag",), "rosbag1", duration, count)
    assert amount(api.Progress("mapping", 30, 12.0, info)) == expected


def test_there_is_no_bar_without_a_terminal():
    with progress_bar() as progress:
        assert progress is None


def test_on_a_terminal_the_bar_tells_the_speed(monkeypatch):
    import io
    import sys

    class Terminal(io.StringIO):
        def isatty(self):
            return True

    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "120")
    info = RecordingInfo(("run.bag",), "rosbag1", 60.0, 100)
    with progress_bar() as progress:
        progress(api.Progress("mapping", 50, 30.0, info))
    assert "50%" in terminal.getvalue()
    assert "x real time" in terminal.getvalue()


def test_the_summary_counts_uncertain_stretches_by_kind(tiny_result):
    def stretch(kind, length):
        return Degeneracy(kind, 0, 1, 0.0, 1.0, (0.0, 0.0), (1.0, 0.0), length, "")

    assert "uncertain" not in dict(summary_rows(build_report(tiny_result)))
    tiny_result.statistics.degeneracies = [
        stretch("lost", 0.0),
        stretch("featureless", 9.0),
        stretch("featureless", 5.5),
    ]
    rows = dict(summary_rows(build_report(tiny_result)))
    assert rows["uncertain"] == "1 x lost, 2 x featureless (14.5 m); see report"
