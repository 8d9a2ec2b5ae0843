"""Pipes, sockets and devices where files are read are refused at once: a pipe may never have a writer."""

import os
import signal
import socket

import numpy as np
import pytest

from glassslam.cli import main
from glassslam.errors import ConfigError
from glassslam.records import LaserScan
from glassslam.regularfile import regular
from glassslam.simulation import Scene
from glassslam.simulation.rosbag1 import write_rosbag1

WORD = "it is no regular file"


@pytest.fixture(autouse=True)
def patience():
    """End a test that waits for a writer."""

    def give_up(*_):
        raise TimeoutError("it waits")

    before = signal.signal(signal.SIGALRM, give_up)
    signal.alarm(60)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


@pytest.fixture
def pipe(tmp_path):
    path = tmp_path / "pipe"
    os.mkfifo(path)
    return path


@pytest.fixture
def bag(tmp_path):
    """A recording of a single scan."""
    path = tmp_path / "run.bag"
    scan = LaserScan(1.0, np.full(100, 2.0, dtype=np.float32), 0.0, 0.01, 0.1, 30.0, record_stamp=1.0)
    write_rosbag1([scan], path)
    return path


def refused(words, path, capsys):
    """The words end in one line that names the path."""
    code = main([*map(str, words)])
    error = capsys.readouterr().err
    assert (code in (1, 2), error.count("\n")) == (True, 1), error
    assert str(path) in error
    assert WORD in error


@pytest.mark.parametrize("command", ["map", "inspect", "calibrate", "volume"])
def test_a_recording_is_no_pipe(command, pipe, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    refused([command, pipe], pipe, capsys)


@pytest.mark.parametrize("name", ["run.mcap", "run_0.db3", "run_0.db3-wal", "metadata.yaml", "run.db3.zstd"])
def test_no_part_of_a_directory_is_a_pipe(name, tmp_path, capsys):
    folder = tmp_path / "run"
    folder.mkdir()
    (folder / "other_0.db3").write_bytes(b"SQLite format 3\x00")
    os.mkfifo(folder / name)
    refused(["inspect", folder], folder / name, capsys)


@pytest.mark.parametrize("ending", ["-wal", "-journal"])
def test_no_log_beside_a_database_is_a_pipe(ending, tmp_path, capsys):
    database = tmp_path / "run.db3"
    database.write_bytes(b"SQLite format 3\x00")
    os.mkfifo(f"{database}{ending}")
    refused(["inspect", database], f"{database}{ending}", capsys)


@pytest.mark.parametrize("option", ["--config", "--calibration", "--sonar"])
def test_no_file_of_an_option_of_map_is_a_pipe(option, pipe, bag, tmp_path, capsys):
    refused(["map", bag, "-o", tmp_path / "out", option, pipe], pipe, capsys)
    assert not (tmp_path / "out").exists()


def test_a_scene_is_no_pipe(pipe):
    with pytest.raises(ConfigError, match=f"cannot read {pipe}: {WORD}"):
        Scene.load(pipe)


@pytest.mark.parametrize("option", ["--truth", "--glass", "--labels", "--trajectory", "--relations"])
def test_no_truth_is_a_pipe(option, pipe, tmp_path, capsys):
    results = tmp_path / "run"
    results.mkdir()
    (results / "trajectory.tum").write_text("1.0 0 0 0 0 0 0 1\n")
    (results / "glass.geojson").write_text('{"features": []}')
    empty = {name: np.zeros(0, dtype=np.int64) for name in ("scan", "beam", "count", "label")}
    np.savez(results / "glass_beams.npz", stamps=np.zeros(0), **empty)
    refused(["evaluate", results, option, pipe], pipe, capsys)


def test_a_picture_that_is_a_true_map_is_no_pipe(tmp_path, capsys):
    picture = tmp_path / "truth.png"
    os.mkfifo(picture)
    refused(["evaluate", tmp_path, "--truth", picture, "--resolution", "0.05"], picture, capsys)


def test_poses_of_a_volume_are_no_pipe(pipe, bag, capsys):
    refused(["volume", bag, "--trajectory", pipe], pipe, capsys)


def test_sockets_and_devices_are_no_files_either(tmp_path):
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(tmp_path / "socket"))
        for path in (tmp_path / "socket", "/dev/zero"):
            with pytest.raises(OSError, match=WORD):
                regular(path)


def test_files_links_directories_and_what_is_missing_are_left_to_the_reader(tmp_path):
    (tmp_path / "file").write_text("")
    (tmp_path / "link").symlink_to(tmp_path / "file")
    for name in ("file", "link", "", "missing"):
        assert regular(tmp_path / name) == tmp_path / name
