"""Whatever is named as a recording: one clear line, never a foreign exception."""

import os
from functools import partial

import pytest
from tiny_bags import lone_file, odom, scan, write_ros1, write_ros2

from glassslam.errors import NoScansError, RecordingError, UsageError
from glassslam.sources import SourceOptions, open_recording
from glassslam.sources.inspection import inspect_recording
from glassslam.sources.sonarfile import open_sonar

LOG = "".join(f"FLASER 2 1.0 2.0 0 0 0 {k} 0 0 {k}.5 host {k}.5\n" for k in range(2000)).encode()
DRIVE = [message for k in range(60) for message in (odom(k / 10), scan(k / 10, [1.0] * 50))]

WHOLE = {
    "ROS1": lambda folder: write_ros1(folder / "whole.bag", DRIVE),
    "ROS1 bz2": lambda folder: write_ros1(folder / "whole.bag", DRIVE, "bz2", chunk_bytes=2000),
    "ROS1 lz4": lambda folder: write_ros1(folder / "whole.bag", DRIVE, "lz4", chunk_bytes=2000),
    "sqlite3": lambda folder: lone_file(write_ros2(folder / "whole", DRIVE)),
    "mcap": lambda folder: lone_file(write_ros2(folder / "whole", DRIVE, "mcap")),
}


def drain(path, *, strict=False):
    """Read a recording to its end."""
    return list(open_recording(path, SourceOptions(strict=strict)).records())


def one_line(error):
    assert error.message
    assert "\n" not in error.message + error.hint
    return error.message


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is empty"),
        (b"%PDF-1.4 something else", "is no recording known here"),
        (b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR" + b"\x00" * 500, "is no recording known here"),
        (b"\x00\x01\x02" * 1000, "is no recording known here"),
        (b"FLASER 1 \x00\x00 1.0", "is no recording known here"),
        (b"\x1f\x8b\x08\x00 no gzip at all", "is no recording known here"),
        (b"#ROSBAG V1.2\n", "is a ROS1 bag of an old version"),
        (b"\x28\xb5\x2f\xfd....", "is zstd-compressed"),
        (b"BZh91AY&SY", "is bzip2-compressed as a whole"),
        (b"PK\x03\x04....", "is a zip archive"),
        (b"#ROSBAG V2.0\n", "cannot read .*: Header could not be read from file"),
        (b"#ROSBAG V2.0\n" + b"\xff" * 500, "cannot read "),
        (b"\x89MCAP0\r\n", "cannot read "),
        (b"\x89MCAP0\r\n" + b"\x01" * 200, "cannot read "),
        (b"SQLite format 3\x00" + b"\x00" * 2000, "cannot read "),
    ],
)
def test_foreign_content(tmp_path, content, message):
    path = tmp_path / "run.bag"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=message) as caught:
        drain(path)
    assert str(path) in one_line(caught.value)


def test_missing(tmp_path):
    with pytest.raises(RecordingError, match=r"nowhere\.bag does not exist"):
        open_recording(tmp_path / "nowhere.bag")


def test_no_path_at_all():
    with pytest.raises(RecordingError, match="no recording was named"):
        open_recording([])


def test_a_directory_without_a_bag(tmp_path):
    with pytest.raises(RecordingError, match="is a directory without a ROS2 bag"):
        open_recording(tmp_path)


@pytest.mark.parametrize(
    ("metadata", "message"),
    [
        ("", "cannot read "),
        ("[1, 2]", "cannot read "),
        ("a: [unclosed", "cannot read .*: Could not load YAML"),
        ("rosbag2_bagfile_information: {version: 99}", "cannot read .*: Rosbag2 version 99 not supported"),
        ("rosbag2_bagfile_information: {version: 5}", "cannot read .*: A metadata key is missing"),
    ],
)
def test_damaged_metadata_are_refused_when_strict(tmp_path, metadata, message):
    folder = write_ros2(tmp_path / "run", DRIVE)
    (folder / "metadata.yaml").write_text(metadata)
    with pytest.raises(RecordingError, match=message) as caught:
        drain(folder, strict=True)
    one_line(caught.value)


def test_metadata_without_its_files(tmp_path):
    folder = write_ros2(tmp_path / "run", DRIVE)
    lone_file(folder)
    with pytest.raises(RecordingError, match=r"has a metadata\.yaml but neither \.mcap nor \.db3 files"):
        open_recording(folder)


def test_a_truncated_file_in_a_directory_is_refused_when_strict(tmp_path):
    folder = write_ros2(tmp_path / "run", DRIVE)
    (file,) = folder.glob("*.db3")
    file.write_bytes(file.read_bytes()[:-1000])
    with pytest.raises(RecordingError, match=r"cannot read .*: the last 1000 bytes are missing"):
        open_recording(folder, SourceOptions(strict=True))


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_unreadable(tmp_path):
    path = write_ros1(tmp_path / "run.bag", DRIVE)
    path.chmod(0)
    with pytest.raises(RecordingError, match="permission denied"):
        open_recording(path)


@pytest.mark.parametrize("kind", WHOLE)
@pytest.mark.parametrize("share", [0.01, 0.2, 0.5, 0.9, 0.999])
def test_truncated_bags_are_refused_when_strict(tmp_path, kind, share):
    whole = WHOLE[kind](tmp_path).read_bytes()
    path = tmp_path / "cut.bag"
    path.write_bytes(whole[: int(len(whole) * share)])
    with pytest.raises(RecordingError) as caught:
        drain(path, strict=True)
    assert str(path) in one_line(caught.value)


