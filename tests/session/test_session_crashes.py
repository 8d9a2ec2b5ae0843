"""A run that is killed anywhere and taken up again ends with the same bytes, session and all."""

import random
import shutil
import sqlite3
from functools import partial
from pathlib import Path

import pytest
from session_worlds import WORDS, assert_same_results, rows_of, snapshot

from glassslam.cli import main
from glassslam.session import Session, session
from glassslam.session.journal import SessionJournal
from glassslam.session.schema import TABLES


class Killed:
    """What would be left of a run had it been killed after each of its commits, or after some of them."""

    def __init__(self, home, wanted=None):
        self.home, self.wanted = home, wanted
        self.left, self.known = [], []

    def journal(self, database, path):
        return _Copying(self, database, path)

    def take(self, folder, known):
        n = len(self.known)
        self.known.append(known)
        if self.wanted is None or n in self.wanted:
            self.left.append(snapshot(folder, self.home / f"{n}" / "run.partial"))


class _Copying(SessionJournal):
    def __init__(self, killed, database, path):
        super().__init__(database, path, seconds=0.0)
        self._killed = killed
        self._take()

    def flush(self):
        super().flush()
        self._take()

    def _take(self):
        self._killed.take(self._path.parent, (self.scans, self._rounds, self._searches))


@pytest.fixture(scope="module")
def killed(bag, tmp_path_factory):
    """The sessions a run leaves that writes down every scan at once, one for each moment."""
    home = tmp_path_factory.mktemp("killed")
    killed = Killed(home)
    before, session.SessionJournal = session.SessionJournal, killed.journal
    try:
        assert main(["map", str(bag), "-o", str(home / "run"), *WORDS]) == 0
    finally:
        session.SessionJournal = before
    return killed


def resumed(partial_folder, tmp_path, name="run"):
    """The code and the results directory of going on with what a killed run has left."""
    shutil.copytree(partial_folder, tmp_path / f"{name}.partial")
    return main(["map", "--resume", str(tmp_path / name), "-q"]), tmp_path / name


def rows(folder):
    """Numbers of scans, rounds and searches in a session."""
    with Session.open(folder / "session.db") as opened:
        return tuple(rows_of(opened._database, table) for table in ("scans", "rounds", "searches"))


def test_the_run_holds_what_can_go_wrong(whole):
    report = whole["report.json"]
    assert report["closures"]["accepted"] >= 5
    assert report["submaps"] >= 10
    assert report["glass"]["locked_cells"] > 100


def test_every_moment_was_seen(killed, tmp_path):
    assert len(killed.left) > 300
    assert killed.known == sorted(killed.known)
    assert killed.known[0] == (0, 0, 0)
    assert killed.known[-1] >= (300, 5, 5)
    for k in range(0, len(killed.left), 25):
        assert rows(shutil.copytree(killed.left[k], tmp_path / f"{k}")) == killed.known[k]


@pytest.mark.parametrize("share", [0.0, 0.15, 0.5, 0.83, 0.99, 1.0])
def test_going_on_gives_the_same_bytes(killed, whole, tmp_path, share):
    code, folder = resumed(killed.left[round(share * (len(killed.left) - 1))], tmp_path)
    assert code == 0
    assert_same_results(folder, whole)
    assert [path.name for path in tmp_path.iterdir()] == ["run"]


@pytest.mark.slow
def test_going_on_from_every_fourth_moment_gives_the_same_bytes(killed, whole, tmp_path):
    for k, folder in enumerate(killed.left[::4]):
        code, run = resumed(folder, tmp_path, f"run{k}")
        assert code == 0, k
        assert_same_results(run, whole)
        shutil.rmtree(run)


def test_a_run_may_be_killed_again_and_again(killed, whole, tmp_path, monkeypatch):
    """Every time it is taken up it is killed once more, 70 commits later."""
    seen, folder = [], killed.left[5]
    for k in range(4):
        again = Killed(tmp_path / f"{k}", {70})
        monkeypatch.setattr(session, "SessionJournal", again.journal)
        code, run = resumed(folder, tmp_path, f"run{k}")
        assert code == 0
        assert_same_results(run, whole)
        (folder,) = again.left
        seen.append(again.known[70][0])
    assert seen == sorted(set(seen))
    assert seen[-1] - seen[0] > 200


def torn(folder, target, share):
    """The same session with its log cut off, as a disk without power leaves it."""
    shutil.copytree(folder, target)
    log = target / "session.db-wal"
    content = log.read_bytes()
    log.write_bytes(content[: int(share * len(content))])
    return target


