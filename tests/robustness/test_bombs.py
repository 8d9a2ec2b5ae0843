"""Small files that claim or unpack to gigabytes: refused or skipped before memory follows."""

import bz2
import gzip
import sqlite3
import struct
import sys
import tracemalloc
from pathlib import Path

import lz4.frame
import numpy as np
import pytest

sys.path.append(str(Path(__file__).parents[1] / "sources"))
from damaged_bags import DRIVE, WHOLE, chunk_record, read
from rosbags.rosbag2 import CompressionFormat, CompressionMode
from rosbags.rosbag2 import Writer as Writer2
from tiny_bags import T0, scan, write_ros1, write_ros2

from glassslam.errors import GlassSlamError, RecordingError
from glassslam.outputs import beam_labels
from glassslam.sources import open_recording, rosbag2files
from glassslam.sources.mcaprecords import CHUNK, DATA_END, read_record
from glassslam.sources.unpacking import ZstdDecompressor
from glassslam.sources.windows import BytesWindow

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

MUCH = 400_000_000
ALLOWED = 80_000_000
ZEROS = bytes(MUCH)


@pytest.fixture
def little_memory():
    """No more than a fifth of what the bombs unpack to is ever taken."""
    tracemalloc.start()
    yield
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < ALLOWED


@pytest.fixture(scope="module")
def bombs():
    return {"bz2": bz2.compress(ZEROS), "lz4": lz4.frame.compress(ZEROS), "zstd": zstd.compress(ZEROS)}


@pytest.mark.parametrize("claimed", [1000, MUCH, 4_000_000_000])
@pytest.mark.parametrize("compression", ["bz2", "lz4"])
def test_a_chunk_of_a_ros1_bag(tmp_path, bombs, compression, claimed, little_memory):
    path = WHOLE["ROS1"](tmp_path)
    with path.open("ab") as file:
        file.write(chunk_record(bombs[compression], claimed, compression.encode()))
    content = bytearray(path.read_bytes())
    at = content.index(b"index_pos=") + len(b"index_pos=")
    content[at : at + 8] = bytes(8)
    path.write_bytes(content)
    records, damage = read(path)
    assert len(records) == len(DRIVE)
    assert any("claims" in part.reason for part in damage)


def mcap_chunk(data, claimed, compression):
    body = struct.pack("<QQQI", T0 * 10**9, T0 * 10**9 + 1, claimed, 0)
    body += struct.pack("<I", len(compression)) + compression + struct.pack("<Q", len(data)) + data
    return struct.pack("<BQ", CHUNK, len(body)) + body


@pytest.mark.parametrize("claimed", [1000, MUCH, 1 << 60])
@pytest.mark.parametrize("compression", ["lz4", "zstd"])
def test_a_chunk_of_an_mcap(tmp_path, bombs, compression, claimed, little_memory):
    path = WHOLE["mcap"](tmp_path)
    content, end = path.read_bytes(), 8
    while (record := read_record(BytesWindow(content), end)).op != DATA_END:
        end = record.end
    path.write_bytes(content[:end] + mcap_chunk(bombs[compression], claimed, compression.encode()))
    records, damage = read(path)
    assert len(records) == len(DRIVE)
    assert any("claims" in part.reason for part in damage)


@pytest.mark.parametrize("compression", ["lz5", "", "none", "xz"])
def test_a_chunk_of_an_mcap_in_an_unknown_packing(tmp_path, bombs, compression):
    path = WHOLE["mcap zstd"](tmp_path)
    content = path.read_bytes()
    end = next(e for e in chunk_ends(content))
    path.write_bytes(content[:end] + mcap_chunk(b"x" * 5000, 9000, compression.encode()))
    records, damage = read(path)
    assert len(records) == len(DRIVE)
    assert damage


def chunk_ends(content):
    position = 8
    while position < len(content) - 8:
        record = read_record(BytesWindow(content), position)
        position = record.end
        if record.op == CHUNK:
            yield record.end


