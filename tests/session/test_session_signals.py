"""Ctrl-C and SIGTERM: an orderly end with a map of what there is, and the same bytes in the end."""

import json
import os
import signal
import sqlite3
import threading
import time

import pytest
from session_worlds import (
    PATH,
    WORDS,
    assert_same_results,
    ended,
    interrupted,
    ringing_after,
    start,
)

from glassslam.cli import main
from glassslam.outputs import RESULT_FILES
from glassslam.slam.global_slam import GlobalSlam
from glassslam.sources.recording import Recording


@pytest.fixture
def words(bag, tmp_path):
    return ["map", str(bag), "-o", str(tmp_path / "run"), *WORDS]


@pytest.fixture
def old(tmp_path):
    """Earlier results in the directory."""
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "map.pgm").write_text("old")
    return tmp_path / "run" / "map.pgm"


def go_on(target):
    return main(["map", "--resume", str(target), "-q"])


def report_of(folder):
    return json.loads((folder / "report.json").read_text())


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_the_first_signal_leaves_a_map_of_what_there_is(words, whole, tmp_path, capsys, number, code):
    assert interrupted(words, 200, number) == code
    target, partial = tmp_path / "run", tmp_path / "run.partial"
    report = report_of(partial)
    scans, seconds = report["scans"]["used"], report["recording_seconds"]
    assert 200 <= scans == report["scans"]["read"] < 230
    assert capsys.readouterr() == (
        "",
        f"error: interrupted after {report['scans']['read']} scans, {seconds:.1f} s; a map of them is in "
        f"run.partial (go on: glassslam map --resume {target})\n",
    )
    assert {*RESULT_FILES, "session.db"} <= {path.name for path in partial.iterdir()}
    assert report["warnings"] == [
        f"interrupted after {report['scans']['read']} scans, {seconds:.1f} s: the rest is not in this map"
    ]
    assert "the rest is not in this map" in (partial / "report.html").read_text()
    assert not target.exists()
    assert go_on(target) == 0
    assert_same_results(target, whole)
    assert [path.name for path in tmp_path.iterdir()] == ["run"]


def test_what_follows_a_signal_is_no_part_of_the_run(words, tmp_path):
    interrupted(words, 100)
    database = sqlite3.connect(tmp_path / "run.partial" / "session.db")
    scans, last = database.execute("SELECT count(*), max(number) FROM scans").fetchone()
    assert scans == last + 1 == 99
    assert database.execute("SELECT name FROM facts WHERE name = 'is_whole'").fetchall() == []
    database.close()


def test_a_run_may_be_interrupted_many_times(words, whole, tmp_path):
    codes = [interrupted(words, 60)]
    for scans in (30, 90, 150, 250, 300):  # the second one while it reads what it knows
        codes.append(interrupted(["map", "--resume", str(tmp_path / "run"), "-q"], scans))
        assert scans <= report_of(tmp_path / "run.partial")["scans"]["used"] < scans + 30
    assert codes == [130] * 6
    assert go_on(tmp_path / "run") == 0
    assert_same_results(tmp_path / "run", whole)


def test_a_signal_while_reading_what_is_known_loses_nothing(words, tmp_path):
    interrupted(words, 250)
    interrupted(["map", "--resume", str(tmp_path / "run"), "-q"], 20)
    database = sqlite3.connect(tmp_path / "run.partial" / "session.db")
    assert database.execute("SELECT count(*) FROM scans").fetchone()[0] == 249
    database.close()


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_the_second_signal_ends_at_once(words, whole, old, tmp_path, capsys, number, code):
    with ringing_after(200, number, times=2):
        assert main([*words, "--overwrite"]) == code
    assert capsys.readouterr().err == (
        f"error: interrupted (go on: glassslam map --resume {tmp_path / 'run'})\n"
    )
    kept = {"session.db", "session.db-wal", "session.db.overwrite"}
    assert {path.name for path in (tmp_path / "run.partial").iterdir()} <= kept
    assert old.read_text() == "old"
    assert go_on(tmp_path / "run") == 0
    assert_same_results(tmp_path / "run", whole)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_before_the_first_scan(words, whole, tmp_path, monkeypatch, capsys, number):
    records = Recording.records

    def rung(self):
        signal.raise_signal(number)
        return records(self)

    monkeypatch.setattr(Recording, "records", rung)
    assert main(words) == 128 + number
    monkeypatch.undo()
    assert capsys.readouterr().err == (
        f"error: interrupted after 0 scans, 0.0 s; before there was a map "
        f"(go on: glassslam map --resume {tmp_path / 'run'})\n"
    )
    assert go_on(tmp_path / "run") == 0
    assert_same_results(tmp_path / "run", whole)


