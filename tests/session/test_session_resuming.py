"""`map --resume`: what it goes on with, and what it refuses."""

import shutil
from importlib import metadata

import pytest
from session_worlds import WORDS, assert_same_results, interrupted, results, start

from glassslam.cli import main
from glassslam.outputs.lock import locked


@pytest.fixture
def target(partial_run, tmp_path):
    """The interrupted run in a directory of its own."""
    shutil.copytree(partial_run, tmp_path / "run.partial")
    return tmp_path / "run"


def tried(capsys, *words):
    """Exit code and the one line of the error."""
    code = main(["map", *map(str, words), "-q"])
    out, error = capsys.readouterr()
    assert out == ""
    assert error.count("\n") == (1 if code else 0)
    return code, error.removeprefix("error: ").removesuffix("\n")


@pytest.mark.parametrize("name", ["run", "run.partial"])
def test_the_run_is_meant_by_its_directory_or_its_working_directory(target, whole, name):
    assert main(["map", "--resume", str(target.with_name(name)), "-q"]) == 0
    assert_same_results(target, whole)
    assert not target.with_name("run.partial").exists()


def test_what_a_partial_map_has_left_is_removed(target, whole):
    partial = target.with_name("run.partial")
    assert (partial / "map.pgm").exists()
    for name in ("session.db.new", "volume.npz", "sonar_map.png"):
        (partial / name).write_text("left behind")
    assert main(["map", "--resume", str(target), "-q"]) == 0
    assert_same_results(target, whole)


def test_a_whole_directory_needs_nothing(whole_run, capsys):
    before = {path: path.read_bytes() for path in whole_run.iterdir()}
    assert main(["map", "--resume", str(whole_run)]) == 0
    assert capsys.readouterr() == (f"{whole_run} is whole: there is nothing to go on with\n", "")
    assert {path: path.read_bytes() for path in whole_run.iterdir()} == before


def test_a_second_map_into_the_same_directory_is_refused(bag, target, capsys):
    before = (target.with_name("run.partial") / "session.db").read_bytes()
    assert tried(capsys, bag, "-o", target) == (
        2,
        f"a run into {target} was interrupted and waits in run.partial "
        f"(go on: glassslam map --resume {target}; or begin anew: --overwrite)",
    )
    assert (target.with_name("run.partial") / "session.db").read_bytes() == before


def test_with_overwrite_a_run_begins_anew(bag, target, capsys):
    words = [bag, "-o", target, "--overwrite", "--every", "3"]
    assert tried(capsys, *words) == (0, "")
    assert (target / "session.db").exists()
    assert not target.with_name("run.partial").exists()


def test_a_working_directory_without_a_session_is_no_hindrance(bag, target, whole):
    """A run that was killed before its session was there is begun once more by the same command."""
    partial = target.with_name("run.partial")
    for path in partial.iterdir():
        path.unlink()
    for content in (None, b""):
        partial.mkdir(exist_ok=True)
        if content is not None:
            (partial / "session.db").write_bytes(content)
        assert main(["map", str(bag), "-o", str(target), *WORDS]) == 0
        assert_same_results(target, whole)
        shutil.rmtree(target)


def test_a_working_directory_with_something_else_is_left_alone(bag, target, capsys):
    partial = target.with_name("run.partial")
    shutil.rmtree(partial)
    (partial / "notes").mkdir(parents=True)
    assert tried(capsys, bag, "-o", target) == (
        1, f"{partial} holds what is no result: notes (move it away, or choose another directory)",
    )  # fmt: skip
    assert (partial / "notes").is_dir()


@pytest.fixture
def own_recording(bag, tmp_path):
    """An interrupted run with a recording that may be moved or changed."""
    own = tmp_path / "in" / "ring.bag"
    own.parent.mkdir()
    shutil.copyfile(bag, own)
    words = ["map", str(own), "-o", str(tmp_path / "run"), *WORDS]
    assert interrupted(words, 150) == 130
    assert main(["map", str(own), "-o", str(tmp_path / "whole"), *WORDS]) == 0
    return own


def test_a_recording_that_has_moved_is_named_before_resume(own_recording, tmp_path, capsys):
    expected = results(tmp_path / "whole")
    moved = own_recording.rename(tmp_path / "other name.bag")
    capsys.readouterr()
    assert tried(capsys, "--resume", tmp_path / "run") == (
        1,
        f"cannot read {own_recording}: No such file or directory "
        "(name the recording where it is now, before --resume)",
    )
    assert tried(capsys, moved, "--resume", tmp_path / "run") == (0, "")
    assert_same_results(tmp_path / "run", expected)