def test_an_unindexed_bag_says_how_to_repair_it(tmp_path):
    path = write_ros1(tmp_path / "run.bag", DRIVE)
    content = bytearray(path.read_bytes())
    at = content.index(b"index_pos=") + len(b"index_pos=")
    content[at : at + 8] = bytes(8)
    path.write_bytes(content)
    with pytest.raises(RecordingError, match="Bag is not indexed") as caught:
        open_recording(path, SourceOptions(strict=True))
    assert "rosbag reindex" in caught.value.hint


@pytest.mark.parametrize("kind", WHOLE)
@pytest.mark.parametrize("seed", range(12))
def test_flipped_bytes_never_escape_as_foreign_errors(tmp_path, kind, seed):
    """Damage may go unnoticed or cost a few messages; it must not surface as anything but our own error."""
    path = WHOLE[kind](tmp_path)
    content = bytearray(path.read_bytes())
    for k in range(20):
        place = (seed * 7919 + k * 104729 + k * k * 31) % len(content)
        content[place] ^= 1 << (k % 8)
    path.write_bytes(content)
    for read in (drain, partial(drain, strict=True), inspect_recording):
        try:
            read(path)
        except (RecordingError, UsageError) as error:
            one_line(error)


PLAYER = "## Player version 2.1.1\n" + "".join(
    f"{k}.500 1 6665 sonar 00 004 001 2 +0.1 0 +1.5 0 0 0\n"
    f"{k}.600 1 6665 position2d 00 001 001 {k} 0 0 0 0 0 0\n"
    f"{k}.700 1 6665 laser 00 001 001 1 -1.5 +1.5 +1.5 8.0 3 1.0 0 2.0 0 3.0 1\n"
    f"{k}.800 1 6665 sonar 00 001 001 2 1 {k}\n"
    for k in range(60)
)
PIMAP = "".join(f"{k} {k} {k} 63{k + 10**16} 5 5 1.{k} 2.5\n" for k in range(200))


@pytest.mark.parametrize("seed", range(30))
@pytest.mark.parametrize("text", [PLAYER, PIMAP], ids=["Player", "pi-map"])
def test_flipped_bytes_in_text_logs(tmp_path, text, seed):
    path = tmp_path / "run.log"
    content = bytearray(text.encode())
    for k in range(30):
        content[(seed * 7919 + k * 104729 + k * k * 31) % len(content)] ^= 1 << ((k + seed) % 8)
    path.write_bytes(content)
    ring = tmp_path / "ring.yaml"
    ring.write_text(
        "field_of_view_deg: 20\nrange_max: 4\nsonars: [[0, 0, 0], [0, 0, 1], [0, 0, 2], [0, 0, 3]]\n"
    )
    sonar = SourceOptions(sonar_ring=ring if text == PIMAP else None)
    for read in (drain, inspect_recording, lambda file: list(open_sonar(file, sonar).records(str))):
        try:
            read(path)
        except (RecordingError, UsageError) as error:
            one_line(error)


def test_a_bad_chunk_in_the_middle(tmp_path):
    path = write_ros1(tmp_path / "run.bag", DRIVE, "bz2", chunk_bytes=2000)
    content = bytearray(path.read_bytes())
    places = [k for k in range(len(content)) if content[k : k + 3] == b"BZh"]
    at = places[len(places) // 2] + 20
    content[at : at + 40] = bytes(40)
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=r"cannot read .*: Invalid data stream"):
        drain(path, strict=True)


def test_pieces_of_different_formats(tmp_path):
    log = tmp_path / "run.log"
    log.write_bytes(LOG)
    with pytest.raises(RecordingError, match="must be of one format, found carmen and rosbag1"):
        open_recording([write_ros1(tmp_path / "run.bag", DRIVE), log])


def test_a_bag_without_messages(tmp_path):
    for path in (write_ros1(tmp_path / "run.bag", []), write_ros2(tmp_path / "run", [])):
        with pytest.raises(NoScansError, match="no laser scan in") as caught:
            open_recording(path)
        assert caught.value.hint == "recorded: nothing"
        assert inspect_recording(path).plan.problem.startswith("no laser scan in")


def test_start_beyond_the_end(tmp_path):
    path = write_ros1(tmp_path / "run.bag", DRIVE)
    with pytest.raises(UsageError, match=r"start 100 s lies beyond the end of the recording \(5\.9 s\)"):
        open_recording(path, SourceOptions(start=100))
    log = tmp_path / "run.log"
    log.write_bytes(LOG)
    with pytest.raises(UsageError, match=r"start 5000 s lies beyond the end of the recording \(1999\.0 s\)"):
        open_recording(log, SourceOptions(start=5000))


def test_a_part_without_scans(tmp_path):
    path = write_ros1(tmp_path / "run.bag", [odom(0.0), odom(1.0), scan(2.0)])
    with pytest.raises(NoScansError, match="no usable scan of /scan") as caught:
        list(open_recording(path, SourceOptions(duration=1.0)).records())
    assert caught.value.hint == "the chosen part of the recording holds none"