def test_a_signal_while_the_recording_is_opened_leaves_nothing(words, tmp_path, monkeypatch, capsys):
    def rung(*_):
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr("glassslam.sources.open_recording", rung)
    assert main(words) == 130
    assert capsys.readouterr().err == "error: interrupted\n"
    assert list(tmp_path.iterdir()) == []


def test_a_signal_while_the_session_is_made_leaves_nothing(words, tmp_path, monkeypatch):
    def rung(*_):
        signal.raise_signal(signal.SIGTERM)

    monkeypatch.setattr("glassslam.session.session.create", rung)
    assert main(words) == 143
    assert list(tmp_path.iterdir()) == []


def test_a_signal_while_the_last_loops_are_closed(words, whole, tmp_path, monkeypatch, capsys):
    finish = GlobalSlam.finish

    def rung(self):
        signal.raise_signal(signal.SIGINT)
        finish(self)

    monkeypatch.setattr(GlobalSlam, "finish", rung)
    assert main(words) == 130
    monkeypatch.undo()
    assert f"interrupted after {len(PATH)} scans" in capsys.readouterr().err
    assert report_of(tmp_path / "run.partial")["scans"]["used"] == len(PATH)
    assert go_on(tmp_path / "run") == 0
    assert_same_results(tmp_path / "run", whole)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_while_results_are_written(words, whole, old, tmp_path, monkeypatch, capsys, number):
    from glassslam.outputs import results as written

    def rung(*_):
        signal.raise_signal(number)

    monkeypatch.setattr(written, "write_g2o", rung)
    assert main([*words, "--overwrite"]) == 128 + number
    monkeypatch.undo()
    assert capsys.readouterr().err == (
        f"error: interrupted (go on: glassslam map --resume {tmp_path / 'run'})\n"
    )
    assert old.read_text() == "old"
    assert go_on(tmp_path / "run") == 0
    assert_same_results(tmp_path / "run", whole)


def test_a_run_in_another_thread_hears_no_signals_and_ends_as_ever(words, whole, tmp_path):
    before, codes = signal.getsignal(signal.SIGINT), []
    thread = threading.Thread(target=lambda: codes.append(main(words)))
    thread.start()
    thread.join()
    assert codes == [0]
    assert signal.getsignal(signal.SIGINT) is before
    assert_same_results(tmp_path / "run", whole)


def test_the_handlers_of_a_program_come_back(words, tmp_path):
    before = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)
    interrupted(words, 50)
    assert (signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)) == before


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_process_that_hears_a_signal(words, whole, tmp_path, number, code):
    """From outside, once its session holds some scans."""
    process, log = start(words, tmp_path, pause=0.02), tmp_path / "run.partial" / "session.db-wal"
    while process.poll() is None and not (log.exists() and log.stat().st_size):
        time.sleep(0.01)
    os.kill(process.pid, number)
    exit_code, error = ended(process)
    assert (exit_code, error.count("\n")) == (code, 1)
    assert error.startswith("error: interrupted after ")
    assert go_on(tmp_path / "run") == 0
    assert_same_results(tmp_path / "run", whole)


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_process_that_hears_a_signal_as_it_begins(words, tmp_path, number, code):
    """Before there is a session nothing stays, and there is nothing to go on with."""
    process = start(words, tmp_path)
    while process.poll() is None and not list(tmp_path.iterdir()):
        pass  # until its lock appears
    os.kill(process.pid, number)
    exit_code, error = ended(process)
    assert (exit_code, error.count("\n")) == (code, 1)
    if not (tmp_path / "run.partial").exists():
        assert list(tmp_path.iterdir()) == []
        assert go_on(tmp_path / "run") == 2
