"""Walls of one stretch in the free space of another."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glassslam.slam.conflict import Overlay
from glassslam.slam.conflict_kernels import count_conflicts

TABLE = np.linspace(0.0, 1.0, 11, dtype=np.float32)
TABLE[0] = 0.5
ORIGIN = np.zeros(2)
MAP = """
    .........
    .........
    ....#....
    .........
    .........
    ..   ....
"""
"""From the top: row 0; # wall, . free, blank unknown."""


def cells_of(text):
    rows = [line[4:].ljust(9) for line in text.strip("\n").splitlines() if line.strip()]
    return np.array([[{"#": 9, ".": 1, " ": 0}[c] for c in row] for row in rows], dtype=np.uint16)


def counted(points, margin, pose=(0.0, 0.0, 0.0)):
    points = np.array(points, dtype=np.float64).reshape(-1, 2)
    return count_conflicts(cells_of(MAP), TABLE, ORIGIN, 1.0, points, np.array(pose), margin, 0.4)


@pytest.mark.parametrize(
    ("column", "row", "margin", "result"),
    [
        (4, 2, 0, (1, 0)),  # on the wall
        (5, 2, 0, (1, 1)),
        (5, 2, 1, (1, 0)),  # beside the wall
        (7, 1, 1, (1, 1)),
        (3, 5, 0, (0, 0)),  # on unknown ground
        (3, 4, 1, (1, 0)),  # beside unknown ground
        (0, 0, 1, (0, 0)),  # too near the border to tell
        (20, 2, 0, (0, 0)),
        (-1, -1, 0, (0, 0)),
    ],
)
def test_one_point(column, row, margin, result):
    assert counted([column + 0.5, row + 0.5], margin) == result


def test_points_are_seen_from_the_pose():
    assert counted([0.0, -3.0], 1, pose=(4.5, 1.5, np.pi / 2)) == (1, 1)


def naive(cells, points, pose, margin):
    known = conflicts = 0
    turn = np.array([[np.cos(pose[2]), -np.sin(pose[2])], [np.sin(pose[2]), np.cos(pose[2])]])
    for column, row in np.floor(points @ turn.T + pose[:2]).astype(int):
        window = cells[max(row - margin, 0) : row + margin + 1, max(column - margin, 0) : column + margin + 1]
        is_inside = row >= 0 and column >= 0 and window.shape == (2 * margin + 1,) * 2
        if is_inside and cells[row, column]:
            known += 1
            conflicts += bool((TABLE[window] < 0.4).all())
    return known, conflicts


@given(st.integers(0, 10_000), st.integers(0, 2))
def test_the_kernel_counts_as_a_naive_one_does(seed, margin):
    random = np.random.default_rng(seed)
    cells = random.choice(
        np.array([0, 1, 2, 3, 9], dtype=np.uint16), p=[0.1, 0.5, 0.2, 0.1, 0.1], size=(9, 12)
    )
    points, pose = random.uniform(-9.0, 9.0, (30, 2)), random.uniform(-3.0, 6.0, 3)
    counts = count_conflicts(cells, TABLE, ORIGIN, 1.0, points, pose, margin, 0.4)
    assert counts == naive(cells, points, pose, margin)


def test_nothing_known_is_no_conflict():
    assert Overlay(0, 0, np.zeros(0, dtype=np.int64)).share == 0.0
    assert Overlay(200, 50, np.zeros(0, dtype=np.int64)).share == 0.25