def test_messages_of_a_directory_that_are_packed_one_by_one(tmp_path, bombs):
    folder = write_ros2(tmp_path / "run", DRIVE[:20], packing="message")
    with sqlite3.connect(folder / "run.db3") as database:
        database.execute("UPDATE messages SET data = ? WHERE id = 8", (bombs["zstd"],))
    database.close()
    recording = open_recording(folder)
    assert len(list(recording.records())) == 19
    assert sum(recording.dropped.values()) == 1


def test_a_directory_whose_files_are_packed(tmp_path, monkeypatch):
    folder = tmp_path / "run"
    writer = Writer2(folder, version=9)
    writer.set_compression(CompressionMode.FILE, CompressionFormat.ZSTD)
    with writer:
        pass
    (file,) = folder.glob("*.zstd")
    file.write_bytes(zstd.compress(bytes(5_000_000)))
    monkeypatch.setattr(rosbag2files.shutil, "disk_usage", lambda _: type("U", (), {"free": 1_000_000}))
    with pytest.raises(
        RecordingError, match=r"cannot unpack .*: it needs 0\.0 GB, there are 0\.0 GB"
    ) as caught:
        open_recording(folder)
    assert "TMPDIR" in caught.value.hint


@pytest.mark.parametrize("packing", ["lz4", "zstd'", "../x", "", 5])
def test_metadata_that_name_an_unknown_packing(tmp_path, packing):
    folder = write_ros2(tmp_path / "run", DRIVE, packing="message")
    text = (folder / "metadata.yaml").read_text()
    (folder / "metadata.yaml").write_text(
        text.replace("compression_format: zstd", f'compression_format: "{packing}"')
    )
    records, (damage,) = read(folder)
    assert len(records) == len(DRIVE)
    assert "is not supported" in damage.reason
    with pytest.raises(RecordingError, match="is not supported"):
        read(folder, strict=True)


@pytest.mark.parametrize("line", ["x" * 999 + "\n", "x"])
def test_a_packed_text_log(tmp_path, line, little_memory):
    log = "".join(f"FLASER 2 1.0 2.0 0 0 0 {k} 0 0 {k}.5 host {k}.5\n" for k in range(50)).encode()
    path = tmp_path / "run.clf.gz"
    with gzip.open(path, "wb", compresslevel=1) as file:
        file.write(log)
        for _ in range(MUCH // 1_000_000 // 4):
            file.write(line.encode() * (1_000_000 // len(line)))
    assert path.stat().st_size < 3_000_000
    recording = open_recording(path)
    assert sum(type(record).__name__ == "LaserScan" for record in recording.records()) == 50
    assert bool(recording.damage) == (len(line) == 1)


@pytest.mark.parametrize("storage", ["ROS1", "sqlite3", "mcap"])
def test_a_message_that_claims_billions_of_beams(tmp_path, storage, little_memory):
    """The number of beams stands before them: four billion, where there are fifty."""
    marked = [1.0 + k for k in range(50)]

    drive = [scan(k / 10, marked) for k in range(20)]
    path = (
        write_ros1(tmp_path / "run", drive)
        if storage == "ROS1"
        else write_ros2(tmp_path / "run", drive, storage)
    )
    file = path if path.is_file() else next(p for p in path.iterdir() if p.suffix != ".yaml")
    content = bytearray(file.read_bytes())
    beams = struct.pack("<I", 50) + np.array(marked, dtype=np.float32).tobytes()
    places = [k for k in range(len(content)) if content.startswith(beams, k)]
    assert len(places) == 20
    content[places[7] : places[7] + 4] = b"\xff\xff\xff\xff"
    file.write_bytes(content)
    recording = open_recording(path)
    assert len(list(recording.records())) == 19
    assert sum(recording.dropped.values()) == 1


def test_labels_of_beams(tmp_path, monkeypatch):
    path = tmp_path / "beams.npz"
    np.savez_compressed(path, stamps=np.zeros(1_000_000))
    monkeypatch.setattr(beam_labels, "MOST_BYTES", 1_000_000)
    with pytest.raises(GlassSlamError, match=r"beams\.npz would unpack to 0\.0 GB"):
        beam_labels.read_beam_labels(path)


def test_the_decompressor_is_that_of_the_bombs(bombs):
    assert len(ZstdDecompressor().decompress(bombs["zstd"], max_length=1000)) == 1000
