"""The disk is full wherever a run writes: one line says how to go on, and nothing that was done is lost."""

import itertools
import json
import resource
import shutil
import sqlite3
import sys
from pathlib import Path

import pytest
from session_worlds import PATH, assert_same_results, results, session_files, write_ring

sys.path.append(str(Path(__file__).parents[1] / "robustness"))
from test_disk_full import content, full_disk  # noqa: F401  (a fixture)

from glassslam.cli import main
from glassslam.errors import OutputError
from glassslam.outputs import Stopwatch, write_results
from glassslam.session import Session, database


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    return tmp_path_factory.mktemp("home")


@pytest.fixture(scope="module")
def words(home):
    """A run of a few scans."""
    bag = write_ring(home / "ring.bag", PATH[:10])
    return ["map", str(bag), "--set", "glass.detector=off", "--quiet"]


@pytest.fixture(scope="module")
def whole(words, home):
    assert main([*words, "-o", str(home / "whole")]) == 0
    return results(home / "whole")


@pytest.fixture
def target(tmp_path):
    """A directory with earlier results."""
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "map.pgm").write_text("old")
    return tmp_path / "run"


def is_waiting(target):
    return (target.with_name("run.partial") / "session.db").exists()


def check_failure(target, code, error):
    """One line says what is wrong and how to go on; earlier results are as they were."""
    assert code == 1
    assert error.startswith("error: cannot write ")
    assert error.count("\n") == 1
    assert ("full" in error) or ("I/O error" in error) or ("File too large" in error)
    assert [path.name for path in target.iterdir()] == ["map.pgm"]
    assert (target / "map.pgm").read_text() == "old"
    go_on = f"go on: glassslam map --resume {target})"
    if is_waiting(target):
        assert error.endswith(f"{go_on}\n")
        partial = target.with_name("run.partial")
        assert set(partial.iterdir()) == set(session_files(partial))
    else:
        assert go_on not in error
        assert [path.name for path in target.parent.iterdir()] == ["run"]


def go_on(target, words):
    """As the line says, once there is space again."""
    if is_waiting(target):
        return main(["map", "--resume", str(target), "-q"])
    return main([*words, "-o", str(target), "--overwrite"])


def put_back(target):
    shutil.rmtree(target)
    target.mkdir()
    (target / "map.pgm").write_text("old")


def test_a_disk_with_room_for_so_many_pages(words, whole, target, monkeypatch, capsys):
    """Of the session, for every number of pages up to all it needs."""
    plain_connect, seen = sqlite3.connect, set()

    def connect(limit):
        def connected(*arguments, **options):
            opened = plain_connect(*arguments, **options)
            opened.execute(f"PRAGMA max_page_count = {limit}")
            return opened

        return connected

    for pages in itertools.count(2):
        monkeypatch.setattr(database.sqlite3, "connect", connect(pages))
        code = main([*words, "-o", str(target), "--overwrite"])
        monkeypatch.undo()
        error = capsys.readouterr().err
        if code == 0:
            assert_same_results(target, whole)
            break
        check_failure(target, code, error)
        seen.add(is_waiting(target))
        assert go_on(target, words) == 0
        assert_same_results(target, whole)
        put_back(target)
    assert seen == {False, True}
    assert pages > 10


def test_a_disk_that_takes_files_up_to_so_many_bytes(words, whole, target, capsys):
    """Of the session, its log, its last copy, and every result."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    places = set()
    for size in (0, 1000, 5000, 20_000, *(int(33_000 * 1.2**k) for k in range(30))):
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
        try:
            code = main([*words, "-o", str(target), "--overwrite"])
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        error = capsys.readouterr().err
        if code == 0:
            assert_same_results(target, whole)
            break
        check_failure(target, code, error)
        places.add((is_waiting(target), error.split(": ")[1].split()[-1].endswith("session.db")))
        assert go_on(target, words) == 0
        assert_same_results(target, whole)
        put_back(target)
    assert code == 0
    assert (True, True) in places
    assert any(not waiting for waiting, _ in places)


@pytest.fixture
def unwritten(words, home, target, monkeypatch):
    """A finished run whose results are still to be written, in the working directory of `target`."""
    keep, made = home / "unwritten", []
    if not keep.exists():

        def fail(*_, **__):
            made.append(1)
            raise OutputError("no results yet")

        monkeypatch.setattr("glassslam.outputs.write_results", fail)
        assert main([*words, "-o", str(target), "--overwrite"]) == 1
        monkeypatch.undo()
        shutil.copytree(target.with_name("run.partial"), keep)
        shutil.rmtree(target.with_name("run.partial"))
    shutil.copytree(keep, target.with_name("run.partial"))
    return target.with_name("run.partial") / "session.db"


def written(path, target):
    """The results of the session of a finished run, written."""
    with Session.open(path) as session:
        result = session.load().result()
        write_results(result, target, overwrite=True, stopwatch=Stopwatch(), session=session)


def test_results_with_a_session_survive_a_disk_full_at_any_write(
    unwritten,
    target,
    whole,
    full_disk,  # noqa: F811
    monkeypatch,
):
    """Whatever fails, the session is still there, whole, and earlier results are as they were."""
    before, failures, folder = content(target), 0, unwritten.parent
    for n in itertools.count(1):
        disk, failed = full_disk(n), None
        try:
            written(unwritten, target)
        except OutputError as error:
            failed = error
        finally:
            monkeypatch.undo()
        if failed is None:
            assert_same_results(target, whole)
            if disk.calls < n:
                break
            target.rename(folder)  # what failed was not needed
            put_aside(folder, unwritten)
            target.mkdir()
            (target / "map.pgm").write_text("old")
            continue
        failures += 1
        assert "No space left on device" in failed.message, n
        assert content(target) == before, n
        assert set(folder.iterdir()) == set(session_files(folder)), n
        assert [path.name for path in target.parent.iterdir() if path not in (target, folder)] == [], n
    assert failures > 30
    report = json.loads((target / "report.json").read_text())
    assert report["scans"]["used"] == whole["report.json"]["scans"]["used"]


def put_aside(folder, session):
    """Leave only the session in a folder of results."""
    for path in folder.iterdir():
        if path != session:
            path.unlink()
