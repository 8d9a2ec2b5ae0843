"""A results directory appears whole or not at all."""

import errno
import json
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from glassslam.config import Config
from glassslam.errors import OutputError, UsageError
from glassslam.outputs import (
    RESULT_FILES,
    Stopwatch,
    build_report,
    check_directory,
    read_g2o,
    read_map,
    read_tum,
    results,
    staged_directory,
    write_results,
)
from glassslam.outputs.report import distance_travelled
from glassslam.records import SonarRing, Trajectory
from glassslam.slam.result import Degeneracy


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_all_files_are_written_and_named(tiny_result, tmp_path):
    written = write_results(tiny_result, tmp_path / "new" / "run")
    assert sorted(path.name for path in written) == sorted(RESULT_FILES) == names(tmp_path / "new" / "run")
    assert all(path.parent == tmp_path / "new" / "run" for path in written)
    assert names(tmp_path / "new") == ["run"]


def test_results_are_what_the_run_found(tiny_result, tmp_path):
    write_results(tiny_result, tmp_path / "run")
    np.testing.assert_allclose(
        read_tum(tmp_path / "run/trajectory.tum").poses, tiny_result.trajectory.poses, atol=1e-9
    )
    graph = read_g2o(tmp_path / "run/graph.g2o")
    np.testing.assert_allclose(graph.poses, tiny_result.node_poses)
    assert read_map(tmp_path / "run").probability.shape == (3, 4)
    assert Config.load(tmp_path / "run/config.yaml") == tiny_result.config


def test_report_tells_everything(tiny_result, tmp_path):
    write_results(tiny_result, tmp_path / "run", stopwatch=Stopwatch())
    report = json.loads((tmp_path / "run/report.json").read_text())
    assert report["scans"] == {"read": 2, "used": 2, "dropped": {}}
    assert report["distance_m"] == pytest.approx(0.5)
    assert report["constraints"] == {"odometry": 1, "loop": 1}
    assert report["closures"] == {"tried": 3, "accepted": 1, "rejected": {"low score": 2}}
    assert report["map"] == {"resolution": 0.5, "rows": 3, "columns": 4, "origin": [-1.0, -0.5]}
    assert report["source"]["paths"] == ["run.clf.gz"]
    assert report["residuals"] == {"loop_translation_rms": 0.01}
    assert report["stages"] == {"matching": {"wall": 0.25, "cpu": 0.5}}
    assert report["warnings"] == ["no odometry"]
    assert set(report["versions"]) == {"python", "glassslam", "numpy", "scipy", "numba", "casadi"}
    assert report["resources"]["peak_memory_mb"] > 10.0
    assert report["resources"]["real_time_factor"] > 0.0


def test_numbers_that_json_does_not_know_become_null(tiny_result, tmp_path):
    tiny_result.statistics.residuals["mean"] = float("nan")
    tiny_result.statistics.residuals["count"] = np.float64(2.0)
    write_results(tiny_result, tmp_path / "run")
    report = json.loads((tmp_path / "run/report.json").read_text())
    assert report["residuals"] == {"loop_translation_rms": 0.01, "mean": None, "count": 2.0}


def test_the_ring_of_sonars_becomes_plain_numbers(tiny_result):
    ring = SonarRing(np.array([[0.1, 0.2, 1.5], [0.1, -0.2, -1.5]]), 0.5, 0.1, 5.0, "mine")
    info = replace(tiny_result.info, sonar_ring=ring, sonar_topics=("/sonar",))
    source = json.loads(json.dumps(build_report(replace(tiny_result, info=info))["source"], allow_nan=False))
    assert source["sonar_ring"]["poses"] == [[0.1, 0.2, 1.5], [0.1, -0.2, -1.5]]
    assert (source["sonar_ring"]["name"], source["sonar_topics"]) == ("mine", ["/sonar"])


def test_same_run_same_bytes(tiny_result, tmp_path):
    for name in ("a", "b"):
        write_results(tiny_result, tmp_path / name)
    for name in RESULT_FILES:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()


def test_earlier_results_are_kept_unless_told(tiny_result, tmp_path):
    write_results(tiny_result, tmp_path / "run")
    (tmp_path / "run/map.pgm").write_bytes(b"old")
    with pytest.raises(UsageError, match="already holds results") as caught:
        write_results(tiny_result, tmp_path / "run")
    assert caught.value.hint == "use --overwrite to replace them"
    assert (tmp_path / "run/map.pgm").read_bytes() == b"old"
    write_results(tiny_result, tmp_path / "run", overwrite=True)
    assert (tmp_path / "run/map.pgm").read_bytes() != b"old"
    assert names(tmp_path) == ["run"]


