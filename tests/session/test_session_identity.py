"""A recording is known again by what it holds, wherever it is."""

import os

import pytest

from glassslam.session.identity import digest, identify

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
