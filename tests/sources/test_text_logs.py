"""Text logs that are cut off, damaged or still written: read as far as they go, and the loss is told."""

import gzip
import random
import zlib

import numpy as np
import pytest
from damaged_bags import count_while_growing

from glassslam.cli import main
from glassslam.errors import NoScansError, RecordingError
from glassslam.records import LaserScan, RangeRing
from glassslam.sources import SourceOptions, open_recording, pimap, textlines
from glassslam.sources.formats import Piece
from glassslam.sources.inspection import inspect_recording
from glassslam.sources.pimap import read_pimap
from glassslam.sources.sonarfile import open_sonar
from glassslam.sources.textlines import TextLog, text_damage

T0 = 637_009_341_791_590_928
_noise = random.Random(3)


def beams(count):
    return " ".join(f"{_noise.uniform(1, 4):.2f}" for _ in range(count))


CARMEN = "".join(f"FLASER 90 {beams(90)} 0 0 0 {k / 10} 0 0 {k}.5 host {k}.5\n" for k in range(200))
PLAYER = "## Player version 2.1.1\n0.1 1 6665 sonar 00 004 001 2 +0.1 0 +1.5 0 0 0\n" + "".join(
    f"{k}.6 1 6665 position2d 00 001 001 {k} 0 0 0 0 0 0\n"
    f"{k}.7 1 6665 laser 00 001 001 1 -1.5 +1.5 +1.5 8.0 3 {_noise.random()} 0 {_noise.random()} 0 3.0 1\n"
    f"{k}.8 1 6665 sonar 00 001 001 2 {_noise.uniform(1, 4):.3f} 1.0\n"
    for k in range(200)
)
PIMAP = [f"{k} {k} {k} {T0 + 10**6 * k} {beams(16)}\n" for k in range(300)]
TEXTS = {"carmen": CARMEN, "player": PLAYER, "pimap": "".join(PIMAP)}


def packed(text):
    return gzip.compress(text.encode(), mtime=0)


def lines_of(path, **options):
    log = TextLog(Piece(path, "carmen", path.stat().st_size), **options)
    return list(log.lines()), log


def drain(path, kind, **options):
    """Records and damage of a log of any kind."""
    if kind == "pimap":
        file = open_sonar(path, SourceOptions(**options))
        return list(file.records(lambda _: None)), file.damage
    recording = open_recording(path, SourceOptions(**options))
    return list(recording.records()), recording.damage


class TestLines:
    @pytest.mark.parametrize("text", ["", "a", "a\n", "a\nb", "\n\na\r\nb\n", "x" * 200_000 + "\ny"])
    @pytest.mark.parametrize("kind", ["plain", "packed", "two members", "zeros behind"])
    def test_are_those_of_the_text(self, tmp_path, text, kind):
        path, half = tmp_path / "run.log", len(text) // 2
        path.write_bytes({
            "plain": text.encode(),
            "packed": packed(text),
            "two members": packed(text[:half]) + packed(text[half:]),
            "zeros behind": packed(text) + bytes(1000),
        }[kind])  # fmt: skip
        lines, log = lines_of(path, strict=True)
        assert lines == (text.encode().removesuffix(b"\n").split(b"\n") if text else [])
        assert log.gaps == []

    def test_of_what_is_written_later_are_not_read(self, tmp_path):
        path = tmp_path / "run.log"
        for content, more in ((b"a\nb\n", b"c\n"), (packed("a\nb\n"), packed("c\n"))):
            path.write_bytes(content)
            log = TextLog(Piece(path, "carmen", path.stat().st_size))
            with path.open("ab") as file:
                file.write(more)
            assert list(log.lines()) == [b"a", b"b"]
            assert log.gaps == []

    @pytest.mark.parametrize("share", [0.1, 0.5, 0.97])
    def test_before_a_cut_are_all_read(self, tmp_path, share):
        """Not one whole line is lost of what the bytes in front of the cut unpack to."""
        content, path = packed(CARMEN), tmp_path / "run.log.gz"
        cut = int(share * len(content))
        path.write_bytes(content[:cut])
        lines, log = lines_of(path)
        there = zlib.decompressobj(31).decompress(content[:cut])
        assert lines == there.split(b"\n")[:-1]
        (gap,) = log.gaps
        assert (gap.offset, gap.bytes, gap.reason) == (cut, 0, textlines.CUT_OFF)

    @pytest.mark.parametrize("seed", range(20))
    def test_around_a_damaged_byte(self, tmp_path, seed):
        content = bytearray(packed(CARMEN))
        at = random.Random(seed).randrange(2000, len(content) - 10)
        content[at] ^= 1 << seed % 8
        path = tmp_path / "run.log.gz"
        path.write_bytes(content)
        lines, log = lines_of(path)
        before = zlib.decompressobj(31).decompress(content[:at]).split(b"\n")[:-1]
        assert len(before) > 0
        assert lines[: len(before)] == before
        (gap,) = log.gaps
        assert gap.offset + gap.bytes == len(content)
        assert gap.offset >= at - 70_000
        assert gap.reason == textlines.CHECKSUM or gap.reason.startswith("Error -3 while decompressing")
        with pytest.raises(RecordingError, match=r"cannot read .*run\.log\.gz: ") as caught:
            lines_of(path, strict=True)
        assert "gzip -t" in caught.value.hint

    def test_before_foreign_bytes_behind_the_log(self, tmp_path):
        path = tmp_path / "run.log.gz"
        path.write_bytes(packed("a\nb\n") + b"hello")
        lines, log = lines_of(path)
        assert lines == [b"a", b"b"]
        assert [(gap.reason, gap.bytes, gap.expected) for gap in log.gaps] == [(textlines.NO_GZIP, 5, 0)]

    @pytest.mark.parametrize("is_packed", [False, True])
    def test_without_an_end_never_fill_the_memory(self, tmp_path, is_packed, monkeypatch):
        monkeypatch.setattr(textlines, "LONGEST_LINE", 100_000)
        text = "a\n" + "x" * 5_000_000 + "\nb\n" + "y" * 3_000_000
        path = tmp_path / "run.log"
        path.write_bytes(packed(text) if is_packed else text.encode())
        lines, log = lines_of(path)
        assert [line for line in lines if line] == [b"a", b"b"]
        assert [gap.reason for gap in log.gaps] == [textlines.TOO_LONG] * 2
        assert sum(damage.messages_lost for damage in text_damage([log], 2, 0.0, 1.0)) == 2