def test_a_failure_half_way_leaves_earlier_results_and_nothing_else(tiny_result, tmp_path, monkeypatch):
    write_results(tiny_result, tmp_path / "run")
    before = (tmp_path / "run/report.json").read_bytes()

    def disk_is_full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(results, "write_g2o", disk_is_full)
    with pytest.raises(OutputError, match=r"cannot write .*run: No space left on device") as caught:
        write_results(tiny_result, tmp_path / "run", overwrite=True)
    assert caught.value.hint == "free some space or choose another disk"
    assert names(tmp_path) == ["run"]
    assert (tmp_path / "run/report.json").read_bytes() == before


def test_an_interrupted_run_leaves_nothing(tiny_result, tmp_path, monkeypatch):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(results, "write_g2o", interrupt)
    with pytest.raises(KeyboardInterrupt):
        write_results(tiny_result, tmp_path / "run")
    assert names(tmp_path) == []


@pytest.mark.parametrize("interrupted_call", [1, 2])
def test_earlier_results_survive_an_interruption_of_the_exchange(tmp_path, monkeypatch, interrupted_call):
    (tmp_path / "run").mkdir()
    (tmp_path / "run/report.json").write_text("old")
    rename, calls = type(tmp_path).rename, []

    def interrupted_rename(self, target):
        calls.append(target)
        if len(calls) == interrupted_call:
            raise KeyboardInterrupt
        return rename(self, target)

    monkeypatch.setattr(type(tmp_path), "rename", interrupted_rename)
    with pytest.raises(KeyboardInterrupt), staged_directory(tmp_path / "run", overwrite=True) as folder:
        (folder / "report.json").write_text("new")
    assert names(tmp_path) == ["run"]
    assert (tmp_path / "run/report.json").read_text() == "old"


def test_files_of_others_are_never_replaced(tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(OutputError, match=r"holds files that are no results: thesis\.tex"):
        check_directory(tmp_path, overwrite=True)


def test_a_directory_may_be_prepared_and_reached_by_a_link(tmp_path):
    (tmp_path / "empty").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "empty")
    with staged_directory(tmp_path / "link") as folder:
        (folder / "map.pgm").write_bytes(b"x")
    assert (tmp_path / "link").is_symlink()
    assert names(tmp_path / "empty") == ["map.pgm"]


def test_new_directories_follow_the_umask(tmp_path):
    before = os.umask(0o027)
    try:
        with staged_directory(tmp_path / "run"):
            pass
    finally:
        os.umask(before)
    assert (tmp_path / "run").stat().st_mode & 0o777 == 0o750


def test_a_file_is_no_directory(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="file is a file"):
        check_directory(tmp_path / "file")
    with pytest.raises(OutputError, match=r"cannot write .*: .*file is a file"):
        check_directory(tmp_path / "file" / "run")


@pytest.mark.skipif(not Path("/proc/self").is_dir(), reason="needs a folder nobody can write")
def test_a_folder_that_cannot_be_written_is_found_out_first():
    with pytest.raises(OutputError, match="cannot write /proc/run"):
        check_directory("/proc/run")


def test_config_is_plain_yaml(tiny_result, tmp_path):
    write_results(tiny_result, tmp_path / "run")
    assert yaml.safe_load((tmp_path / "run/config.yaml").read_text())["sensor"]["max_range"] == 30.0


def test_the_report_tells_where_a_run_was_uncertain(tiny_result):
    first = float(tiny_result.trajectory.stamps[0])
    tiny_result.statistics.degeneracies = [
        Degeneracy("silence", 0, 1, first + 0.1, first + 0.3, (1.0, 2.0), (3.0, float("nan")), 4.5, "no scan")
    ]
    tiny_result.statistics.tracking = {"coasted": 3, "stretches": 2}
    report = build_report(tiny_result)
    assert report["tracking"] == {"coasted": 3, "stretches": 2}
    (one,) = report["degeneracies"]
    assert one.pop("start_after_seconds") == pytest.approx(0.1, abs=1e-6)
    assert one.pop("end_after_seconds") == pytest.approx(0.3, abs=1e-6)
    assert one == {
        "kind": "silence",
        "first_scan": 0,
        "last_scan": 1,
        "start": first + 0.1,
        "end": first + 0.3,
        "start_place": [1.0, 2.0],
        "end_place": [3.0, None],
        "length_m": 4.5,
        "text": "no scan",
    }


def test_the_noise_of_a_standing_robot_is_no_travel():
    random = np.random.default_rng(0)
    stands = np.column_stack((random.uniform(-0.02, 0.02, (500, 2)), np.zeros(500)))
    drives = np.column_stack((np.arange(0.0, 10.0, 0.013), np.zeros((770, 2))))
    circles = np.linspace(0.0, 2.0 * np.pi, 1000)
    circle = np.column_stack((2.0 * np.cos(circles), 2.0 * np.sin(circles), circles))
    for poses, expected in ((stands, 0.0), (drives, 10.0), (circle, 4.0 * np.pi), (drives[:0], 0.0)):
        track = Trajectory(np.arange(len(poses), dtype=np.float64), poses)
        assert distance_travelled(track) == pytest.approx(expected, abs=0.06)
