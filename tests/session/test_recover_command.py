"""`glassslam recover`: what is saved of a damaged session, and that the rest gives the same bytes."""

import shutil
import sqlite3

import numpy as np
import pytest
from session_worlds import assert_same_results

from glassslam.cli import main
from glassslam.errors import SessionError
from glassslam.session import SESSION_FILE, Session
from glassslam.session.salvage import salvage


@pytest.fixture
def finished(whole_run, tmp_path):
    """A finished run of its own; its session."""
    shutil.copytree(whole_run, tmp_path / "run")
    return tmp_path / "run" / SESSION_FILE


@pytest.fixture
def cut(partial_run, tmp_path):
    """An interrupted run of its own; its session."""
    shutil.copytree(partial_run, tmp_path / "run.partial")
    return tmp_path / "run.partial" / SESSION_FILE


def turn_bytes(path, count, seed, first=4096):
    """Change single bytes of a file behind its first page."""
    data, random = bytearray(path.read_bytes()), np.random.default_rng(seed)
    for place in random.integers(first, len(data), count):
        data[place] ^= 0x5A
    path.write_bytes(data)


def goes_on(target, whole):
    assert main(["map", "--resume", str(target), "-q"]) == 0
    assert_same_results(target, whole)
    assert [path.name for path in target.parent.iterdir()] == [target.name]


def test_a_sound_session_is_left_alone(finished, whole, capsys):
    assert main(["recover", str(finished.parent)]) == 0
    assert capsys.readouterr() == (f"{finished} is sound: there is nothing to save\n", "")
    assert_same_results(finished.parent, whole)
    assert [path.name for path in finished.parent.parent.iterdir()] == ["run"]


@pytest.mark.parametrize("seed", range(3))
def test_turned_bytes_cost_what_they_touch(finished, whole, capsys, seed):
    turn_bytes(finished, 4, seed)
    damaged = finished.read_bytes()
    assert main(["recover", str(finished.parent)]) == 3
    told = capsys.readouterr().out
    assert told.startswith("saved ")
    assert f"glassslam map --resume {finished.parent}" in told
    assert finished.read_bytes() == damaged
    goes_on(finished.parent, whole)


@pytest.mark.parametrize("share", [0.3, 0.6, 0.95])
def test_a_file_that_is_cut_off(finished, whole, share):
    data = finished.read_bytes()
    finished.write_bytes(data[: int(share * len(data))])
    assert main(["recover", str(finished.parent)]) in (1, 3)
    if (finished.parent.parent / "run.partial").exists():
        goes_on(finished.parent, whole)


def test_without_its_first_page_nothing_is_lost(finished, whole, capsys):
    data = finished.read_bytes()
    finished.write_bytes(bytes(4096) + data[4096:])
    assert main(["recover", str(finished.parent)]) == 3
    assert capsys.readouterr().out.startswith("saved the whole run")
    goes_on(finished.parent, whole)


def test_a_session_in_work_is_replaced_and_kept(cut, whole, capsys):
    turn_bytes(cut, 3, 1)
    assert main(["recover", str(cut.parent.with_name("run"))]) == 3
    assert {f"{SESSION_FILE}.damaged", "map.pgm", "report.json"} <= {
        path.name for path in cut.parent.iterdir()
    }
    with Session.open(cut) as session:
        session.check()
        assert not session.is_finished
    goes_on(cut.parent.with_name("run"), whole)


def test_the_map_of_what_is_saved_is_like_that_of_the_run(finished, whole):
    turn_bytes(finished, 2, 7, first=len(finished.read_bytes()) // 2)
    assert main(["recover", str(finished.parent)]) == 3
    partial = finished.parent.with_name("run.partial")
    mine = np.loadtxt(partial / "trajectory.tum")
    its = np.loadtxt(finished.parent / "trajectory.tum")[: len(mine)]
    assert len(mine) > 50
    assert np.abs(mine[:, 1:3] - its[:, 1:3]).max() < 0.2


def test_a_number_that_was_changed_is_noticed(finished):
    """The database itself finds nothing wrong with it."""
    with sqlite3.connect(finished) as database:
        database.execute("UPDATE scans SET x = x + 0.01 WHERE number = 30")
    with Session.open(finished) as session, pytest.raises(SessionError, match="is not what was written"):
        session.check()
    saved = salvage(finished, finished.with_name("saved.db"))
    assert (saved.scans, saved.is_finished) == (30, False)
    assert saved.scans_beyond > 100


@pytest.mark.parametrize("seed", range(3))
def test_nothing_is_drawn_from_a_damaged_session(finished, capsys, seed):
    turn_bytes(finished, 20, seed)
    damaged = finished.read_bytes()
    assert main(["render", str(finished.parent), "-o", str(finished.parent.with_name("other"))]) == 1
    error = capsys.readouterr().err
    assert error.startswith(f"error: {finished} is damaged: ")
    assert error.endswith("(save what there is: glassslam recover run)\n")
    assert finished.read_bytes() == damaged
    assert [path.name for path in finished.parent.parent.iterdir()] == ["run"]


def test_without_its_recording_nothing_can_be_saved(finished, capsys):
    with sqlite3.connect(finished) as database:
        database.execute("UPDATE facts SET value = '[]' WHERE name = 'recordings'")
    assert main(["recover", str(finished.parent)]) == 1
    assert capsys.readouterr().err == (
        f"error: {finished} cannot be saved: what tells its recordings is lost "
        "(map the recording anew, with --overwrite)\n"
    )
    assert [path.name for path in finished.parent.parent.iterdir()] == ["run"]


def test_there_is_no_session(tmp_path, capsys):
    assert main(["recover", str(tmp_path / "none")]) == 2
    assert capsys.readouterr().err.startswith("error: there is no session for ")
