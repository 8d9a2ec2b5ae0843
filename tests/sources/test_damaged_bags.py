"""Damaged bags: what is readable is read, what is not is told."""

import bz2
import re
import struct

import pytest
from damaged_bags import DRIVE, WHOLE, chunk_record, count_while_growing, read, ros1_record
from tiny_bags import T0, odom, write_ros1

from glassslam.errors import GlassSlamError, NoScansError, RecordingError
from glassslam.sources import SourceOptions, open_recording
from glassslam.sources.gaps import MOST_PARTS
from glassslam.sources.inspection import inspect_recording
from glassslam.sources.rosbag1index import read_index
from glassslam.sources.rosbag1records import CHUNK, read_record
from glassslam.sources.rosbag1scan import scan_bag
from glassslam.sources.windows import BytesWindow

ROS1 = [kind for kind in WHOLE if kind.startswith("ROS1")]
ALL_STAMPS = [round(T0 + message.at, 3) for message in DRIVE]


def boundaries(content):
    """Positions of all records of a ROS1 bag, at the top level."""
    window, position = BytesWindow(content), 13
    while position < len(content):
        yield position
        position = read_record(window, position).end


def chunks(content):
    window = BytesWindow(bytes(content))
    records = [read_record(window, position) for position in boundaries(bytes(content))]
    return [record for record in records if record.op == CHUNK]


@pytest.mark.parametrize("kind", WHOLE)
def test_whole_bags_have_no_damage(tmp_path, kind):
    records, damage = read(WHOLE[kind](tmp_path))
    assert [stamp for _, stamp in records] == ALL_STAMPS
    assert damage == ()


@pytest.mark.parametrize("kind", ROS1)
def test_a_scan_finds_what_the_index_says(tmp_path, kind):
    path = WHOLE[kind](tmp_path)
    index, found = read_index(path), scan_bag(path)
    assert (found.start, found.end) == (index.start, index.end)
    assert found.chunks == index.chunks
    for wanted, connection in zip(index.connections, found.connections, strict=True):
        assert connection[:7] == wanted[:7]
        times = [
            [(time, chunk) for time, chunk, _ in sorted(rows[wanted.id])] for rows in (index.rows, found.rows)
        ]
        assert times[0] == times[1]


@pytest.mark.parametrize("kind", ROS1)
def test_cut_at_every_record(tmp_path, kind):
    whole = WHOLE[kind](tmp_path).read_bytes()
    complete, _ = read(tmp_path / "whole.bag")
    path = tmp_path / "cut.bag"
    ends = [record.end for record in chunks(whole)]
    per_chunk = len(DRIVE) / len(ends)
    for position in [*boundaries(whole)][1:]:
        path.write_bytes(whole[:position])
        try:
            records, damage = read(path)
        except RecordingError:
            # the first chunk holds odometry only
            assert sum(end <= position for end in ends) <= 1
            continue
        assert records == complete[: len(records)]
        assert len(records) >= sum(end <= position for end in ends) * per_chunk - len(DRIVE) % len(ends)
        assert damage


@pytest.mark.parametrize("kind", WHOLE)
@pytest.mark.parametrize("share", [0.31, 0.5, 0.77, 0.95, 0.999])
def test_cut_anywhere(tmp_path, kind, share):
    source = WHOLE[kind](tmp_path)
    complete, _ = read(source)
    path = tmp_path / f"cut{source.suffix}"
    whole = source.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    try:
        records, damage = read(path)
    except RecordingError:
        # nothing but definitions before the cut
        assert (kind, share) == ("sqlite3", 0.31)
        return
    assert records == complete[: len(records)]
    assert damage
    assert all(part.file == str(path) for part in damage)
    assert len(records) > 0
    # what is packed well stands in the first third, before a long index
    assert len(records) < len(DRIVE) or share > 0.6 or kind == "mcap zstd"


def test_the_loss_is_estimated_from_where_the_file_should_end(tmp_path):
    path = WHOLE["ROS1"](tmp_path)
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    records, (damage,) = read(path)
    lost = len(DRIVE) - len(records)
    assert damage.messages_lost == pytest.approx(lost, abs=6)
    assert damage.seconds_lost == pytest.approx(lost * 0.05, abs=0.5)
    assert damage.first_stamp == pytest.approx(records[-1][1], abs=1e-3)
    assert damage.offset + damage.bytes == len(whole) // 2
    assert damage.reason.startswith("the file is cut off here, ")
    assert re.fullmatch(
        r".*whole\.bag: \d+ bytes at offset \d+ unreadable"
        r" \(the file is cut off here, \d+ bytes are missing\): "
        r"about \d+ messages and \d\.\d s lost",
        damage.text,
    )


