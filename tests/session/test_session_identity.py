"""A recording is known again by what it holds, wherever it is."""

import os
import shutil
import sqlite3

import pytest

from glassslam.errors import SessionError
from glassslam.session import Session
from glassslam.session.identity import checked, digest, identify
from glassslam.sources import SourceOptions

MEGABYTE = 1 << 20


@pytest.fixture
def recording(tmp_path):
    path = tmp_path / "run.bag"
    path.write_bytes(bytes(range(256)) * 40)
    return path


def changed_at(path, place):
    """The same file with one bit turned."""
    content = bytearray(path.read_bytes())
    content[place] ^= 1
    path.write_bytes(content)


def test_a_recording_that_was_moved_and_renamed_is_the_same(recording, tmp_path):
    before = digest(recording)
    (tmp_path / "deep").mkdir()
    moved = recording.rename(tmp_path / "deep" / "other name.bag")
    assert digest(moved) == before


@pytest.mark.parametrize("place", [0, 5000, -1])
def test_one_byte_that_changed_makes_it_another(recording, place):
    before = digest(recording)
    changed_at(recording, place)
    assert digest(recording) != before


@pytest.mark.parametrize("cut", [0, 1, 10239])
def test_a_recording_that_grew_or_was_cut_is_another(recording, cut):
    before = digest(recording)
    recording.write_bytes(recording.read_bytes()[:cut])
    shorter = digest(recording)
    recording.write_bytes(recording.read_bytes() + b"\0")
    assert len({before, shorter, digest(recording)}) == 3


def test_the_time_of_a_file_does_not_matter(recording):
    before = digest(recording)
    os.utime(recording, (1, 1))
    assert digest(recording) == before


