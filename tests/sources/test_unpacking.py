"""Chunks are unpacked as far as they go, and never further than they claim."""

import bz2
import random

import lz4.frame
import pytest
from rosbags.rosbag2.storage_mcap import zstd

from glassslam.sources.unpacking import LARGEST_CHUNK, unpack, unpacked_size

PACK = {"bz2": bz2.compress, "lz4": lz4.frame.compress, "zstd": zstd.compress}
RAW = random.Random(1).randbytes(3000) * 700


@pytest.mark.parametrize("kind", PACK)
def test_whole(kind):
    found = unpack(PACK[kind](RAW), kind, len(RAW))
    assert found.data == RAW
    assert found.problem == ""


@pytest.mark.parametrize("kind", PACK)
def test_frames_that_follow_each_other(kind):
    packed = PACK[kind](RAW[:1000]) + PACK[kind](RAW[1000:])
    assert unpack(packed, kind, len(RAW)).data == RAW


@pytest.mark.parametrize("kind", PACK)
def test_a_cut_chunk_gives_its_beginning(kind):
    packed = PACK[kind](RAW)
    found = unpack(packed[: len(packed) * 9 // 10], kind, len(RAW))
    assert found.problem == f"a chunk holds {len(found.data)} of the {len(RAW)} bytes it claims"
    assert RAW.startswith(found.data)
    assert len(found.data) > 0 or kind == "zstd"


def test_what_comes_before_a_broken_block_is_kept():
    packed = bytearray(bz2.compress(RAW, compresslevel=1))
    packed[len(packed) * 3 // 4] ^= 255
    found = unpack(bytes(packed), "bz2", len(RAW))
    assert found.problem == "Invalid data stream"
    assert len(found.data) >= 900_000
    assert RAW.startswith(found.data)


@pytest.mark.parametrize("kind", PACK)
def test_more_than_claimed_is_cut(kind):
    found = unpack(PACK[kind](bytes(10_000_000)), kind, 1000)
    assert found.data == bytes(1000)
    assert found.problem == "a chunk holds more than the 1000 bytes it claims"


@pytest.mark.parametrize("kind", PACK)
def test_claims_beyond_the_limit_are_refused_before_unpacking(kind):
    found = unpack(PACK[kind](RAW), kind, LARGEST_CHUNK + 1)
    assert found.data == b""
    assert found.problem == "a chunk claims to hold 134 MB, more than the 134 MB allowed"


def test_stored_chunks_are_taken_as_they_are():
    assert unpack(b"abc", "none", 3).data == b"abc"
    assert unpack(b"abc", "", 3).data == b"abc"


def test_unknown_compression():
    assert unpack(b"abc", "rar", 3).problem == "Compression 'rar' is not supported"


def test_less_than_the_limit_is_no_fault_where_nothing_was_claimed():
    assert unpack(zstd.compress(RAW), "zstd", exact=False).problem == ""


def test_counting_what_a_file_unpacks_to(tmp_path):
    path = tmp_path / "bomb.zstd"
    path.write_bytes(zstd.compress(bytes(50_000_000)))
    assert unpacked_size(path, 10**9) == 50_000_000
    assert 10_000_000 < unpacked_size(path, 10_000_000) < 12_000_000
