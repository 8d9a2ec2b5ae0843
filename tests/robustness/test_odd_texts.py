"""Parameter files, pictures and truths of strangers."""

import json
import struct
import zlib

import cv2
import numpy as np
import pytest
import yaml

from glassslam.cli import main
from glassslam.cli.terminal import complain
from glassslam.config import Config
from glassslam.errors import ConfigError, OutputError, SessionError
from glassslam.outputs.image_file import read_image
from glassslam.session.database import explained
from glassslam.yamltext import parse_yaml

BOMB = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 10)}]\n" for k in range(1, 12)
)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[" * 5000, "nests too deeply"),
        ("{a: " * 5000, "nests too deeply"),
        (BOMB, "more than a million values"),
        ("a: &a [*a]", "part of itself"),
        ("a: 2001-13-45", "makes no sense"),
        ("a: " + "9" * 5000, "makes no sense"),
        ("a: !!int x", "makes no sense"),
        ("a: !!python/object/apply:os.system [true]", "could not determine a constructor"),
        ("a: b: c", "mapping values are not allowed"),
        ("? [a, b]\n: c", "unhashable|unacceptable key"),
    ],
)
def test_hostile_yaml_is_one_kind_of_error(text, message):
    with pytest.raises(yaml.YAMLError, match=message):
        parse_yaml(text)


@pytest.mark.parametrize("text", ["", "a: 1", "[1, 2, {b: .inf}]", "a: &x [1]\nb: *x"])
def test_sound_yaml_is_that_of_the_library(text):
    assert parse_yaml(text) == yaml.safe_load(text)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("sensor: {max_range: .nan}", "sensor.max_range"),
        ("sensor: {max_range: .inf}", "sensor.max_range"),
        ("local: {occupied_space_weight: 1.0e-320}", "local.occupied_space_weight"),
        ("sensor: {max_rang: 20}", "unknown parameter 'sensor.max_rang'"),
        ("[" * 5000, "nests too deeply"),
        (BOMB, "a million"),
    ],
)
def test_a_configuration_that_makes_no_sense(tmp_path, text, message):
    (tmp_path / "robot.yaml").write_text(text)
    with pytest.raises(ConfigError, match=message) as caught:
        Config.load(tmp_path / "robot.yaml")
    assert "\n" not in caught.value.message
    assert caught.value.hint == "did you mean 'max_range'?" or "max_rang:" not in text


@pytest.mark.parametrize("value", ["[" * 3000, "2001-13-45", "&a [*a]"])
def test_a_value_of_the_command_line_that_makes_no_sense(value, capsys):
    assert main(["config", "--set", f"sensor.max_range={value}"]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_long_complaints_are_cut(capsys):
    complain("x" * 5000, "the hint stays", code=1)
    error = capsys.readouterr().err
    assert len(error) < 1100
    assert error.endswith("... (the hint stays)\n")


def picture(rows=4, columns=5, colour=False):
    shape = (rows, columns, 3) if colour else (rows, columns)
    return np.arange(np.prod(shape), dtype=np.uint8).reshape(shape)


def png(pixels):
    return cv2.imencode(".png", pixels)[1].tobytes()


def chunk(name, content):
    return struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))


