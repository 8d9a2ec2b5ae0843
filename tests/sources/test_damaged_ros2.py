"""Damaged ROS2 bags: mcap files, databases, and directories with wrong or hostile metadata."""

import re
import sqlite3
import struct
from zlib import crc32

import pytest
from damaged_bags import DRIVE, WHOLE, count_while_growing, read
from rosbags.rosbag2.storage_mcap import McapReader
from rosbags.rosbag2.storage_sqlite3 import Sqlite3Reader
from tiny_bags import T0, lone_file, odom, scan, write_ros2

from glassslam.errors import RecordingError
from glassslam.sources import SourceOptions, open_recording
from glassslam.sources.inspection import inspect_recording
from glassslam.sources.mcaprecords import CHUNK, FOOTER, MESSAGE, chunk_head, read_record
from glassslam.sources.mcapscan import scan_mcap
from glassslam.sources.mcapstorage import McapStorage
from glassslam.sources.sqlitepages import PageFile
from glassslam.sources.sqlitescan import message_of, scan_sqlite
from glassslam.sources.unpacking import LARGEST_CHUNK
from glassslam.sources.windows import BytesWindow

# Several chunks of 1 MB, and rows on many pages.
LONG = [m for k in range(300) for m in (odom(k / 10, 0.1 * k), scan(k / 10, [1.0 + k] * 4000))]


@pytest.fixture(scope="module")
def long_mcap(tmp_path_factory):
    return lone_file(write_ros2(tmp_path_factory.mktemp("long") / "run", LONG, "mcap")).read_bytes()


@pytest.fixture(scope="module")
def long_db3(tmp_path_factory):
    return lone_file(write_ros2(tmp_path_factory.mktemp("long") / "run", LONG)).read_bytes()


def mcap_records(content):
    window, position = BytesWindow(content), 8
    while position < len(content) - 8:
        record = read_record(window, position)
        yield record
        position = record.end


def mcap_chunks(content):
    return [record for record in mcap_records(content) if record.op == CHUNK]


def with_checksums(content):
    """The same file with the checksums that recorders of ROS write."""
    content = bytearray(content)
    for record in mcap_chunks(bytes(content)):
        head = chunk_head(BytesWindow(bytes(content)), record)
        at = record.content + 24
        content[at : at + 4] = struct.pack("<I", crc32(content[head.data : head.data + head.size]))
    return content


def stream(storage):
    storage.open()
    try:
        return [(c.topic, c.msgtype, time, raw) for c, time, raw in storage.messages(storage.connections)]
    finally:
        storage.close()


def test_an_mcap_is_read_as_its_library_reads_it(tmp_path, long_mcap):
    path = tmp_path / "run.mcap"
    path.write_bytes(long_mcap)
    storage = McapStorage(path)
    assert stream(storage) == stream(McapReader(path))
    assert storage.damage == ()


def test_a_scan_of_an_mcap_finds_what_its_index_says(tmp_path, long_mcap):
    path = tmp_path / "run.mcap"
    path.write_bytes(long_mcap)
    index = scan_mcap(path)
    assert index.damage == []
    reader = McapReader(path)
    reader.open()
    wanted = [(c.id, c.topic, c.msgtype, c.msgdef, c.msgcount) for c in reader.connections]
    span = reader.metadata.start_time, reader.metadata.end_time - 1
    reader.close()
    assert [(c.id, c.topic, c.msgtype, c.msgdef, c.msgcount) for c in index.connections] == wanted
    assert (index.start, index.end) == span


@pytest.mark.parametrize("share", [0.15, 0.4, 0.8])
def test_a_cut_mcap_is_read_up_to_the_cut(tmp_path, long_mcap, share):
    path = tmp_path / "run.mcap"
    path.write_bytes(long_mcap)
    complete, _ = read(path)
    cut = int(share * len(long_mcap))
    path.write_bytes(long_mcap[:cut])
    records, (damage,) = read(path)
    assert records == complete[: len(records)]
    assert len(records) >= share * len(complete) - 3
    assert damage.reason == "the file is cut off here"
    assert damage.offset + damage.bytes == cut
    assert damage.bytes < 20_000
    assert damage.last_stamp > damage.first_stamp == pytest.approx(records[-1][1], abs=0.11)