def test_a_torn_log_leaves_an_earlier_moment(killed, tmp_path):
    """Wherever it is cut, what is read back is what there was after one of the commits before."""
    shares, lost = random.Random(5), []
    logs = [k for k, folder in enumerate(killed.left) if (folder / "session.db-wal").stat().st_size > 50_000]
    for n in range(40):
        k = shares.choice(logs)
        found = rows(torn(killed.left[k], tmp_path / f"torn{n}", shares.random()))
        assert found in killed.known[: k + 1]
        lost.append(killed.known[k][0] - found[0])
    assert max(lost) > 20


@pytest.mark.parametrize("seed", range(2))
def test_going_on_from_a_torn_log_gives_the_same_bytes(killed, whole, tmp_path, seed):
    shares = random.Random(seed)
    folder = torn(killed.left[-1 - shares.randrange(200)], tmp_path / "torn", shares.random())
    code, run = resumed(folder, tmp_path)
    assert code == 0
    assert_same_results(run, whole)


@pytest.mark.parametrize("damage", [bytes(5000), b"\xff" * 64], ids=["zeros", "ones"])
def test_a_log_with_a_hole_leaves_an_earlier_moment(killed, tmp_path, damage):
    places = random.Random(7)
    for n in range(10):
        folder = shutil.copytree(killed.left[-1], tmp_path / f"hole{n}")
        log = bytearray((folder / "session.db-wal").read_bytes())
        at = places.randrange(len(log) - len(damage))
        log[at : at + len(damage)] = damage
        (folder / "session.db-wal").write_bytes(log)
        assert rows(folder) in killed.known


def test_without_its_log_a_session_is_one_of_an_earlier_moment(killed, whole, tmp_path):
    folder = shutil.copytree(killed.left[-1], tmp_path / "nolog")
    (folder / "session.db-wal").unlink()
    code, run = resumed(folder, tmp_path)
    assert code == 0
    assert_same_results(run, whole)


@pytest.mark.parametrize("state", ["searching", "saved", "written", "compact", "retired", "published"])
def test_a_kill_at_the_end_of_a_run(bag, whole, tmp_path, monkeypatch, state):
    """Between the last scan and the last file: what stands there is taken up, and no results are lost."""
    target = tmp_path / "run"
    target.mkdir()
    (target / "map.pgm").write_text("old")

    class Kill(BaseException):
        pass

    def kill(*_, **__):
        raise Kill

    stop_at(state, monkeypatch, kill)
    with pytest.raises(Kill):
        main(["map", str(bag), "-o", str(target), "--overwrite", *WORDS])
    monkeypatch.undo()
    if state not in ("retired", "published"):
        assert (target / "map.pgm").read_text() == "old"
    assert main(["map", "--resume", str(target), "-q"]) == 0
    assert_same_results(target, whole)
    assert [path.name for path in tmp_path.iterdir()] == ["run"]


def stop_at(state, monkeypatch, kill):
    """Let a run be killed at one of the steps of its end, without any tidying up after it."""
    from glassslam.outputs import directory, results
    from glassslam.slam.global_slam import GlobalSlam

    monkeypatch.setattr(directory, "_clear", lambda *_: None)
    monkeypatch.setattr(Session, "close", Session.abandon)
    plain_rmtree = shutil.rmtree
    match state:
        case "searching":
            monkeypatch.setattr(GlobalSlam, "finish", kill)
        case "saved":
            monkeypatch.setattr(results, "write_files", kill)
        case "written":
            monkeypatch.setattr(Session, "settle_in", kill)
        case "compact":
            monkeypatch.setattr(session.os, "replace", kill)
        case "retired":

            def publish(staged, target, retired):
                # no exception handler may put anything back: a process that is killed has none
                target.rename(retired)
                kill()

            monkeypatch.setattr(directory, "_publish", publish)
        case "published":
            monkeypatch.setattr(directory.shutil, "rmtree", partial(kill_after_publish, kill, plain_rmtree))


def kill_after_publish(kill, rmtree, path, *rest, **options):
    if Path(path).name == ".run.replaced" and Path(path).exists():
        kill()
    rmtree(path, *rest, **options)


def test_every_table_is_compared(whole):
    database = sqlite3.connect(":memory:")
    database.deserialize(whole["session.db"])
    assert {row[0] for row in database.execute("SELECT name FROM sqlite_schema WHERE type = 'table'")} == set(
        TABLES
    )
    assert all(rows_of(database, table) for table in TABLES)
    database.close()
