"""A recording whose disk goes away while it is read: what was done is kept, and goes on when it is back."""

import bz2
import errno
import gzip
import os
import sqlite3

import pytest
from session_worlds import SHORT, assert_same_results

from glassslam.cli import main
from glassslam.errors import RecordingError, UnreachableRecordingError
from glassslam.sources import rosbag1, sqlitestorage
from glassslam.sources.failures import reading

LOST = [errno.EIO, errno.ENODEV, errno.ENXIO, errno.ESTALE, errno.ETIMEDOUT, errno.ENOENT, errno.ENOTCONN]


def fail_while_mapping(monkeypatch, error):
    """Let reading fail in the middle of a run, when all has been read once to see what is there."""
    from glassslam.slam.mapper import Mapper

    scans, place, message_at = [], Mapper._place, rosbag1._message_at

    def counted(self, timed):
        scans.append(timed)
        return place(self, timed)

    def failing(*arguments):
        if len(scans) > 10:
            raise error
        return message_at(*arguments)

    monkeypatch.setattr(Mapper, "_place", counted)
    monkeypatch.setattr(rosbag1, "_message_at", failing)


@pytest.mark.parametrize("number", [errno.EIO, errno.ESTALE, errno.EACCES])
def test_a_run_whose_disk_goes_away_is_kept(small_bag, small_whole, tmp_path, monkeypatch, capsys, number):
    target = tmp_path / "run"
    fail_while_mapping(monkeypatch, OSError(number, os.strerror(number)))
    go_on = f"(what was done is kept; when it is there again, go on: glassslam map --resume {target})\n"
    line = f"error: cannot read {small_bag}: {os.strerror(number).lower()} {go_on}"
    assert main(["map", str(small_bag), "-o", str(target), *SHORT]) == 1
    assert capsys.readouterr().err == line
    assert main(["map", "--resume", str(target), "-q"]) == 1  # it is still not there
    assert capsys.readouterr().err == line
    monkeypatch.undo()
    assert not target.exists()
    assert main(["map", "--resume", str(target), "-q"]) == 0
    assert_same_results(target, small_whole)


def test_a_run_whose_recording_is_damaged_would_fail_again(small_bag, tmp_path, monkeypatch, capsys):
    fail_while_mapping(monkeypatch, ValueError("no such thing"))
    assert main(["map", str(small_bag), "-o", str(tmp_path / "run"), *SHORT]) == 1
    assert "cannot read" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("number", LOST)
def test_a_disk_that_fails_is_told_from_damage(tmp_path, number):
    with pytest.raises(UnreachableRecordingError) as caught, reading(tmp_path / "a.bag", "rosbag1"):
        raise OSError(number, os.strerror(number))
    assert caught.value.message == f"cannot read {tmp_path / 'a.bag'}: {os.strerror(number).lower()}"
    assert caught.value.hint == "its disk or the connection to it fails"


@pytest.mark.parametrize(
    "error",
    [
        gzip.BadGzipFile("Not a gzipped file"),
        OSError(errno.EINVAL, "Invalid argument"),  # a place before the beginning of the file
        EOFError("the end"),
        ValueError("no number"),
    ],
)
def test_damage_is_damage_even_where_it_is_an_error_of_the_system(tmp_path, error):
    with pytest.raises(RecordingError) as caught, reading(tmp_path / "a.bag", "rosbag1"):
        raise error
    assert type(caught.value) is RecordingError


def test_packed_data_that_is_damaged_is_no_failing_disk(tmp_path):
    with pytest.raises(RecordingError) as caught, reading(tmp_path / "a.bag"):
        bz2.BZ2Decompressor().decompress(b"no bz2 at all")
    assert type(caught.value) is RecordingError


@pytest.mark.parametrize("is_lost", [True, False])
def test_a_database_tells_both_with_the_same_words(tmp_path, monkeypatch, is_lost):
    """Which of them it is shows when its pages are read without it."""
    path = tmp_path / "a.db3"
    error = OSError(errno.EIO, "Input/output error") if is_lost else ValueError("no page")

    def fail(*_):
        raise error

    def refuse(*_):
        raise sqlite3.OperationalError("disk I/O error")

    monkeypatch.setattr(sqlitestorage, "overlay_of", refuse)
    monkeypatch.setattr(sqlitestorage, "scan_sqlite", fail)
    with pytest.raises(RecordingError, match=r"i.*/o.* error|disk I/O error") as caught:
        sqlitestorage.SqliteStorage(path).open()
    assert isinstance(caught.value, UnreachableRecordingError) == is_lost
