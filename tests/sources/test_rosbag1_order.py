"""ROS1 bags are read in the order of the file, topics in step, chunks ahead of their use."""

import itertools
import threading

import pytest
from tiny_bags import T0, odom, scan, write_ros1

from glassslam.sources import open_recording
from glassslam.sources.bag import open_bag
from glassslam.sources.formats import resolve


def _times(path):
    return [round(record.record_stamp - T0, 3) for record in open_recording(path).records()]


def test_record_times_that_step_back_do_not_reorder_a_topic(tmp_path):
    steps = [0.0, 0.2, 0.1, 0.4, 0.3]
    assert _times(write_ros1(tmp_path / "run.bag", [scan(at) for at in steps])) == steps


def test_topics_written_one_after_the_other_are_read_in_step(tmp_path):
    scans, poses = [scan(k + 0.5) for k in range(6)], [odom(float(k)) for k in range(6)]
    path = write_ros1(tmp_path / "run.bag", scans + poses, "bz2", chunk_bytes=300)
    assert _times(path) == [k / 2 for k in range(12)]


@pytest.mark.parametrize("compression", ["none", "bz2", "lz4"])
def test_many_chunks(tmp_path, compression):
    messages = [m for k in range(50) for m in (odom(k / 10), scan(k / 10 + 0.05, [float(k), 2, 3]))]
    path = write_ros1(tmp_path / "run.bag", messages, compression, chunk_bytes=400)
    recording = open_recording(path)
    ranges = [record.ranges[0] for record in recording.records() if hasattr(record, "ranges")]
    assert ranges == [float(k) for k in range(50)]


def test_a_reader_that_stops_early_leaves_no_thread_and_no_open_file(tmp_path):
    path = write_ros1(tmp_path / "run.bag", [scan(float(k)) for k in range(50)], "bz2", chunk_bytes=400)
    records = open_recording(path).records()
    assert len(list(itertools.islice(records, 3))) == 3
    records.close()
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("bag-chunks")]


def test_times_select_messages(tmp_path):
    bag = open_bag(resolve([write_ros1(tmp_path / "run.bag", [scan(float(k)) for k in range(5)])])[0])
    (topic,) = bag.topics
    start, stop = (T0 + 1) * 10**9, (T0 + 3) * 10**9
    assert [time for _, time, _ in bag.messages([topic], start, stop)] == [start, start + 10**9]