@pytest.mark.parametrize("kind", TEXTS)
@pytest.mark.parametrize("share", [0.3, 0.9, 0.999])
def test_a_cut_packed_log_is_read_up_to_the_cut(tmp_path, kind, share):
    path, content = tmp_path / "run.gz", packed(TEXTS[kind])
    path.write_bytes(content)
    complete, nothing = drain(path, kind)
    assert nothing == ()
    path.write_bytes(content[: int(share * len(content))])
    records, (damage,) = drain(path, kind)
    assert share * len(complete) * 0.9 - 3 < len(records) < len(complete) + (share > 0.99)
    assert [r.stamp for r in records] == pytest.approx([r.stamp for r in complete[: len(records)]], abs=0.06)
    assert (damage.file, damage.messages_lost) == (str(path), 1)
    assert damage.reason == "the file is cut off here, and nothing tells how much is missing"
    assert damage.first_stamp == pytest.approx(records[-1].record_stamp, abs=1.0)
    with pytest.raises(RecordingError, match=r"cannot read .*run\.gz: the file is cut off here"):
        drain(path, kind, strict=True)
    report = inspect_recording(path)
    assert report.damage == (damage,)
    with pytest.raises(RecordingError, match="the file is cut off here"):
        inspect_recording(path, SourceOptions(strict=True))


