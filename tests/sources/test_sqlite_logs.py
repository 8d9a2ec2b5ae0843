"""Databases of ROS2 with what a recorder leaves beside them: all that was finished is read."""

import os
import shutil
import sqlite3

import numpy as np
import pytest
from damaged_bags import DRIVE, WHOLE, read
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from tiny_bags import T0, lone_file, odom, scan, write_ros2

from glassslam.errors import RecordingError
from glassslam.sources import SourceOptions, open_recording, sqlitelogs
from glassslam.sources.inspection import inspect_recording
from glassslam.sources.sqlite_kernels import wal_checksum
from glassslam.sources.sqlitepages import overlay_of

LONG = [m for k in range(60) for m in (odom(k / 10, 0.1 * k), scan(k / 10, [1.0 + k] * 2000))]
EARLY, ALL = 20, len(LONG)


@pytest.fixture(params=[512, 4096, 65536])
def recorder(request, tmp_path):
    """A database that holds the first messages; `more` writes the others and leaves the recorder running."""
    whole = lone_file(write_ros2(tmp_path / "written", LONG))
    path = tmp_path / "live" / "run.db3"
    path.parent.mkdir()
    shutil.copy(whole, path)
    database = sqlite3.connect(path, isolation_level=None)
    rows = database.execute("SELECT id, topic_id, timestamp, data FROM messages ORDER BY id").fetchall()
    database.execute("DELETE FROM messages WHERE id > ?", (EARLY,))
    database.execute(f"PRAGMA page_size = {request.param}")
    database.execute("VACUUM")

    def more(mode, *, upto=ALL, commit_every=10, last_commit=True):
        database.execute(f"PRAGMA journal_mode = {mode}")
        database.execute("PRAGMA wal_autocheckpoint = 0")
        database.execute("PRAGMA cache_size = 2")  # pages of long transactions are written before their end
        for start in range(EARLY, upto, commit_every):
            database.execute("BEGIN")
            chosen = rows[start : min(start + commit_every, upto)]
            database.executemany("INSERT INTO messages VALUES (?, ?, ?, ?)", chosen)
            if last_commit or start + commit_every < upto:
                database.execute("COMMIT")

    yield path, more
    database.close()


def killed(path, tmp_path):
    """The files as a recorder leaves them that is killed now; nothing may write to them."""
    folder = tmp_path / "killed"
    shutil.copytree(path.parent, folder)
    (folder / f"{path.name}-shm").unlink(missing_ok=True)
    return folder / path.name


def snapshot(folder):
    return {p.name: (p.read_bytes(), p.stat().st_mtime_ns) for p in folder.iterdir()}


@pytest.mark.parametrize("mode", ["WAL", "DELETE", "PERSIST", "TRUNCATE"])
def test_all_finished_transactions_are_read(recorder, tmp_path, mode):
    path, more = recorder
    more(mode)
    path = killed(path, tmp_path)
    before = snapshot(path.parent)
    records, damage = read(path, strict=True)
    assert [stamp for _, stamp in records] == [round(T0 + message.at, 3) for message in LONG]
    assert damage == ()
    assert snapshot(path.parent) == before


@pytest.mark.parametrize("mode", ["WAL", "DELETE"])
def test_an_unfinished_transaction_is_left_out(recorder, tmp_path, mode):
    path, more = recorder
    more(mode, commit_every=50, last_commit=False)
    path = killed(path, tmp_path)
    before = snapshot(path.parent)
    log = path.with_name(path.name + ("-wal" if mode == "WAL" else "-journal"))
    assert len(before[log.name][0]) > 0
    records, damage = read(path)
    assert len(records) == EARLY + 50
    assert [part.reason for part in damage] == [sqlitelogs.UNFINISHED]
    assert damage[0].messages_lost > 0
    assert snapshot(path.parent) == before
    with pytest.raises(RecordingError, match="a transaction that was never finished"):
        read(path, strict=True)


def test_as_sqlite_itself_would_merge_it(recorder, tmp_path):
    path, more = recorder
    more("WAL")
    path = killed(path, tmp_path)
    records, _ = read(path)
    with sqlite3.connect(path) as merged:
        merged.execute("PRAGMA journal_mode = DELETE")
        stored = merged.execute("SELECT count(*), min(timestamp), max(timestamp) FROM messages").fetchone()
    merged.close()
    assert not path.with_name("run.db3-wal").exists()
    assert stored[0] == len(records)
    assert read(path) == (records, ())


def test_a_log_of_another_round_is_not_read(recorder, tmp_path):
    """A checkpoint makes the recorder begin its log anew, over what stood in it."""
    path, more = recorder
    more("WAL")
    database = sqlite3.connect(path, isolation_level=None)
    database.execute("PRAGMA wal_checkpoint(RESTART)")
    database.execute("CREATE TABLE extra (x)")
    path = killed(path, tmp_path)
    database.close()
    records, damage = read(path, strict=True)
    assert (len(records), damage) == (len(LONG), ())
    overlay = overlay_of(path)
    assert 0 < len(overlay) < 10