def interlaced(pixels):
    """A PNG of the seven passes of Adam7, written by hand."""
    rows = b""
    passes = ["0088", "4088", "0448", "2044", "0224", "1022", "0112"]
    for x, y, dx, dy in (map(int, one) for one in passes):
        part = pixels[y::dy, x::dx]
        rows += b"".join(b"\0" + row.tobytes() for row in part if row.size)
    header = struct.pack(">IIBBBBB", pixels.shape[1], pixels.shape[0], 8, 0, 0, 0, 1)
    body = (chunk(b"IHDR", header), chunk(b"IDAT", zlib.compress(rows)), chunk(b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(body)


class TestPictures:
    @pytest.mark.parametrize("colour", [False, True])
    def test_sound_ones_are_read(self, tmp_path, colour):
        path = tmp_path / "map.png"
        path.write_bytes(png(picture(colour=colour)))
        np.testing.assert_array_equal(read_image(path, colour=colour), picture(colour=colour))

    @pytest.mark.parametrize("size", [(1, 1), (4, 5), (9, 17)])
    def test_interlaced_ones_as_well(self, tmp_path, size):
        path = tmp_path / "map.png"
        path.write_bytes(interlaced(picture(*size)))
        np.testing.assert_array_equal(read_image(path), picture(*size))

    def test_remarks_of_other_programs_do_not_matter(self, tmp_path):
        path, content = tmp_path / "map.png", png(picture())
        path.write_bytes(content[:33] + chunk(b"iCCP", b"profile\0\0nonsense") + content[33:])
        np.testing.assert_array_equal(read_image(path), picture())

    @pytest.mark.parametrize("kind", ["png", "pgm"])
    def test_no_damage_makes_noise(self, tmp_path, kind, capfd):
        path = tmp_path / f"map.{kind}"
        whole = cv2.imencode(f".{kind}", picture(20, 30))[1].tobytes()
        random = np.random.default_rng(0)
        for k in range(300):
            content = bytearray(whole[: random.integers(1, len(whole))] if k % 3 == 0 else whole)
            content[random.integers(len(content))] ^= 1 << random.integers(8)
            path.write_bytes(content)
            try:
                assert read_image(path).ndim == 2
            except OutputError as error:
                assert str(path) in error.message  # noqa: PT017
        assert capfd.readouterr() == ("", "")

    @pytest.mark.parametrize(
        ("content", "message"),
        [
            (b"", "is not an image"),
            (b"hello", "is not an image"),
            (b"P5\n100 100\n255\n" + bytes(50), "is a damaged image"),
            (b"P5\n90000 90000\n255\n", "a picture of 90000 x 90000 pixels is too large"),
            (
                b"\x89PNG\r\n\x1a\n"
                + chunk(b"IHDR", struct.pack(">IIBBBBB", 70000, 70000, 8, 0, 0, 0, 0))
                + chunk(b"IEND", b""),
                "a picture of 70000 x 70000 pixels is too large",
            ),
            (png(picture())[:-20], "is a damaged image"),
        ],
    )
    def test_what_is_wrong_is_told(self, tmp_path, content, message):
        path = tmp_path / "map.png"
        path.write_bytes(content)
        with pytest.raises(OutputError, match=message):
            read_image(path)


@pytest.mark.parametrize("x", ["1e300", "1e6", "1" * 5000, "[" * 3000])
def test_true_glass_beyond_all_buildings(tmp_path, x, capsys):
    feature = {
        "type": "Feature",
        "properties": {"kind": "glass"},
        "geometry": {"type": "LineString", "coordinates": [[0, 0], ["X", 0]]},
    }
    text = json.dumps({"type": "FeatureCollection", "features": [feature]}).replace('"X"', x)
    (tmp_path / "glass.geojson").write_text(text)
    assert (
        main(["evaluate", str(tmp_path / "glass.geojson"), "--glass", str(tmp_path / "glass.geojson")]) == 1
    )
    assert capsys.readouterr().err.count("\n") == 1


def test_a_pose_out_of_all_proportion(tmp_path, capsys):
    (tmp_path / "a.tum").write_text("0 0 0 0 0 0 0 1\n1 1e200 0 0 0 0 0 1\n")
    assert main(["evaluate", str(tmp_path / "a.tum"), "--trajectory", str(tmp_path / "a.tum")]) == 1
    assert "line 2: '1e200' is out of all proportion" in capsys.readouterr().err


def test_a_session_that_names_its_tables_in_no_text(tmp_path):
    """SQLite quotes names it has found in the file, and Python cannot read its words then."""
    path = tmp_path / "run.partial" / "session.db"
    with (
        pytest.raises(SessionError, match=r"session\.db is damaged: a text in it is none") as caught,
        explained(path),
    ):
        b"malformed database schema (\xff)".decode()
    assert caught.value.hint == "save what there is: glassslam recover run"
