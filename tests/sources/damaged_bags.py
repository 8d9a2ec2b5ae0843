"""What tests of damaged bags share: small whole ones, and their records."""

import struct

from tiny_bags import lone_file, odom, scan, write_ros1, write_ros2

from glassslam.sources import SourceOptions, open_recording

DRIVE = [message for k in range(60) for message in (odom(k / 10, 0.1 * k), scan(k / 10, [1.0 + k] * 50))]

WHOLE = {
    "ROS1": lambda folder: write_ros1(folder / "whole.bag", DRIVE, chunk_bytes=2000),
    "ROS1 bz2": lambda folder: write_ros1(folder / "whole.bag", DRIVE, "bz2", chunk_bytes=2000),
    "ROS1 lz4": lambda folder: write_ros1(folder / "whole.bag", DRIVE, "lz4", chunk_bytes=2000),
    "mcap": lambda folder: lone_file(write_ros2(folder / "whole", DRIVE, "mcap")),
    "mcap zstd": lambda folder: lone_file(write_ros2(folder / "whole", DRIVE, "mcap", "storage")),
    "sqlite3": lambda folder: lone_file(write_ros2(folder / "whole", DRIVE)),
}


def told(record):
    """Type and record time of a record: enough to know it again in `DRIVE`."""
    return type(record).__name__, round(record.record_stamp, 3)


def read(path, **options):
    """Records as `told`, and the damage."""
    recording = open_recording(path, SourceOptions(**options))
    records = [told(record) for record in recording.records()]
    return records, recording.damage


def count_while_growing(path, rest):
    """Records of a file to which the rest of it is added as soon as the first one is read."""
    stream = open_recording(path).records()
    next(stream)
    with path.open("ab") as file:
        file.write(rest)
    return 1 + sum(1 for _ in stream)


def chunk_record(content, claimed, compression=b"none"):
    """A chunk of a ROS1 bag."""
    return ros1_record(
        {b"compression": compression, b"op": b"\x05", b"size": struct.pack("<I", claimed)}, content
    )


def ros1_record(fields, data=b""):
    """A record of a ROS1 bag."""
    header = b"".join(
        struct.pack("<I", len(name) + 1 + len(value)) + name + b"=" + value for name, value in fields.items()
    )
    return struct.pack("<I", len(header)) + header + struct.pack("<I", len(data)) + data
