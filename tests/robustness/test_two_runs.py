"""Two runs into one directory: the second is told at once, and nobody's results are mixed."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from glassslam.cli import main
from glassslam.cli.demo import demo as run_demo
from glassslam.errors import OutputError
from glassslam.outputs import directory, staged_directory
from glassslam.outputs.lock import locked

HOLDER = """
import sys, time
from glassslam.outputs.lock import locked
with locked(sys.argv[1]):
    print("held", flush=True)
    time.sleep(60)
"""


@pytest.fixture
def other_run(tmp_path):
    """Another process that writes to tmp_path/run."""
    process = subprocess.Popen(
        [sys.executable, "-c", HOLDER, tmp_path / "run"], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout.readline() == "held\n"
    yield process
    process.kill()
    process.wait()
    process.stdout.close()


COMMANDS = {
    "map": ["map", "any.bag"],
    "calibrate": ["calibrate", "any.bag"],
    "volume": ["volume", "any.bag"],
    "simulate": ["simulate", "office"],
    "demo": ["demo"],
}


@pytest.mark.parametrize("command", COMMANDS)
def test_the_second_run_is_refused_in_one_line(tmp_path, other_run, capsys, command):
    assert main([*COMMANDS[command], "-o", str(tmp_path / "run")]) == 1
    assert capsys.readouterr().err == (
        f"error: another run is writing to {tmp_path / 'run'} (wait for it, or choose another directory)\n"
    )


@pytest.mark.parametrize("command", COMMANDS)
def test_no_lock_is_left_by_a_command_that_failed(tmp_path, command):
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "a friend's letter").write_text("...")
    (tmp_path / "any.bag").write_text("no recording")
    words = [str(tmp_path / word) if word == "any.bag" else word for word in COMMANDS[command]]
    assert main([*words, "-o", str(tmp_path / "run")]) in {1, 2}
    assert sorted(os.listdir(tmp_path)) == ["any.bag", "run"]  # noqa: PTH208


def test_a_lock_left_by_a_killed_demo_is_no_foreign_file(tmp_path, monkeypatch):
    (tmp_path / ".map.lock").write_text("")
    monkeypatch.setattr("glassslam.simulation.simulate", None)
    demo = ["demo", "-o", str(tmp_path)]
    (tmp_path / "letter").write_text("...")
    assert main(demo) == 1
    (tmp_path / "letter").unlink()
    with pytest.raises(TypeError, match="not callable"):
        run_demo(tmp_path)


def test_other_directories_are_free(tmp_path, other_run):
    with locked(tmp_path / "other"), locked(tmp_path / "run2"):
        pass


def test_a_killed_run_leaves_no_lock(tmp_path, other_run):
    other_run.kill()
    other_run.wait()
    with locked(tmp_path / "run"):
        pass
    assert list(tmp_path.iterdir()) == []


def test_the_lock_is_gone_after_a_run_that_failed(tmp_path, monkeypatch):
    def fail(*_, **__):
        raise OutputError("no luck")

    monkeypatch.setattr("glassslam.sources.open_recording", fail)
    assert main(["map", "any.bag", "-o", str(tmp_path / "deep" / "run")]) == 1
    assert list(tmp_path.iterdir()) == []


def test_a_directory_that_appears_later_does_not_change_the_lock(tmp_path):
    with locked(tmp_path / "deep" / "run"), pytest.raises(OutputError), locked(tmp_path / "deep" / "run"):
        pass


def test_where_nothing_can_be_written_there_is_no_lock():
    with locked("/proc/nowhere/run"):
        pass


def test_results_put_there_meanwhile_are_kept(tmp_path, monkeypatch):
    """Without a lock (programs that call the library) the first to finish wins, and nothing else stays."""
    target = tmp_path / "run"
    target.mkdir()
    (target / "report.json").write_text("old")
    rename = Path.rename

    def overtaken(self, to):
        done = rename(self, to)
        if self == target:  # the old results have just been put aside
            target.mkdir()
            (target / "report.json").write_text("of another run")
        return done

    monkeypatch.setattr(directory.Path, "rename", overtaken)
    with pytest.raises(OutputError), staged_directory(target, overwrite=True) as folder:
        (folder / "report.json").write_text("new")
    assert (target / "report.json").read_text() == "of another run"
    assert os.listdir(tmp_path) == ["run"]  # noqa: PTH208