@pytest.mark.parametrize("kind", ROS1)
def test_a_bag_that_was_never_closed(tmp_path, kind):
    path = WHOLE[kind](tmp_path)
    complete, _ = read(path)
    content = bytearray(path.read_bytes())
    at = content.index(b"index_pos=") + len(b"index_pos=")
    last = chunks(content)[-1]
    content[at : at + 8] = bytes(8)
    path.write_bytes(content[: last.end])
    records, (damage,) = read(path)
    assert records == complete
    assert (damage.messages_lost, damage.bytes) == (0, 0)
    assert damage.text.endswith("unreadable (the index is missing or broken): no message lost")


def test_a_bag_that_grows_is_read_to_its_size_at_opening(tmp_path):
    path = WHOLE["ROS1"](tmp_path)
    whole = path.read_bytes()
    end = chunks(whole)[5].end
    path.write_bytes(whole[:end])
    before, _ = read(path)
    assert count_while_growing(path, whole[end:]) == len(before)
    assert len(before) < len(DRIVE)


def test_a_damaged_chunk_is_skipped_and_named(tmp_path):
    path = WHOLE["ROS1 bz2"](tmp_path)
    complete, _ = read(path)
    content = bytearray(path.read_bytes())
    chunk = chunks(content)[4]
    content[chunk.data + 20 : chunk.data + 60] = bytes(40)
    path.write_bytes(content)
    records, (damage,) = read(path)
    missing = [record for record in complete if record not in records]
    assert [record for record in records if record in complete] == records
    assert damage.messages_lost == len(missing) > 0
    assert (damage.offset, damage.bytes) == (chunk.start, chunk.end - chunk.start)
    assert damage.first_stamp == pytest.approx(missing[0][1], abs=1e-3)
    assert damage.last_stamp == pytest.approx(missing[-1][1], abs=1e-3)
    assert damage.reason == "Invalid data stream"
    assert inspect_recording(path).damage == (damage,)


def test_without_its_index_a_damaged_chunk_costs_the_same(tmp_path):
    path = WHOLE["ROS1 bz2"](tmp_path)
    content = bytearray(path.read_bytes())
    chunk = chunks(content)[4]
    content[chunk.data + 20 : chunk.data + 60] = bytes(40)
    path.write_bytes(content)
    indexed, (by_index,) = read(path)
    at = content.index(b"index_pos=") + len(b"index_pos=")
    content[at : at + 8] = bytes(8)
    path.write_bytes(content)
    scanned, damage = read(path)
    assert scanned == indexed
    assert [part.messages_lost for part in damage] == [by_index.messages_lost]


@pytest.mark.parametrize("what", [b"op=\x05", b"compression=", b"size="])
def test_a_broken_chunk_header_costs_one_chunk_at_most(tmp_path, what):
    path = WHOLE["ROS1 lz4"](tmp_path)
    complete, _ = read(path)
    content = bytearray(path.read_bytes())
    chunk = chunks(content)[3]
    at = content.index(what, chunk.start)
    content[at : at + 4] = b"\xff" * 4
    path.write_bytes(content)
    records, damage = read(path)
    assert set(records) <= set(complete)
    assert len(complete) - 6 <= len(records) < len(complete)
    assert any(part.offset == chunk.start for part in damage)


def test_messages_are_found_again_behind_a_broken_one(tmp_path):
    path = WHOLE["ROS1"](tmp_path)
    complete, _ = read(path)
    content = bytearray(path.read_bytes())
    chunk = chunks(content)[3]
    inside = BytesWindow(bytes(content[chunk.data : chunk.end]))
    second = read_record(inside, read_record(inside, 0).end)
    at = chunk.data + second.data - 4
    content[at : at + 4] = b"\xff" * 4
    at = content.index(b"index_pos=") + len(b"index_pos=")
    content[at : at + 8] = bytes(8)
    path.write_bytes(content)
    records, damage = read(path)
    assert len(records) == len(complete) - 1
    assert damage[0].offset == chunk.data + second.start
    assert damage[0].messages_lost <= 2


def ros1_file(*records):
    padding = b" " * 100
    fields = {b"chunk_count": bytes(4), b"conn_count": bytes(4), b"index_pos": bytes(8), b"op": b"\x03"}
    return b"#ROSBAG V2.0\n" + ros1_record(fields, padding) + b"".join(records)


def test_a_chunk_that_claims_gigabytes_is_refused(tmp_path):
    bomb = bz2.compress(bytes(200_000_000))
    whole = WHOLE["ROS1 bz2"](tmp_path).read_bytes()
    first, *_, last = chunks(whole)
    good = whole[first.start : last.end]
    for claimed, reason in (
        (4_000_000_000, "a chunk claims to hold 4000 MB, more than the 134 MB allowed"),
        (1000, "a chunk holds more than the 1000 bytes it claims"),
    ):
        path = tmp_path / "bomb.bag"
        path.write_bytes(ros1_file(good, chunk_record(bomb, claimed, b"bz2"), good))
        records, damage = read(path)
        assert len(records) == 2 * len(DRIVE)
        assert [part.reason for part in damage] == [reason]


