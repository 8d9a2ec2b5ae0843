"""map.png."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glassslam.errors import GridError
from glassslam.outputs.picture import grey_levels, path_pixels, scale_bar_length, write_picture
from glassslam.records import Trajectory
from glassslam.slam.result import OccupancyMap

NOWHERE = Trajectory(np.empty(0), np.empty((0, 3)))


def test_occupied_is_black_free_is_white_and_unknown_is_as_grey_as_undecided():
    levels = grey_levels(np.array([[0.95, 0.9, 0.5, np.nan, 0.1, 0.0]], dtype=np.float32))
    np.testing.assert_array_equal(levels, [[0, 0, 205, 205, 255, 255]])


def test_large_maps_are_shaded_like_small_ones():
    probability = np.linspace(0, 1, 700, dtype=np.float32)[:, None]
    naive = [grey_levels(probability[i : i + 1])[0, 0] for i in range(700)]
    np.testing.assert_array_equal(grey_levels(probability)[:, 0], naive)


def test_a_pose_in_the_middle_of_a_cell_is_in_the_middle_of_its_pixel(draw_map):
    grid = draw_map("""
        ...
        ...
    """)
    poses = np.array([[0.25, 0.25, 0.0], [1.25, 0.75, 0.0]])
    np.testing.assert_allclose(path_pixels(grid, poses), [[0, 1], [2, 0]])
    np.testing.assert_allclose(path_pixels(grid, poses, zoom=3), [[1, 4], [7, 1]])


def test_picture_shows_walls_and_path_where_they_are(tmp_path):
    probability = np.full((300, 400), 0.1, dtype=np.float32)
    probability[290:] = 0.9
    grid = OccupancyMap(probability, 0.05, (0.0, 0.0))
    path = Trajectory(np.arange(2.0), np.array([[5.025, 5.025, 0.0], [15.025, 5.025, 0.0]]))
    image = cv2.imread(str(write_picture(grid, path, tmp_path / "map.png")))
    zoom = 3
    assert image.shape[1] == 400 * zoom
    assert image.shape[0] > 300 * zoom
    assert image[5, 600].tolist() == [0, 0, 0]
    assert image[450, 600].tolist() == [255, 255, 255]
    row = (300 - 100) * zoom - 2
    blue, _, red = image[row, 600].tolist()
    assert blue > 150 > red
    _, green, red = image[row, 301].tolist()
    assert green > 100 > red
    _, green, red = image[row, 901].tolist()
    assert red > 150 > green


def test_a_map_without_a_path_is_drawn(draw_map, tmp_path):
    assert cv2.imread(str(write_picture(draw_map("#."), NOWHERE, tmp_path / "m.png"))) is not None


def test_same_map_same_bytes(draw_map, tmp_path):
    first, second = (write_picture(draw_map("#.?"), NOWHERE, tmp_path / name) for name in ("a", "b"))
    assert first.read_bytes() == second.read_bytes()


def test_an_empty_map_is_refused(tmp_path):
    with pytest.raises(GridError, match="the map has no cells"):
        write_picture(OccupancyMap(np.empty((0, 0), np.float32), 1.0, (0, 0)), NOWHERE, tmp_path / "m.png")


@given(st.floats(1e-3, 1e4))
def test_scale_bars_are_round_and_fill_at_least_two_fifths(longest):
    length = scale_bar_length(longest)
    assert 0.4 * longest - 1e-9 <= length <= longest * (1 + 1e-9)
    assert float(f"{length:.0e}") == pytest.approx(length)
    assert f"{length:.0e}"[0] in "125"
