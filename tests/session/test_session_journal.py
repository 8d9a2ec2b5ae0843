"""The journal of a run: what is kept, when it is written, and what a later run recalls."""

import shutil
from dataclasses import replace

import numpy as np
import pytest
from sameness import differences
from session_worlds import rows_of

from glassslam.errors import OutputError, SessionError
from glassslam.session import Session
from glassslam.session.database import open_existing
from glassslam.session.journal import SessionJournal
from glassslam.slam.closure import Candidate, Closure
from glassslam.slam.journal import ScanOutcome
from glassslam.slam.node import Node
from glassslam.slam.tracking import Match, Tracking


class Clock:
    def __init__(self):
        self.now = 50.0

    def __call__(self):
        return self.now


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def path(tmp_path):
    """An empty session."""
    recording = tmp_path / "run.bag"
    recording.write_bytes(b"scans")
    with Session.create(tmp_path / "session.db", [recording]):
        pass
    return tmp_path / "session.db"


@pytest.fixture
def opened():
    """Opens journals of session files and closes them at the end."""
    databases = []

    def open_journal(path, **options):
        databases.append(open_existing(path))
        return SessionJournal(databases[-1], path, **options)

    yield open_journal
    for database in databases:
        database.close()


def outcome(k, is_node=False):
    match = Match(np.array([0.1 * k, -0.2, 0.3]), 0.25, 100 + k, 0.5, 0.1, 0.9)
    return ScanOutcome(match, Tracking(0.4, k, k), 90 + k, is_node)


def node(k):
    points = np.full((3, 2), k, dtype=np.float32)
    return Node(k, 2 * k, 100.0 + k, np.array([k, 0.0, 0.0]), np.zeros(2), points, points[:1], 0.2)


def closure(k, rejected=""):
    place = np.array([k, 0.5, -0.5])
    candidate = Candidate(60 + k, k, 0, place, place + 1.0, 0.5, 0.2, np.eye(3))
    return Closure(candidate, rejected, place, 0.1 * np.eye(3), ambiguous=k == 1, searched=True)


def copied(path, target):
    """What a process killed in this moment would leave."""
    target.mkdir()
    for file in path.parent.glob("session.db*"):
        shutil.copyfile(file, target / file.name)
    return target / path.name


def known_scans(journal):
    return [*iter(journal.recall_scan, None)]


def test_a_later_run_recalls_scans_and_rounds_in_their_order(path, opened):
    rounds = [[closure(0), closure(1, "low score")], [], [closure(2)]]
    journal = opened(path)
    for k in range(5):
        journal.keep_scan(10.0 + k, outcome(k, is_node=k == 3), node(0) if k == 3 else None)
    for found in rounds:
        journal.keep_round(found)
    journal.flush()
    journal._database.close()

    later = opened(path)
    assert later.scans == 5
    assert differences([outcome(k, is_node=k == 3) for k in range(5)], known_scans(later)) == []
    assert differences(rounds, [*iter(later.recall_round, None)]) == []
    assert later.recall_scan() is None
    assert later.recall_round() is None


def test_a_run_that_goes_on_adds_to_what_is_known(path, opened):
    first = opened(path)
    first.keep_scan(0.0, outcome(0), None)
    first.keep_round([closure(0)])
    first.flush()
    first._database.close()
    second = opened(path)
    while second.recall_scan() is not None:
        pass
    while second.recall_round() is not None:
        pass
    second.keep_scan(1.0, outcome(1), None)
    second.keep_round([closure(1), closure(2)])
    second.flush()
    assert second.recall_scan() is None  # what the run has written itself it need not recall
    second._database.close()
    third = opened(path)
    assert differences([outcome(0), outcome(1)], known_scans(third)) == []
    assert differences([[closure(0)], [closure(1), closure(2)]], [*iter(third.recall_round, None)]) == []


def reopened(path, opened):
    """A journal that knows two scans, the second a node, and a round of two searches."""
    first = opened(path)
    first.keep_scan(7.0, outcome(0), None)
    first.keep_scan(7.1, outcome(1, is_node=True), node(0))
    first.keep_round([closure(0), closure(1)])
    first.flush()
    first._database.close()
    return opened(path)


def test_what_is_recalled_is_confirmed_by_what_comes(path, opened):
    later = reopened(path, opened)
    later.recall_scan()
    later.confirm_scan(7.0, 90, None)
    later.recall_scan()
    nearly = node(0)
    later.confirm_scan(7.1, 91, replace(nearly, returns=nearly.returns + np.float32(1e-6)))
    later.confirm_end()
    later.recall_round()
    later.confirm_round(range(60, 62))


OTHERS = {
    "stamp": ((7.0625, 91, node(0)), "scan 1 is of 7.062500 s, and was of 7.100000 s"),
    "returns": ((7.1, 80, node(0)), "scan 1 has 80 returns, and had 91"),
    "no node": ((7.1, 91, None), "scan 1 does not add to the map, unlike before"),
    "points": ((7.1, 91, node(1)), "scan 1 has other returns"),
    "fewer points": ((7.1, 91, replace(node(0), returns=node(0).returns[:2])), "scan 1 has other returns"),
    "ghosts": ((7.1, 91, replace(node(0), ghosts=node(0).returns)), "scan 1 has other returns"),
}


@pytest.mark.parametrize("what", OTHERS)
def test_another_scan_in_the_place_of_one_that_is_known(path, opened, what):
    later = reopened(path, opened)
    later.recall_scan()
    later.recall_scan()
    now, told = OTHERS[what]
    with pytest.raises(SessionError) as raised:
        later.confirm_scan(*now)
    assert raised.value.message == f"the recording is not what it was when the run began: {told}"


