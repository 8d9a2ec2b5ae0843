"""Multi-echo scans: the fast parser agrees with the type store of rosbags, echo by echo."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tiny_bags import ROS1, ROS2, T0, scan, write_ros1, write_ros2

from glassslam.errors import NoScansError
from glassslam.sources import SourceOptions, open_recording
from glassslam.sources.bag import MULTI_ECHO
from glassslam.sources.multiecho import parse_cdr, parse_ros1

BEAMS = [[1.0, 2.0, 3.0], [], [4.0]]
STRENGTHS = [[10.0, 30.0, 20.0], [], [5.0]]

finite = st.floats(0.0, 100.0, width=32)
beams_strategy = st.lists(st.lists(st.tuples(finite, finite), max_size=4), max_size=12)


def naive(message, echo):
    """One echo of each beam, from the decoded objects."""
    ranges, strengths = [], []
    for beam, strength in zip(message.ranges, message.intensities, strict=True):
        if len(beam.echoes) == 0:
            ranges.append(math.inf)
            strengths.append(0.0)
            continue
        last, strongest = len(beam.echoes) - 1, int(np.argmax(strength.echoes))
        k = {"first": 0, "last": last, "strongest": strongest}[echo]
        ranges.append(beam.echoes[k])
        strengths.append(strength.echoes[k])
    return np.float32(ranges), np.float32(strengths)


@given(
    beams=beams_strategy,
    frame=st.text("abc_", max_size=9),
    echo=st.sampled_from(["first", "last", "strongest"]),
    ros1=st.booleans(),
)
def test_agrees_with_the_decoded_message(beams, frame, echo, ros1):
    ranges = [[distance for distance, _ in beam] for beam in beams]
    strengths = [[strength for _, strength in beam] for beam in beams]
    sent = scan(0.25, ranges, intensities=strengths, echoes=True, frame=frame)
    store, write, read = (
        (ROS1, ROS1.serialize_ros1, parse_ros1) if ros1 else (ROS2, ROS2.serialize_cdr, parse_cdr)
    )
    message = sent.build(store)
    parsed = read(bytes(write(message, MULTI_ECHO)), echo)
    expected_ranges, expected_strengths = naive(message, echo)
    np.testing.assert_array_equal(parsed.ranges, expected_ranges)
    np.testing.assert_array_equal(parsed.intensities, expected_strengths)
    assert (parsed.frame_id, parsed.stamp_ns) == (frame, T0 * 10**9 + 250_000_000)
    for name in ("angle_min", "angle_max", "angle_increment", "scan_time", "range_min", "range_max"):
        assert getattr(parsed, name) == np.float32(getattr(message, name))


@given(cut=st.integers(1, 200), ros1=st.booleans())
def test_a_message_cut_off_anywhere_is_refused(cut, ros1):
    message = scan(0.0, BEAMS, intensities=STRENGTHS, echoes=True)
    if ros1:
        raw, read = bytes(ROS1.serialize_ros1(message.build(ROS1), MULTI_ECHO)), parse_ros1
    else:
        raw, read = bytes(ROS2.serialize_cdr(message.build(ROS2), MULTI_ECHO)), parse_cdr
    with pytest.raises(ValueError, match=r"cut off|only little-endian"):
        read(raw[: max(0, len(raw) - cut)], "first")


def test_a_wild_count_is_refused():
    raw = bytearray(ROS1.serialize_ros1(scan(0.0, [[1.0]], echoes=True).build(ROS1), MULTI_ECHO))
    at = len(raw) - 16
    assert raw[at : at + 4] == b"\x01\x00\x00\x00"
    raw[at : at + 4] = b"\xff\xff\xff\xff"
    with pytest.raises(ValueError, match="the echoes are cut off"):
        parse_ros1(bytes(raw), "first")


def test_without_intensities_the_strongest_is_the_first():
    raw = bytes(ROS1.serialize_ros1(scan(0.0, BEAMS, echoes=True).build(ROS1), MULTI_ECHO))
    parsed = parse_ros1(raw, "strongest")
    assert parsed.ranges.tolist() == [1.0, math.inf, 4.0]
    assert parsed.intensities.size == 0


@pytest.mark.parametrize("write", [write_ros1, write_ros2])
@pytest.mark.parametrize(
    ("echo", "ranges", "strengths"),
    [
        ("first", [1.0, math.inf, 4.0], [10.0, 0.0, 5.0]),
        ("last", [3.0, math.inf, 4.0], [20.0, 0.0, 5.0]),
        ("strongest", [2.0, math.inf, 4.0], [30.0, 0.0, 5.0]),
    ],
)
def test_the_echo_is_chosen_by_option(tmp_path, write, echo, ranges, strengths):
    path = write(tmp_path / "run.bag", [scan(0.0, BEAMS, intensities=STRENGTHS, echoes=True)])
    (record,) = open_recording(path, SourceOptions(echo=echo)).records()
    assert record.ranges.tolist() == ranges
    assert record.intensities.tolist() == strengths


def test_the_first_echo_is_the_default(tmp_path):
    path = write_ros1(tmp_path / "run.bag", [scan(0.0, BEAMS, echoes=True)])
    (record,) = open_recording(path).records()
    assert record.ranges[0] == 1.0


def test_only_empty_scans_are_no_recording(tmp_path):
    recording = open_recording(write_ros1(tmp_path / "run.bag", [scan(0.0, [], echoes=True)]))
    with pytest.raises(NoScansError, match="no usable scan of /scan") as caught:
        list(recording.records())
    assert caught.value.hint == "dropped: 1 x scan without beams"