def test_an_mcap_that_grows_is_read_to_its_size_at_opening(tmp_path, long_mcap):
    path = tmp_path / "run.mcap"
    end = mcap_chunks(long_mcap)[3].end
    path.write_bytes(long_mcap[:end])
    before, _ = read(path)
    assert count_while_growing(path, long_mcap[end:]) == len(before)
    assert len(before) < len(LONG) == len(read(path)[0])


def test_an_mcap_without_index_is_not_damaged(tmp_path, long_mcap):
    """Written without a summary: complete, if slower to open."""
    path = tmp_path / "run.mcap"
    path.write_bytes(long_mcap)
    complete, _ = read(path)
    end = next(record.start for record in mcap_records(long_mcap) if record.op == 15)
    footer = struct.pack("<BQQQI", FOOTER, 20, 0, 0, 0)
    path.write_bytes(long_mcap[:end] + struct.pack("<BQI", 15, 4, 0) + footer + long_mcap[-8:])
    assert read(path, strict=True) == (complete, ())


def test_a_chunk_with_a_wrong_checksum_is_skipped_and_named(tmp_path, long_mcap):
    content = with_checksums(long_mcap)
    chunk = mcap_chunks(long_mcap)[2]
    content[chunk.content + 50_000] ^= 1
    path = tmp_path / "run.mcap"
    path.write_bytes(content)
    records, (damage,) = read(path)
    assert damage.reason == "the checksum of a chunk does not fit"
    assert (damage.offset, damage.bytes) == (chunk.start, chunk.end - chunk.start)
    assert len(records) + damage.messages_lost == len(LONG)
    start_time, end_time = struct.unpack_from("<QQ", content, chunk.content)
    assert (damage.first_stamp, damage.last_stamp) == (start_time / 1e9, end_time / 1e9)
    # The same without the index, which only a scan replaces.
    path.write_bytes(content[:-200])
    again, scanned = read(path)
    assert again == records
    assert scanned[0].messages_lost == damage.messages_lost
    path.write_bytes(content)
    with pytest.raises(RecordingError, match="the checksum of a chunk does not fit"):
        read(path, strict=True)


def test_a_broken_length_costs_little_in_an_mcap(tmp_path, long_mcap):
    content = bytearray(long_mcap)
    chunk = mcap_chunks(long_mcap)[1]
    head = chunk_head(BytesWindow(long_mcap), chunk)
    inside = BytesWindow(long_mcap[head.data : head.data + head.size])
    position = 0
    for _ in range(9):
        record = read_record(inside, position)
        position = record.end
    assert record.op == MESSAGE
    content[head.data + record.start + 5] = 0xFF
    path = tmp_path / "run.mcap"
    path.write_bytes(content)
    records, (damage,) = read(path)
    assert len(records) == len(LONG) - 1
    assert (damage.messages_lost, damage.reason) == (1, "a record reaches beyond its chunk")


def test_a_chunk_of_an_mcap_that_claims_gigabytes_is_refused(tmp_path):
    path = WHOLE["mcap zstd"](tmp_path)
    content = bytearray(path.read_bytes())
    (chunk,) = mcap_chunks(bytes(content))
    content[chunk.content + 16 : chunk.content + 24] = struct.pack("<Q", LARGEST_CHUNK * 50)
    path.write_bytes(content)
    with pytest.raises(RecordingError, match="no usable scan") as caught:
        read(path)
    assert caught.value.hint == "the chosen part of the recording holds none"
    (damage,) = inspect_recording(path).damage
    assert damage.reason == "a chunk claims to hold 6711 MB, more than the 134 MB allowed"
    assert damage.messages_lost == len(DRIVE)


