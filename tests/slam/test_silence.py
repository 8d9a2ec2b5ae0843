"""What silence means: nothing where known walls are often silent."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glassslam.slam.node import Node
from glassslam.slam.result import OccupancyMap
from glassslam.slam.silence import occupied_where_silent
from glassslam.slam.silence_kernels import count_meetings

WALL = np.zeros((20, 40), np.bool_)
WALL[10] = True
GRID = OccupancyMap(np.where(WALL, 0.9, 0.1).astype(np.float32), 0.1, (0.0, 0.0))
NOTHING = np.empty((0, 2), np.float32)


def node():
    return Node(0, 0, 0.0, np.zeros(3), np.zeros(2), NOTHING, NOTHING, 0.3)


def fan(count, reach):
    """So many beams that go up `reach` from the sensor."""
    return np.column_stack((np.linspace(-1.0, 1.0, count), np.full(count, reach))).astype(np.float32)


@pytest.mark.parametrize(
    ("answered", "silent", "expected"), [(30, 0, 0.0), (30, 10, 0.2), (10, 10, 1.0 / 3.0)]
)
def test_the_more_walls_are_silent_the_less_silence_says(answered, silent, expected):
    rays = [(fan(answered, 0.55), fan(silent, 1.2))]
    place = np.array([[2.0, 0.5, 0.0]])
    assert occupied_where_silent([node()], place, rays, GRID, WALL) == pytest.approx(expected)


def test_beams_that_head_for_no_wall_do_not_count():
    place = np.array([[2.0, 0.5, 0.0]])
    away = [(fan(5, -0.4), fan(20, -0.4))]
    assert occupied_where_silent([node()], place, away, GRID, WALL) == 0.0
    short = [(fan(10, 0.55), np.concatenate((fan(20, 0.3), fan(20, -0.4))))]
    assert occupied_where_silent([node()], place, short, GRID, WALL) == 0.0


def test_without_beams_silence_is_believed():
    assert occupied_where_silent([], np.empty((0, 3)), [], GRID, WALL) == 0.0


@given(st.integers(0, 10**6), st.floats(0.0, 3.0))
def test_meetings_are_those_of_the_naive_twin(seed, beyond):
    random = np.random.default_rng(seed)
    walls = random.uniform(size=(15, 20)) < 0.08
    start, ends = random.uniform(0.0, 15.0, 2), random.uniform(-3.0, 22.0, (10, 2))
    naive = 0
    for end in ends:
        length = math.dist(start, end)
        for s in range(math.floor((length + beyond) / 0.5) + 1):
            x, y = start + s * 0.5 / length * (end - start)
            if not (0 <= math.floor(y) < 15 and 0 <= math.floor(x) < 20):
                break
            if walls[math.floor(y), math.floor(x)]:
                naive += 1
                break
    assert count_meetings(start, ends, walls, beyond) == naive
