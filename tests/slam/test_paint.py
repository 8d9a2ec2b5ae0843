"""Submaps painted over each other: what the last ones say counts most."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glassslam.geometry import inverse, transform_points
from glassslam.grid import OddsModel, ProbabilityGrid
from glassslam.grid.submap import Submap
from glassslam.slam.paint import paint_submaps
from glassslam.slam.paint_kernels import paint

NOTHING = np.empty((0, 2))
HERE = np.zeros(3)
CELL = 0.5
POINT = np.array([[1.25, 0.25]])


def submap(*, hits=0, passes=0, lock=False, index=0):
    """A submap whose cell at POINT was hit or passed so many times."""
    grid = ProbabilityGrid(CELL, OddsModel(0.7, 0.4))
    if lock:
        grid.lock(POINT)
    for _ in range(hits):
        grid.insert(POINT[0] - [1.0, 0.0], POINT, NOTHING)
    for _ in range(passes):
        grid.insert(POINT[0] - [1.0, 0.0], POINT + np.array([1.0, 0.0]), NOTHING)
    grid.finish()
    return Submap(index, HERE, grid, [0], finished=True)


def value(grid, point=POINT):
    column, row = np.floor((point[0] - grid.origin) / grid.resolution).astype(int)
    return float(grid.probability[row, column])


def painted(*submaps, poses=None):
    poses = np.zeros((len(submaps), 3)) if poses is None else np.array(poses, dtype=float)
    return paint_submaps(submaps, poses, CELL)


def test_one_submap_keeps_what_it_says():
    assert value(painted(submap(hits=20))[0]) == pytest.approx(0.75, abs=0.01)
    assert value(painted(submap(passes=30))[0]) == pytest.approx(0.047, abs=0.005)


def test_what_no_submap_saw_is_unknown():
    grid, _ = painted(submap(hits=1))
    assert math.isnan(value(grid, POINT + np.array([0.0, 0.5])))


def test_submaps_that_agree_make_each_other_surer():
    assert value(painted(submap(hits=20), submap(hits=20))[0]) > value(painted(submap(hits=20))[0])


def test_a_later_submap_fades_what_an_earlier_one_locked():
    grid, locked = painted(submap(lock=True), submap(passes=30))
    assert value(grid) < 0.3
    assert locked.shape == (0, 2)


def test_glass_locked_again_in_the_later_submap_stays():
    grid, locked = painted(submap(passes=30), submap(lock=True, passes=30), submap(lock=True, passes=30))
    assert value(grid) > 0.65
    assert locked.tolist() == POINT.tolist()


def test_submaps_lie_where_the_graph_puts_them():
    grid, locked = painted(submap(lock=True), poses=[[2.0, 1.0, 0.5 * math.pi]])
    assert locked == pytest.approx(np.array([[2.0 - 0.25, 1.0 + 1.25]]))
    assert value(grid, locked) == pytest.approx(0.75, abs=0.01)


@settings(max_examples=30)
@given(st.integers(0, 10**6))
def test_the_kernel_paints_as_its_naive_twin(seed):
    random = np.random.default_rng(seed)
    cells = random.integers(0, 6, (7, 9)).astype(np.uint16)
    shades = random.uniform(-0.5, 0.5, 6).astype(np.float32)
    origin, corner = random.uniform(-2, 2, 2), random.uniform(-3, 0, 2)
    map_from_grid = random.uniform(-2, 2, 3)
    start = random.uniform(0, 1, (10, 12)).astype(np.float32)
    seen = random.integers(0, 3, (10, 12)).astype(np.uint8)
    brightness, state = start.copy(), seen.copy()
    paint(
        cells, origin, 0.5, inverse(map_from_grid), shades, 5, corner, 0.4, 1, 2, 9, 11, brightness, state
    )  # fmt: skip
    for row in range(10):
        for column in range(12):
            centre = corner + 0.4 * (np.array([column, row]) + 0.5)
            place = transform_points(inverse(map_from_grid), centre[None])[0] - origin
            c, r = np.floor(place / 0.5).astype(int)
            inside = 1 <= row < 9 and 2 <= column < 11 and 0 <= r < 7 and 0 <= c < 9
            light, mark = start[row, column], seen[row, column]
            if inside and cells[r, c]:
                shade = shades[cells[r, c]]
                light = min(light + shade, 1.0) if shade >= 0 else light * (1 + shade)
                mark = 2 if cells[r, c] == 5 else max(mark, 1)
            assert brightness[row, column] == pytest.approx(light, abs=1e-6)
            assert state[row, column] == mark