def test_an_mcap_of_another_profile_is_refused(tmp_path):
    path = WHOLE["mcap"](tmp_path)
    path.write_bytes(path.read_bytes().replace(b"\x04\x00\x00\x00ros2", b"\x04\x00\x00\x00ros1", 1))
    with pytest.raises(RecordingError, match="Profile is not ros2"):
        read(path)


def test_the_pages_of_a_database_hold_what_its_library_reads(tmp_path, long_db3):
    path = tmp_path / "run.db3"
    path.write_bytes(long_db3)
    index = scan_sqlite(path)
    with path.open("rb") as file:
        pages = PageFile(path, file)
        names = {connection.id: connection.topic for connection in index.connections}
        found = [(names[int(row[2])], int(row[0]), message_of(pages, row)) for row in index.rows]
    reader = Sqlite3Reader(path)
    assert found == [(topic, time, raw) for topic, _, time, raw in stream(reader)]
    reader.open()
    wanted = [(c.id, c.topic, c.msgtype, c.msgdef, c.msgcount) for c in reader.connections]
    reader.close()
    assert sorted((c.id, c.topic, c.msgtype, c.msgdef, c.msgcount) for c in index.connections) == sorted(
        wanted
    )


@pytest.mark.parametrize("share", [0.1, 0.5, 0.93])
def test_a_cut_database_is_read_up_to_the_cut(tmp_path, long_db3, share):
    path = tmp_path / "run.db3"
    path.write_bytes(long_db3)
    complete, _ = read(path)
    path.write_bytes(long_db3[: int(share * len(long_db3))])
    records, damage = read(path)
    assert records == complete[: len(records)]
    assert len(records) >= share * len(complete) - 6
    lost = sum(part.messages_lost for part in damage)
    assert lost == pytest.approx(len(complete) - len(records), rel=0.1, abs=5)