def test_of_a_long_file_size_ends_and_blocks_between_count(tmp_path):
    long = tmp_path / "long.bag"
    with long.open("wb") as file:
        file.truncate(100 * MEGABYTE)
    seen = {digest(long)}
    for place in (0, 100 * MEGABYTE - 1, (100 * MEGABYTE - (1 << 18)) * 31 // 63):
        with long.open("r+b") as file:
            file.seek(place)
            file.write(b"\1")
        seen.add(digest(long))
    with long.open("ab") as file:
        file.write(b"\0")
    seen.add(digest(long))
    assert len(seen) == 5


def test_up_to_16_megabytes_every_byte_counts(tmp_path):
    path = tmp_path / "run.bag"
    path.write_bytes(bytes(16 * MEGABYTE))
    seen = {digest(path)}
    for place in range(1, 16 * MEGABYTE, 3_000_017):
        changed_at(path, place)
        seen.add(digest(path))
    assert len(seen) == 7


@pytest.fixture
def folder(tmp_path):
    """A recording that is a directory of files, as ROS 2 writes them."""
    folder = tmp_path / "run"
    folder.mkdir()
    (folder / "metadata.yaml").write_text("version: 5")
    (folder / "run_0.db3").write_bytes(bytes(1000))
    return folder


def test_a_directory_that_was_moved_and_renamed_is_the_same(folder, tmp_path):
    before = digest(folder)
    assert digest(folder.rename(tmp_path / "other")) == before


def test_what_a_reader_leaves_in_a_directory_is_no_part_of_it(folder):
    before = digest(folder)
    (folder / "run_0.db3-shm").write_bytes(bytes(32768))
    assert digest(folder) == before


@pytest.mark.parametrize("change", ["byte", "name", "more", "less"])
def test_files_of_a_directory_count_with_their_names(folder, change):
    before, log = digest(folder), folder / "run_0.db3"
    match change:
        case "byte":
            changed_at(log, 500)
        case "name":
            log.rename(folder / "run_1.db3")
        case "more":
            (folder / "run_1.db3").write_bytes(b"")
        case "less":
            log.unlink()
    assert digest(folder) != before


def test_bytes_cannot_move_from_one_file_to_the_next_unseen(tmp_path):
    for name, parts in (("a", (b"xy", b"z")), ("b", (b"x", b"yz"))):
        (tmp_path / name).mkdir()
        for k, part in enumerate(parts):
            (tmp_path / name / str(k)).write_bytes(part)
    assert digest(tmp_path / "a") != digest(tmp_path / "b")


def test_a_recording_is_found_as_named_or_where_it_was(recording, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    known = identify("run.bag")
    assert (known.given, known.path) == ("run.bag", str(recording))
    assert known.found() == "run.bag"
    (tmp_path / "deep").mkdir()
    monkeypatch.chdir(tmp_path / "deep")
    assert known.found() == str(recording)


def test_a_recording_that_is_missing_is_an_error(tmp_path):
    with pytest.raises(FileNotFoundError):
        digest(tmp_path / "none.bag")


def test_names_that_are_no_text_are_read(tmp_path):
    folder = tmp_path / "run"
    folder.mkdir()
    with open(os.fsencode(folder) + b"/\xff.db3", "wb"):  # noqa: PTH123
        pass
    assert len(digest(folder)) == 40


@pytest.fixture
def database(tmp_path):
    """A database whose second half is only in its log, as a killed recorder leaves it."""
    live = tmp_path / "live.db3"
    writer = sqlite3.connect(live, isolation_level=None)
    writer.execute("PRAGMA journal_mode = WAL")
    writer.execute("CREATE TABLE messages (data BLOB)")
    writer.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchall()
    writer.execute("INSERT INTO messages VALUES (x'0102')")
    path = tmp_path / "run.db3"
    for ending in ("", "-wal"):
        shutil.copyfile(f"{live}{ending}", f"{path}{ending}")
    writer.close()
    return path


@pytest.mark.parametrize("ending", ["-wal", "-journal"])
def test_the_log_beside_a_database_is_part_of_it(database, ending):
    log = database.with_name(f"{database.name}{ending}")
    log.write_bytes(b"pages")
    seen = {digest(database)}
    log.write_bytes(b"Pages")
    seen.add(digest(database))
    log.unlink()
    seen.add(digest(database))
    assert len(seen) == 3


def test_an_empty_log_is_none(database):
    log = database.with_name(f"{database.name}-wal")
    log.unlink()
    before = digest(database)
    log.write_bytes(b"")
    assert digest(database) == before


def test_a_database_moved_with_its_log_is_the_same(database, tmp_path):
    before = digest(database)
    (tmp_path / "deep").mkdir()
    for ending in ("", "-wal"):
        shutil.move(f"{database}{ending}", tmp_path / "deep" / f"other.db3{ending}")
    assert digest(tmp_path / "deep" / "other.db3") == before


def test_what_lies_beside_a_recording_of_another_kind_is_no_part_of_it(recording):
    before = digest(recording)
    recording.with_name("run.bag-wal").write_bytes(b"notes")
    assert digest(recording) == before


MERGED = (
    "a program that opens a database merges the log beside it (-wal): bring back both files as they were, "
    "or map it anew, with --overwrite"
)


@pytest.mark.parametrize("how", ["log removed", "log merged"])
def test_a_database_without_the_log_it_had_is_refused(database, how):
    known = identify(database)
    assert checked([known], None, None) == [str(database)]
    if how == "log removed":
        database.with_name("run.db3-wal").unlink()
    else:
        reader = sqlite3.connect(database)
        assert reader.execute("SELECT count(*) FROM messages").fetchone() == (1,)
        reader.close()
        assert not database.with_name("run.db3-wal").exists()
    with pytest.raises(SessionError) as raised:
        checked([known], None, None)
    assert raised.value.message == f"{database} is not the recording the run has read"
    assert raised.value.hint == MERGED


@pytest.fixture
def ring(tmp_path):
    path = tmp_path / "ring.yaml"
    path.write_text("angle_deg: 15\n")
    return path


@pytest.mark.parametrize("how", ["changed", "gone"])
def test_a_ring_of_sonars_that_is_not_what_it_was_is_refused(recording, ring, tmp_path, how):
    with Session.create(tmp_path / "a.db", [recording], None, SourceOptions(sonar_ring=ring)) as session:
        assert session.check_recordings() == [str(recording)]
    with Session.open(tmp_path / "a.db") as session:
        assert session.options.sonar_ring == str(ring)
        assert session.check_recordings() == [str(recording)]
        if how == "gone":
            ring.unlink()
        else:
            ring.write_text("angle_deg: 25\n")
        with pytest.raises(SessionError) as raised:
            session.check_recordings()
    assert raised.value.message == (
        f"cannot read {ring}: No such file or directory"
        if how == "gone"
        else f"{ring} is not the ring of sonars that the run has read"
    )
    assert raised.value.hint == "bring it back as it was, or map it anew, with --overwrite"


def test_a_ring_of_sonars_that_is_shipped_is_known_by_its_name(recording, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "pioneer-3dx").write_text("a file of this name is not what is meant")
    options = SourceOptions(sonar_ring="pioneer-3dx")
    with Session.create(tmp_path / "a.db", [recording], None, options):
        pass
    with Session.open(tmp_path / "a.db") as session:
        assert session.options.sonar_ring == "pioneer-3dx"
        assert session.check_recordings() == [str(recording)]