def test_unknown_compression_of_one_chunk_and_of_all(tmp_path):
    path = WHOLE["ROS1"](tmp_path)
    content = path.read_bytes()
    first = chunks(content)[0]
    path.write_bytes(content[: first.start] + content[first.start :].replace(b"=none", b"=nine", 1))
    records, damage = read(path)
    assert 0 < len(records) < len(DRIVE)
    assert damage[0].reason == "Compression 'nine' is not supported"
    path.write_bytes(content.replace(b"compression=none", b"compression=nine"))
    with pytest.raises(RecordingError, match=r"cannot read .*: Compression 'nine' is not supported"):
        read(path)


def test_messages_of_an_undescribed_topic_are_counted(tmp_path):
    path = tmp_path / "run.bag"
    whole = WHOLE["ROS1"](tmp_path).read_bytes()
    first, *_, last = chunks(whole)
    stray = ros1_record(
        {b"conn": struct.pack("<I", 99), b"op": b"\x02", b"time": struct.pack("<II", T0, 0)}, b"x"
    )
    path.write_bytes(ros1_file(whole[first.start : last.end], stray, stray))
    records, damage = read(path)
    assert len(records) == len(DRIVE)
    assert {(part.messages_lost, part.reason) for part in damage} == {
        (2, "messages whose topic is not told"),
        (0, "the index is missing or broken"),
    }


@pytest.mark.parametrize("kind", WHOLE)
def test_reading_twice_gives_the_same(tmp_path, kind):
    path = WHOLE[kind](tmp_path)
    whole = bytearray(path.read_bytes())
    for k in range(5):
        whole[len(whole) // 3 + 37 * k] ^= 0xFF
    path.write_bytes(whole[: len(whole) * 4 // 5])
    try:
        recording = open_recording(path)
    except GlassSlamError:
        assert kind == "mcap zstd"
        return
    first = [record.record_stamp for record in recording.records()], recording.damage
    second = [record.record_stamp for record in recording.records()], recording.damage
    assert first == second


@pytest.mark.parametrize("kind", WHOLE)
def test_strict_refuses_what_is_read_otherwise(tmp_path, kind):
    path = WHOLE[kind](tmp_path)
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) * 95 // 100])
    with pytest.raises(RecordingError, match=r"cannot read "):
        read(path, strict=True)


def test_nothing_readable_stays_an_error(tmp_path):
    path = tmp_path / "run.bag"
    path.write_bytes(ros1_file())
    with pytest.raises(RecordingError, match="Bag is not indexed"):
        read(path)
    only_odometry = write_ros1(tmp_path / "odometry.bag", [odom(k / 10) for k in range(50)], chunk_bytes=500)
    only_odometry.write_bytes(only_odometry.read_bytes()[:-3000])
    with pytest.raises(NoScansError, match="no laser scan in"):
        read(only_odometry)


def test_a_file_is_read_only(tmp_path):
    path = WHOLE["ROS1"](tmp_path)
    path.write_bytes(path.read_bytes()[:9000])
    before = sorted(tmp_path.iterdir()), path.read_bytes()
    read(path)
    assert (sorted(tmp_path.iterdir()), path.read_bytes()) == before


def test_inspect_tells_damage(tmp_path):
    path = WHOLE["ROS1"](tmp_path)
    path.write_bytes(path.read_bytes()[:9000])
    report = inspect_recording(path)
    assert [part.reason.split(",")[0] for part in report.damage] == ["the file is cut off here"]
    assert report.scans[0].stamps.count > 0
    with pytest.raises(RecordingError):
        inspect_recording(path, SourceOptions(strict=True))


def test_very_many_damaged_parts_are_told_as_few(tmp_path):
    path = write_ros1(tmp_path / "run.bag", DRIVE, "lz4", chunk_bytes=100)
    content = bytearray(path.read_bytes())
    for chunk in chunks(content)[2::2]:
        content[chunk.data : chunk.data + 4] = b"\xff" * 4
    path.write_bytes(content)
    records, damage = read(path)
    assert len(damage) == MOST_PARTS
    assert len(records) + sum(part.messages_lost for part in damage) == len(DRIVE)
    assert damage[-1].reason == f"{len(DRIVE) - len(records) - MOST_PARTS + 1} more damaged parts"
    assert damage[-1].last_stamp == pytest.approx(T0 + DRIVE[-1].at, abs=0.2)
