"""What is recalled of a run belongs to its scans: a recording that holds others is refused."""

import shutil
from dataclasses import replace

import numpy as np
import pytest
from session_worlds import WORDS, assert_same_results, interrupted, results, rows_of

from glassslam.cli import main
from glassslam.errors import SessionError
from glassslam.records import LaserScan
from glassslam.session import Session, identity
from glassslam.slam.mapper import Mapper
from glassslam.sources import SourceOptions, open_recording

KNOWN = 149
HINT = "go on with the recording as it was, or map this one anew, with --overwrite"
BEGIN = "the recording is not what it was when the run began: "


@pytest.fixture(scope="module")
def source(bag):
    """Where the laser sits, and all records of the recording."""
    recording = open_recording([bag], SourceOptions())
    return recording.info.base_from_laser, [*recording.records()]


@pytest.fixture
def session(partial_run, tmp_path):
    """The interrupted run, open."""
    shutil.copyfile(partial_run / "session.db", tmp_path / "session.db")
    with Session.open(tmp_path / "session.db") as session:
        assert session.journal.scans == KNOWN
        yield session


def counts(session):
    return [rows_of(session._database, table) for table in ("scans", "nodes", "rounds", "searches")]


def changed(records, number, change):
    """The records with another scan in place of one of them; without it where that is None."""
    count, kept = -1, []
    for record in records:
        count += isinstance(record, LaserScan)
        if isinstance(record, LaserScan) and count == number:
            other = change(record)
            kept += [] if other is None else [other]
        else:
            kept.append(record)
    return kept


def refused(session, place, records):
    """What is told of a recording that is gone on with."""
    before = counts(session)
    mapper = Mapper(session.config, place, session.journal)
    try:
        with pytest.raises(SessionError) as raised:  # noqa: PT012  (anywhere on the way)
            for record in records:
                mapper.add(record)
            mapper.settle()
    finally:
        mapper.close()
    session.journal.flush()
    assert counts(session) == before
    assert raised.value.hint == HINT
    assert raised.value.message.startswith(BEGIN)
    return raised.value.message.removeprefix(BEGIN)


def test_the_same_records_are_gone_on_with(session, source):
    place, records = source
    mapper = Mapper(session.config, place, session.journal)
    for record in records:
        mapper.add(record)
    assert len(mapper.settle().tracks.final.stamps) == 316


@pytest.mark.parametrize("number", [0, 70, KNOWN - 1])
def test_a_scan_that_is_missing(session, source, number):
    place, records = source
    stamps = [record.stamp for record in records if isinstance(record, LaserScan)]
    told = refused(session, place, changed(records, number, lambda scan: None))
    assert told == f"scan {number} is of {stamps[number + 1]:.6f} s, and was of {stamps[number]:.6f} s"


@pytest.mark.parametrize("number", [1, 70, 71])
def test_a_scan_that_has_lost_returns(session, source, number):
    def blinded(scan):
        ranges = scan.ranges.copy()
        ranges[:60] = np.nan
        return replace(scan, ranges=ranges)

    place, records = source
    told = refused(session, place, changed(records, number, blinded))
    assert told.startswith(f"scan {number} has ")
    assert " returns, and had " in told


def test_a_scan_with_other_returns_as_many_as_before(session, source):
    def longer(scan):
        ranges = scan.ranges.copy()
        ranges[np.nanargmin(ranges)] += 0.001
        return replace(scan, ranges=ranges)

    place, records = source
    numbers = [node.scan for node in session.nodes()]
    told = refused(session, place, changed(records, numbers[20], longer))
    assert told == f"scan {numbers[20]} has other returns"


@pytest.mark.parametrize("count", [0, 60, KNOWN - 1])
def test_a_recording_that_ends_before_what_is_known_of_it(session, source, count):
    place, records = source
    scans = [record for record in records if isinstance(record, LaserScan)]
    first = [record for record in records if count and record.stamp <= scans[count - 1].stamp]
    assert refused(session, place, first) == f"it ends after {count} of the {KNOWN} scans known of it"


def test_a_bad_block_of_a_recording_too_long_to_be_read_twice(bag, whole, tmp_path, monkeypatch, capsys):
    """The digest of a long recording sees a part of it; the scans themselves tell what it has not seen."""
    monkeypatch.setattr(identity, "_BLOCK", 1024)
    monkeypatch.setattr(identity, "_BLOCKS", 4)
    own, run = tmp_path / "ring.bag", tmp_path / "run"
    shutil.copyfile(bag, own)
    assert interrupted(["map", str(own), "-o", str(run), *WORDS], 200) == 130
    content = bytearray(own.read_bytes())
    middle = len(content) // 3 + 20_000
    content[middle : middle + 40_000] = bytes(40_000)
    own.write_bytes(content)
    capsys.readouterr()
    assert main(["map", "--resume", str(run), "-q"]) == 1
    error = capsys.readouterr().err
    assert error.startswith(f"error: {BEGIN}scan ")
    assert error.endswith(f" ({HINT})\n")
    assert error.count("\n") == 1
    with Session.open(run.with_name("run.partial") / "session.db") as kept:
        assert kept.journal.scans == 199
    shutil.copyfile(bag, own)
    assert main(["map", "--resume", str(run), "-q"]) == 0
    expected = tmp_path / "expected"
    assert main(["map", str(own), "-o", str(expected), *WORDS]) == 0
    assert_same_results(run, results(expected))
    assert results(run)["map.pgm"] == whole["map.pgm"]