def test_damage_found_on_the_way_costs_rows_and_repeats_none(tmp_path, long_db3):
    """The pages of the index are fine, so that opening succeeds: a page of rows breaks halfway."""
    path = tmp_path / "run.db3"
    path.write_bytes(long_db3)
    complete, _ = read(path)
    index = scan_sqlite(path)
    content = bytearray(long_db3)
    row = index.rows[len(index.rows) // 2]
    at = int(row[3] - 1) * 4096
    content[at : at + 100] = bytes(100)
    path.write_bytes(content)
    records, damage = read(path)
    assert len(set(records)) == len(records)
    assert [record for record in complete if record in records] == records
    missing = len(complete) - len(records)
    assert 0 < missing <= 8
    assert sum(part.messages_lost for part in damage) == missing
    assert damage[0].reason == "rows of the database are missing"
    with pytest.raises(RecordingError):
        read(path, strict=True)


def test_a_database_of_something_else(tmp_path):
    path = tmp_path / "run.db3"
    with sqlite3.connect(path) as database:
        database.execute("CREATE TABLE cats (name TEXT)")
    database.close()
    with pytest.raises(RecordingError, match=r"cannot read .*database missing tables"):
        read(path)


BOMB = "a: &a [1,1]\nb: &b [*a,*a]\nc: {<<: [*b, *b]}\n"
METADATA = {
    "empty": "",
    "no mapping": "[1, 2]",
    "no YAML": "a: [unclosed",
    "a tag": "rosbag2_bagfile_information: !!python/object/apply:os.system [echo]",
    "merged": BOMB,
    "deep": "[" * 20_000,
    "deep as a block": "- " * 20_000,
    "huge": "# " + "x" * (5 << 20),
}


@pytest.mark.parametrize("what", METADATA)
@pytest.mark.parametrize("storage", ["sqlite3", "mcap"])
def test_metadata_that_are_of_no_use(tmp_path, what, storage):
    folder = write_ros2(tmp_path / "run", DRIVE, storage)
    complete, nothing = read(folder)
    assert nothing == ()
    (folder / "metadata.yaml").write_text(METADATA[what])
    records, (damage,) = read(folder)
    assert records == complete
    assert (damage.file, damage.messages_lost) == (str(folder / "metadata.yaml"), 0)
    assert "\n" not in damage.text
    with pytest.raises(RecordingError) as caught:
        read(folder, strict=True)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("number", [".inf", "-3", "1e3", "'12'", "null", "[4]", "yes", "7", "9" * 400])
@pytest.mark.parametrize("storage", ["sqlite3", "mcap"])
@pytest.mark.parametrize("key", ["message_count", "nanoseconds", "nanoseconds_since_epoch"])
def test_false_numbers_in_metadata(tmp_path, key, number, storage):
    folder = write_ros2(tmp_path / "run", DRIVE, storage)
    complete, _ = read(folder)
    text = (folder / "metadata.yaml").read_text()
    (folder / "metadata.yaml").write_text(re.sub(rf"\b{key}: \d+", f"{key}: {number}", text))
    records, damage = read(folder)
    assert records == complete
    assert all(part.messages_lost == 0 for part in damage)
    assert damage or key != "message_count"


@pytest.mark.parametrize("storage", ["sqlite3", "mcap"])
def test_messages_that_only_the_metadata_know(tmp_path, storage):
    folder = write_ros2(tmp_path / "run", DRIVE, storage)
    complete, _ = read(folder)
    text = (folder / "metadata.yaml").read_text()
    (count,) = map(int, re.findall(r"(?m)^  message_count: (\d+)", text))
    more = text.replace(f"\n  message_count: {count}", f"\n  message_count: {count + 31}")
    (folder / "metadata.yaml").write_text(more)
    records, (damage,) = read(folder)
    assert records == complete
    assert (damage.messages_lost, damage.reason) == (
        31,
        f"it counts other messages than the {count} of its files",
    )
    with pytest.raises(RecordingError):
        read(folder, strict=True)


@pytest.mark.parametrize("name", ["../outside.db3", "/etc/passwd", "../../../../etc/passwd"])
def test_metadata_never_lead_out_of_their_directory(tmp_path, name):
    folder = write_ros2(tmp_path / "run", DRIVE)
    lone_file(write_ros2(tmp_path / "other", DRIVE[:10])).rename(tmp_path / "outside.db3")
    text = (folder / "metadata.yaml").read_text()
    (folder / "metadata.yaml").write_text(text.replace("run.db3", name))
    records, (damage,) = read(folder)
    assert len(records) == len(DRIVE)
    assert "files are missing" in damage.reason


def test_without_metadata_the_files_of_a_directory_are_pieces(tmp_path):
    folder = write_ros2(tmp_path / "run", DRIVE)
    complete, _ = read(folder)
    (folder / "metadata.yaml").unlink()
    assert read(folder) == (complete, ())


@pytest.mark.parametrize("storage", ["sqlite3", "mcap"])
def test_a_cut_file_in_a_directory(tmp_path, storage):
    folder = write_ros2(tmp_path / "run", LONG, storage)
    complete, _ = read(folder)
    (file,) = (path for path in folder.iterdir() if path.suffix != ".yaml")
    content = file.read_bytes()
    file.write_bytes(content[: len(content) // 2])
    records, damage = read(folder)
    assert records == complete[: len(records)]
    assert len(complete) * 0.45 < len(records) < len(complete)
    assert damage[0].file == str(file)
    recording = open_recording(folder)
    assert recording.info.duration == pytest.approx(records[-1][1] - T0, abs=0.2)


def test_packed_messages_are_read_within_bounds(tmp_path):
    folder = write_ros2(tmp_path / "run", DRIVE, packing="message")
    records, damage = read(folder)
    assert len(records) == len(DRIVE)
    assert damage == ()


def test_options_and_report_know_damage(tmp_path):
    path = WHOLE["mcap"](tmp_path)
    path.write_bytes(path.read_bytes()[:30_000])
    report = inspect_recording(path, SourceOptions())
    assert report.to_dict()["damage"][0]["file"] == str(path)