@pytest.mark.parametrize("how", ["a byte", "cut", "longer", "another"])
def test_a_recording_that_has_changed_is_refused(own_recording, tmp_path, capsys, how):
    content = bytearray(own_recording.read_bytes())
    match how:
        case "a byte":
            content[len(content) // 2] ^= 1
        case "cut":
            del content[-1:]
        case "longer":
            content += b"\0"
        case "another":
            content[:] = b"#ROSBAG V2.0\n"
    own_recording.write_bytes(content)
    capsys.readouterr()
    assert tried(capsys, "--resume", tmp_path / "run") == (
        1, f"{own_recording} is not the recording the run has read (map it anew, with --overwrite)",
    )  # fmt: skip
    assert (tmp_path / "run.partial" / "session.db").exists()


def test_more_recordings_than_the_run_has_read(bag, target, capsys):
    assert tried(capsys, bag, bag, "--resume", target) == (
        1, "the run reads 1 recordings, not 2 (name all, in their order)",
    )  # fmt: skip


def test_recordings_are_found_from_another_folder(bag, tmp_path, monkeypatch, whole):
    """Named relative to where the run began; results tell the name as it was given."""
    (tmp_path / "in").mkdir()
    shutil.copyfile(bag, tmp_path / "in" / "ring.bag")
    monkeypatch.chdir(tmp_path)
    assert interrupted(["map", "in/ring.bag", "-o", "run", *WORDS], 150) == 130
    assert main(["map", "in/ring.bag", "-o", "other", *WORDS]) == 0
    expected = results(tmp_path / "other")
    monkeypatch.chdir(tmp_path / "in")
    assert main(["map", "--resume", "../run", "-q"]) == 0
    assert_same_results(tmp_path / "run", expected)
    assert expected["report.json"]["source"]["paths"] == ["in/ring.bag"]


def test_a_run_of_another_version_is_refused(target, capsys, monkeypatch):
    installed = metadata.version("glassslam")
    monkeypatch.setattr("glassslam.__version__", "99.1")
    assert tried(capsys, "--resume", target) == (
        1,
        f"glassslam {installed} has begun this run, and this is 99.1: the result would be of both "
        "(map the recording anew, with --overwrite)",
    )
    assert (target.with_name("run.partial") / "session.db").exists()


OTHER_OPTIONS = [
    "-o x", "--config x.yaml", "--set map.resolution=0.1", "--sensor ust10lx", "--calibration x",
    "--require-intensity", "--scan-topic /a", "--odom-topic /a", "--imu-topic /a",
    "--sonar x.txt", "--sonar-topic /a", "--points-topic /a", "--sonar-ring pioneer-3dx",
    "--laser-pose 0,0,0", "--start 1", "--duration 1", "--every 2", "--echo last", "--strict",
]  # fmt: skip


@pytest.mark.parametrize("option", OTHER_OPTIONS)
def test_a_run_goes_on_as_it_was_begun(target, capsys, option):
    assert tried(capsys, "--resume", target, *option.split()) == (
        2,
        "--resume goes on with a run as it was begun: no other options "
        "(draw its results in another way afterwards: glassslam render)",
    )


def test_every_option_of_map_is_among_them():
    import inspect

    from glassslam.cli.map import map_command

    said = {option.split()[0].lstrip("-").replace("-", "_") for option in OTHER_OPTIONS}
    said = said - {"o", "set"} | {"output", "assignments"}
    assert said == set(inspect.signature(map_command).parameters) - {
        "recordings", "resume", "overwrite", "json", "quiet"
    }  # fmt: skip


def test_nobody_else_may_write_there_meanwhile(target, whole, capsys):
    with locked(target):
        assert tried(capsys, "--resume", target) == (
            1, f"another run is writing to {target} (wait for it, or choose another directory)",
        )  # fmt: skip
    assert main(["map", "--resume", str(target), "-q"]) == 0
    assert_same_results(target, whole)


def test_of_two_that_go_on_at_the_same_time_one_does(target, whole):
    first, second = (start(["map", "--resume", target, "-q"], target.parent, pause=0.005) for _ in range(2))
    outcomes = sorted((p.wait(), p.communicate()[1]) for p in (first, second))
    assert outcomes[0] == (0, "")
    assert outcomes[1] == (
        1, f"error: another run is writing to {target} (wait for it, or choose another directory)\n"
    )  # fmt: skip
    assert_same_results(target, whole)


def test_a_session_that_another_program_reads_is_waited_for(target, capsys):
    import sqlite3

    database = sqlite3.connect(target.with_name("run.partial") / "session.db", isolation_level=None)
    database.execute("PRAGMA locking_mode = EXCLUSIVE")
    database.execute("BEGIN EXCLUSIVE")
    code, line = tried(capsys, "--resume", target)
    database.close()
    assert code == 1
    assert line.startswith(f"another program is using {target.with_name('run.partial') / 'session.db'} (wait")


def test_the_report_is_printed_when_a_run_goes_on(target, capsys):
    import json

    assert main(["map", "--resume", str(target), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["directory"] == str(target)
    assert report["scans"]["used"] == 316