def test_a_node_where_there_was_none(path, opened):
    later = reopened(path, opened)
    later.recall_scan()
    with pytest.raises(SessionError, match="scan 0 adds to the map, unlike before"):
        later.confirm_scan(7.0, 90, node(0))


def test_an_end_before_all_that_is_known(path, opened):
    later = reopened(path, opened)
    later.recall_scan()
    with pytest.raises(SessionError, match="it ends after 1 of the 2 scans known of it"):
        later.confirm_end()


@pytest.mark.parametrize(("nodes", "other"), [(range(61), 61), (range(61, 90), 60)])
def test_searches_that_were_made_for_other_nodes(path, opened, nodes, other):
    later = reopened(path, opened)
    later.recall_round()
    with pytest.raises(SessionError, match=f"round 0 of searches was made for node {other}, which is not"):
        later.confirm_round(nodes)


def test_it_is_written_about_once_a_second(path, opened, clock, tmp_path):
    journal = opened(path, clock=clock)
    written = []
    for k in range(35):
        journal.keep_scan(0.1 * k, outcome(k), None)
        survivor = opened(copied(path, tmp_path / f"killed{k}"))
        written.append(survivor.scans)
        clock.now += 0.1
    # the scans of a second together, at the first scan that comes after it
    assert sorted(set(written)) == [0, 11, 21, 31]
    assert written[10:12] == [11, 11]
    assert all(k + 1 - found <= 10 for k, found in enumerate(written))


def test_with_no_time_between_every_scan_is_written(path, opened, tmp_path):
    journal = opened(path, seconds=0.0)
    for k in range(3):
        journal.keep_scan(0.1 * k, outcome(k), None)
        assert opened(copied(path, tmp_path / f"killed{k}")).scans == k + 1


def test_a_scan_and_its_node_are_written_together(path, opened, tmp_path, clock):
    journal = opened(path, clock=clock)
    for k in range(30):
        clock.now += 0.3
        journal.keep_scan(0.1 * k, outcome(k, is_node=True), node(k))
        database = open_existing(copied(path, tmp_path / f"killed{k}"))
        counts = [rows_of(database, table) for table in ("scans", "nodes")]
        database.close()
        assert counts[0] == counts[1]


def test_what_an_orderly_end_has_not_written_yet_is_written_at_its_close(tmp_path, path):
    with Session.open(path) as session:
        session.journal.keep_scan(0.0, outcome(0), None)
    with Session.open(path) as session:
        assert session.journal.scans == 1


def test_an_end_by_an_error_writes_nothing_more(path):
    def fail():
        with Session.open(path) as session:
            session.journal.keep_scan(0.0, outcome(0), None)
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    with Session.open(path) as session:
        assert session.journal.scans == 0


def test_a_full_disk_costs_nothing_that_was_written_before(path, opened):
    journal = opened(path)
    journal.keep_scan(0.0, outcome(0), None)
    journal.flush()
    pages = journal._database.execute("PRAGMA page_count").fetchone()[0]
    journal._database.execute(f"PRAGMA max_page_count = {pages + 2}")
    for k in range(1, 500):
        journal.keep_scan(0.1 * k, outcome(k, is_node=True), node(k))
    with pytest.raises(OutputError, match=r"cannot write .*session\.db: database or disk is full") as raised:
        journal.flush()
    assert raised.value.hint == "free some space, or make it writable"
    assert not journal._database.in_transaction
    journal._database.execute("PRAGMA max_page_count = 1000000")
    journal.flush()  # what could not be written is still there
    journal._database.close()
    assert opened(path).scans == 500


DAMAGES = {
    "DELETE FROM scans WHERE number = 1": "row 1 of 'scans' is missing",
    "UPDATE scans SET how = 17 WHERE number = 1": "a row is not what was written",
    "UPDATE scans SET x = x + 0.001 WHERE number = 1": "a row is not what was written",
    "UPDATE scans SET x = NULL WHERE number = 1": "a row is not what was written",
    "UPDATE scans SET residual = x'00' WHERE number = 1": "a row is not what was written",
    "DELETE FROM nodes": "row 0 of 'nodes' is missing",
    "UPDATE nodes SET returns = x'0000' WHERE number = 0": "a row is not what was written",
    "DELETE FROM rounds WHERE number = 0": "row 0 of 'rounds' is missing",
    "DELETE FROM searches WHERE number = 1": "row 1 of 'searches' is missing",
    "UPDATE searches SET numbers = x'0011' WHERE number = 1": "a row is not what was written",
    "UPDATE rounds SET searches = 3": "a row is not what was written",
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_rows_that_are_not_what_was_written_end_the_run(path, opened, damage):
    journal = opened(path)
    for k in range(3):
        journal.keep_scan(0.1 * k, outcome(k, is_node=k == 2), node(0) if k == 2 else None)
    journal.keep_round([closure(0), closure(1)])
    journal.keep_round([])
    journal.flush()
    journal._database.execute(damage)
    journal._database.close()
    later = opened(path)
    with pytest.raises(SessionError) as raised:  # noqa: PT012  (by one of the two)
        known_scans(later)
        list(iter(later.recall_round, None))
    assert DAMAGES[damage] in raised.value.message
    assert raised.value.message.startswith(f"{path} is damaged: ")
    assert raised.value.hint == f"save what there is: glassslam recover {path.parent.name}"
