"""Real recordings cut at random: nothing that is physically there is lost."""

import random

import pytest

from glassslam.errors import RecordingError
from glassslam.sources.bag import SONAR_TYPES, USED_TYPES, open_bag
from glassslam.sources.formats import resolve
from glassslam.sources.mcapindex import messages_in
from glassslam.sources.mcapscan import scan_mcap
from glassslam.sources.rosbag1index import read_index
from glassslam.sources.rosbag1records import MESSAGE, read_record
from glassslam.sources.sqlitepages import PageFile
from glassslam.sources.sqlitescan import message_of, scan_sqlite
from glassslam.sources.windows import BrokenRecordError, BytesWindow

USED = (*USED_TYPES, *SONAR_TYPES)
CUTS = 8
RECORDINGS = [
    "freiburg/aces.bag",
    "ust10lx/localization_bag1_2022-03-29-19-23-29.bag",
    "museum/b0-2014-07-21-12-42-53-tiny.bag",
    "turtlebot3/rosbag2_2026_02_02-14_33_55_0.mcap",
    "ust10lx/rosbag2_2026_03_07-23_31_14_0.db3",
]


def messages(path):
    (piece,) = resolve([path])
    bag = open_bag(piece)
    topics = [topic for topic in bag.topics if topic.msgtype in USED]
    return [(topic.name, time, raw) for topic, time, raw in bag.messages(topics)]


def ends_ros1(path):
    """Where each message of a whole bag ends; that of its chunk where that is packed."""
    index, content = read_index(path), path.read_bytes()
    used = {c.id for c in index.connections if c.msgtype in USED}
    for _, position, offset in (row for key in used for row in index.rows[key]):
        chunk = index.chunks[position]
        if chunk.compression != "none":
            yield chunk.data + chunk.size
            continue
        record = read_record(BytesWindow(content), chunk.data + offset)
        while record.op != MESSAGE:
            record = read_record(BytesWindow(content), record.end)
        yield record.end


def ends_mcap(path):
    index, window = scan_mcap(path), BytesWindow(path.read_bytes())
    used = {c.id for c in index.connections if c.msgtype in USED}
    for stretch in index.stretches:
        found, _ = messages_in(stretch.content(window).data, set())
        yield from (stretch.data + record.end for _, channel, record in found if channel in used)


def whole_rows(path, cut):
    """Messages of a database that lie on the pages before a cut."""
    index, count = scan_sqlite(path), 0
    used = {c.id for c in index.connections if c.msgtype in USED}
    with path.open("rb") as file:
        pages = PageFile(path, file)
        pages.count = cut // pages.page_size
        for row in index.rows:
            try:
                message_of(pages, row)
            except BrokenRecordError:
                continue
            count += int(row[2]) in used
    return count


@pytest.mark.parametrize("name", RECORDINGS)
def test_all_that_is_there_is_read(data_dir, tmp_path, name):
    path = data_dir / name
    complete, content = messages(path), path.read_bytes()
    ends = list(
        ends_ros1(path) if path.suffix == ".bag" else ends_mcap(path) if path.suffix == ".mcap" else ()
    )
    by_topic = {topic: [m for m in complete if m[0] == topic] for topic in {m[0] for m in complete}}
    cut_file = tmp_path / path.name
    random.seed(7)
    for cut in random.sample(range(1, len(content)), CUTS):
        there = sum(end <= cut for end in ends) if ends else whole_rows(path, cut)
        cut_file.write_bytes(content[:cut])
        try:
            found = messages(cut_file)
        except RecordingError:
            assert there == 0
            continue
        assert len(found) >= there
        for topic, expected in by_topic.items():
            read = [message for message in found if message[0] == topic]
            assert read == expected[: len(read)]