@pytest.mark.parametrize("share", [0.3, 0.6, 0.99])
def test_a_damaged_log_counts_up_to_the_damage(recorder, tmp_path, share):
    path, more = recorder
    more("WAL", commit_every=1)
    path = killed(path, tmp_path)
    log = path.with_name("run.db3-wal")
    content = bytearray(log.read_bytes())
    content[int(share * len(content))] ^= 4
    log.write_bytes(content)
    records, damage = read(path)
    assert EARLY <= len(records) < len(LONG)
    assert len(records) >= EARLY + share * (len(LONG) - EARLY) - 8
    assert (damage[0].file, damage[0].reason) == (str(log), sqlitelogs.UNFINISHED)
    assert damage[0].offset + damage[0].bytes == len(content)


@pytest.mark.parametrize("content", [b"\1" * 5000, b"short", bytes(40)])
def test_something_else_beside_a_database(tmp_path, content):
    path = WHOLE["sqlite3"](tmp_path)
    complete, _ = read(path)
    log = path.with_name(path.name + "-wal")
    log.write_bytes(content)
    records, (damage,) = read(path)
    assert records == complete
    assert (damage.file, damage.bytes, damage.messages_lost) == (str(log), len(content), 0)
    assert damage.reason == "no log of this database"
    with pytest.raises(RecordingError, match="no log of this database"):
        read(path, strict=True)


@pytest.mark.parametrize("name", ["-wal", "-journal"])
@pytest.mark.parametrize("content", [b"", bytes(512)])
def test_logs_that_were_done_with(tmp_path, name, content):
    path = WHOLE["sqlite3"](tmp_path)
    complete, _ = read(path)
    if name == "-journal" or not content:
        path.with_name(path.name + name).write_bytes(content)
    assert read(path, strict=True) == (complete, ())


def test_metadata_of_a_directory_may_know_less(recorder, tmp_path):
    path, more = recorder
    more("WAL")
    killed(path, tmp_path).rename(tmp_path / "killed" / "written.db3")
    folder = tmp_path / "killed"
    (folder / "run.db3-wal").rename(folder / "written.db3-wal")
    shutil.copy(tmp_path / "written" / "metadata.yaml", folder / "metadata.yaml")
    assert len(read(folder)[0]) == len(LONG)
    assert sum(topic.count for topic in inspect_recording(folder).topics) == len(LONG)


@pytest.mark.parametrize("mode", ["WAL", "DELETE"])
def test_a_recorder_that_goes_on_is_read_up_to_the_opening(recorder, tmp_path, mode):
    path, more = recorder
    more(mode, upto=60)
    before, _ = read(path)
    recording = open_recording(path)
    stream = recording.records()
    next(stream)
    other = sqlite3.connect(path, isolation_level=None)
    other.execute(
        "INSERT INTO messages SELECT id + 1000, topic_id, timestamp + 1, data FROM messages WHERE id < 50"
    )
    if mode == "WAL":
        other.execute("PRAGMA wal_checkpoint(RESTART)")
    other.close()
    rest = [(type(r).__name__, round(r.record_stamp, 3)) for r in stream]
    assert rest == before[1:]
    assert len(read(path)[0]) == len(before) + 49


def test_no_room_is_left_for_temporary_files(recorder, tmp_path, monkeypatch):
    path, more = recorder
    more("WAL")
    monkeypatch.setattr(sqlitelogs, "LARGEST_IN_MEMORY", 1)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "nowhere"))
    with pytest.raises(RecordingError, match=r"cannot read .*: no such file or directory"):
        read(path)


def naive_checksum(words, first, second):
    pairs = [int(word) for word in words]
    while pairs:
        first = (first + pairs.pop(0) + second) % 2**32
        second = (second + pairs.pop(0) + first) % 2**32
    return first, second


@given(
    arrays(np.uint32, st.integers(0, 8).map(lambda k: 2 * k), elements=st.integers(0, 2**32 - 1)),
    st.integers(0, 2**32 - 1),
    st.integers(0, 2**32 - 1),
)
def test_the_checksum_is_that_of_the_format(words, first, second):
    assert tuple(map(int, wal_checksum(words, first, second))) == naive_checksum(words, first, second)


def test_the_drive_is_read_as_a_bag_beside_others(tmp_path):
    """What a recorder leaves of one piece concerns no other."""
    folder = write_ros2(tmp_path / "run", DRIVE)
    (folder / "metadata.yaml").unlink()
    (file,) = folder.iterdir()
    os.link(file, folder / "run_2.db3")
    (folder / f"{file.name}-wal").write_bytes(b"nothing of use")
    recording = open_recording(folder, SourceOptions())
    assert len(list(recording.records())) == 2 * len(DRIVE)
    assert [part.reason for part in recording.damage] == [sqlitelogs.NO_LOG]