def test_what_follows_damage_within_a_packed_log_is_estimated(tmp_path):
    content = bytearray(packed(CARMEN))
    content[len(content) // 2 : len(content) // 2 + 400] = b"\xff" * 400
    path = tmp_path / "run.gz"
    path.write_bytes(content)
    records, (damage,) = drain(path, "carmen")
    scans = [record for record in records if isinstance(record, LaserScan)]
    assert damage.messages_lost == pytest.approx(200 - len(scans), abs=30)
    assert damage.seconds_lost == pytest.approx(200 - len(scans), abs=30)


def test_a_log_cut_before_its_first_scan(tmp_path):
    path = tmp_path / "run.clf.gz"
    head = "".join(f"PARAM robot_{k}_{_noise.random()} 1\n" for k in range(1000))
    path.write_bytes(packed(head + CARMEN)[:5000])
    with pytest.raises(NoScansError, match="no usable FLASER or ROBOTLASER1 line") as caught:
        open_recording(path)
    assert caught.value.hint == textlines.CUT_OFF


def test_the_command_line_tells_and_refuses(tmp_path, capsys):
    path, out = tmp_path / "run.clf.gz", str(tmp_path / "out")
    path.write_bytes(packed(CARMEN)[:20_000])
    assert main(["map", str(path), "-o", out]) == 3
    assert "the file is cut off here" in " ".join(capsys.readouterr().out.split())
    assert main(["inspect", str(path)]) == 3
    assert "the file is cut off here" in " ".join(capsys.readouterr().out.split())
    assert main(["map", str(path), "-o", out, "--overwrite", "--strict"]) == 1
    error = capsys.readouterr().err
    assert error.startswith(f"error: cannot read {path}: the file is cut off here")
    assert error.count("\n") == 1


@pytest.mark.parametrize("kind", TEXTS)
def test_a_log_that_ends_in_zeros_after_a_power_cut(tmp_path, kind):
    path = tmp_path / "run.log"
    path.write_text(TEXTS[kind])
    complete, _ = drain(path, kind)
    path.write_bytes(TEXTS[kind].encode() + bytes(30_000))
    records, _ = drain(path, kind)
    assert len(records) == len(complete)


@pytest.mark.parametrize("kind", ["carmen", "player"])
def test_a_log_that_grows_is_read_to_its_size_at_opening(tmp_path, kind):
    text = TEXTS[kind]
    half = text.index("\n", len(text) // 2) + 1
    path = tmp_path / "run.log"
    path.write_text(text[:half])
    before, _ = drain(path, kind)
    assert count_while_growing(path, text[half:].encode()) == len(before)
    assert len(drain(path, kind)[0]) > len(before)


class TestPimap:
    @pytest.fixture
    def log(self, tmp_path):
        def write(rows):
            path = tmp_path / "scene_sonar.txt"
            path.write_text("".join(rows))
            return path

        return write

    @pytest.mark.parametrize(
        "bad",
        [
            "garbage\n",
            PIMAP[100].rsplit(" ", 1)[0] + "\n",
            PIMAP[100].replace(" ", " 1.0 ", 7),
            PIMAP[100].replace(str(T0 + 10**8), "x"),
            PIMAP[100].replace(str(T0 + 10**8), str(T0 + 10**8 + 4 * 10**16)),
            PIMAP[100].replace(str(T0 + 10**8), str(T0 + 10**8 - 10**10)),
            PIMAP[100].replace(str(T0 + 10**8), "12"),
            PIMAP[100].replace(".", ".x", 1),
            PIMAP[100].replace("0", "1_0", 1),
            "\x00\x01\x02\n",
        ],
    )
    @pytest.mark.parametrize("place", [0, 100, 299])
    def test_a_damaged_line_costs_that_line(self, log, bad, place):
        path = log(PIMAP)
        complete = read_pimap(path)
        log([*PIMAP[:place], bad, *PIMAP[place + 1 :]])
        found = read_pimap(path)
        assert (found.dropped, found.damage) == (1, ())
        np.testing.assert_array_equal(found.values, np.delete(complete.values, place, axis=0))
        np.testing.assert_allclose(
            found.sweep_times, np.delete(complete.sweep_times, place), atol=0.02, rtol=0
        )

    def test_it_is_counted_and_ends_with_code_3(self, log, tmp_path, capsys):
        path = log([*PIMAP[:50], "garbage\n", "5 5\n", *PIMAP[52:]])
        dropped = []
        readings = list(open_sonar(path, SourceOptions()).records(dropped.append))
        assert len(readings) == 298
        assert dropped == ["unreadable line"] * 2
        assert inspect_recording(path).dropped == {"unreadable line": 2}
        carmen = tmp_path / "run.log"
        unix = (T0 - 621_355_968_000_000_000) / 1e7
        carmen.write_text(
            "".join(
                f"FLASER 90 {beams(90)} 0 0 0 0 0 0 {unix + k:.1f} host {unix + k:.1f}\n" for k in range(20)
            )
        )
        words = ["map", str(carmen), "--sonar", str(path), "-o", str(tmp_path / "out")]
        assert main(words) == 3
        assert "2 x unreadable line" in " ".join(capsys.readouterr().out.split())

    def test_a_pause_is_no_damage(self, log):
        later = [row.replace(str(T0)[:6], str(T0 + 10**14)[:6], 1) for row in PIMAP[150:]]
        found = read_pimap(log([*PIMAP[:150], *later]))
        assert found.dropped == 0
        assert np.ptp(found.times) > 1e6

    def test_layout_is_told_by_most_lines(self, log):
        poses = [f"{k} {k} {k} {T0 + 10**6 * k} 1.0 2.0 0.5\n" for k in range(100)]
        found = read_pimap(log([*poses, *PIMAP]))
        assert found.values.shape == (300, 16)
        assert found.dropped == 100

    def test_more_lines_than_anyone_records_are_refused(self, log, monkeypatch):
        monkeypatch.setattr(pimap, "MOST_LINES", 299)
        with pytest.raises(RecordingError, match="holds more than 299 lines"):
            read_pimap(log(PIMAP))

    def test_readings_in_a_packed_log_are_the_same(self, log, tmp_path):
        path = log(PIMAP)
        (tmp_path / "s.gz").write_bytes(packed("".join(PIMAP)))
        (plain, _), (again, _) = drain(path, "pimap"), drain(tmp_path / "s.gz", "pimap")
        assert len(plain) == 300
        for one, other in zip(plain, again, strict=True):
            assert isinstance(one, RangeRing)
            np.testing.assert_array_equal(one.ranges, other.ranges)


def test_unreadable_lines_of_a_player_log_beside_a_recording_are_counted(tmp_path):
    path = tmp_path / "run.log"
    path.write_text(PLAYER.replace("\n50.8 1 6665 sonar", "\n5x0.8 1 6665 sonar"))
    dropped = []
    readings = list(open_sonar(path, SourceOptions()).records(dropped.append))
    assert len(readings) == 199
    assert dropped == ["unreadable line"]
