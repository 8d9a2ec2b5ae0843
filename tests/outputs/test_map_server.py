"""map.yaml and map.pgm, loaded back by an independent reading of nav2's rules."""

import re

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from glassslam.errors import GridError, OutputError
from glassslam.outputs import read_map, trinary_image, write_map
from glassslam.slam.result import OccupancyMap


def load_as_nav2(yaml_path):
    """nav2's loader, cell by cell: -1 unknown, 0 free, 100 occupied, row 0 at the origin."""
    fields = yaml.safe_load(yaml_path.read_text())
    data = (yaml_path.parent / fields["image"]).read_bytes()
    header = re.match(rb"P5\s+(\d+)\s+(\d+)\s+255\s", data)
    width, height = int(header[1]), int(header[2])
    pixels = data[header.end() :]
    assert len(pixels) == width * height
    cells = [0] * (width * height)
    for y in range(height):
        for x in range(width):
            shade = pixels[y * width + x] / 255.0
            occ = shade if fields["negate"] else 1.0 - shade
            if fields["occupied_thresh"] < occ:
                value = 100
            elif occ < fields["free_thresh"]:
                value = 0
            else:
                value = -1
            cells[width * (height - y - 1) + x] = value
    return np.array(cells).reshape(height, width), fields


def test_image_shows_the_highest_y_on_top(draw_map):
    grid = draw_map("""
        #.?
        ..+
    """)
    np.testing.assert_array_equal(trinary_image(grid), [[0, 254, 205], [254, 254, 205]])


def test_nav2_finds_every_cell_where_it_was(draw_map, tmp_path):
    grid = draw_map(
        """
        ##??
        #..?
        #.+#
        """,
        resolution=0.05,
        origin=(-12.35, 7.1),
    )
    written = write_map(grid, tmp_path / "map.yaml")
    cells, fields = load_as_nav2(tmp_path / "map.yaml")
    assert [path.name for path in written] == ["map.yaml", "map.pgm"]
    np.testing.assert_array_equal(cells, [[100, 0, -1, 100], [100, 0, 0, -1], [100, 100, -1, -1]])
    assert fields["origin"] == [-12.35, 7.1, 0.0]
    assert (fields["resolution"], fields["mode"], fields["negate"]) == (0.05, "trinary", 0)
    assert (fields["occupied_thresh"], fields["free_thresh"]) == (0.65, 0.196)


def test_tiny_numbers_stay_numbers(draw_map, tmp_path):
    write_map(draw_map("#", origin=(1e-7, -2e-6)), tmp_path / "map.yaml")
    _, fields = load_as_nav2(tmp_path / "map.yaml")
    assert fields["origin"] == [1e-7, -2e-6, 0.0]


probabilities = arrays(
    np.float32, array_shapes(min_dims=2, max_dims=2, max_side=7), elements=st.floats(0, 1, width=32)
)


@given(probabilities)
def test_what_is_written_is_read_back(tmp_path_factory, probability):
    folder = tmp_path_factory.mktemp("map")
    write_map(OccupancyMap(probability, 0.05, (1.5, -2.5)), folder / "map.yaml")
    loaded = read_map(folder)
    cells, _ = load_as_nav2(folder / "map.yaml")
    np.testing.assert_array_equal(loaded.probability == 1.0, cells == 100)
    np.testing.assert_array_equal(loaded.probability == 0.0, cells == 0)
    np.testing.assert_array_equal(cells == 100, probability > 0.65)
    np.testing.assert_array_equal(cells == 0, probability < 0.196)
    assert (loaded.resolution, loaded.origin) == (0.05, (1.5, -2.5))


def test_negated_maps_are_read_negated(draw_map, tmp_path):
    write_map(draw_map("#."), tmp_path / "map.yaml")
    text = (tmp_path / "map.yaml").read_text().replace("negate: 0", "negate: 1")
    (tmp_path / "map.yaml").write_text(text)
    np.testing.assert_array_equal(read_map(tmp_path).probability, [[0.0, 1.0]])


def test_empty_map_is_refused(tmp_path):
    with pytest.raises(GridError, match="the map has no cells"):
        write_map(OccupancyMap(np.empty((0, 3), np.float32), 0.05, (0.0, 0.0)), tmp_path / "map.yaml")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (lambda text: text.replace("origin", "orgin"), "a value is missing or no number: 'origin'"),
        (lambda text: text.replace("0.65", "high"), "a value is missing or no number"),
        (lambda text: text.replace("0.0]", "1.5]"), r"the map is turned by 1\.5 rad"),
        *[
            (
                lambda text, r=r: re.sub("resolution: .*", f"resolution: {r}", text),
                "the resolution is ",
            )
            for r in ("0", "-0.05", ".inf", ".nan", "1e-300", "1e300")
        ],
        (
            lambda text: text.replace("origin: [", "origin: [1e300, 0.0, 0.0] #"),
            r"the origin lies at 1e\+300, 0",
        ),
        (lambda text: text.replace("0.0]", ".nan]"), "the origin lies at"),
        (lambda text: text.replace("map.pgm", "other.pgm"), "cannot read .*other.pgm: No such file"),
        (lambda text: "image: [", "is not YAML"),
        (lambda text: "- 1", "describes no map"),
    ],
)
def test_damaged_descriptions_are_refused(draw_map, tmp_path, change, complaint):
    write_map(draw_map("#."), tmp_path / "map.yaml")
    (tmp_path / "map.yaml").write_text(change((tmp_path / "map.yaml").read_text()))
    with pytest.raises(OutputError, match=complaint):
        read_map(tmp_path)


@pytest.mark.parametrize("content", [b"", b"no image"])
def test_an_image_that_is_none_is_refused(draw_map, tmp_path, content):
    write_map(draw_map("#."), tmp_path / "map.yaml")
    (tmp_path / "map.pgm").write_bytes(content)
    with pytest.raises(OutputError, match=r"map\.pgm is not an image"):
        read_map(tmp_path)
