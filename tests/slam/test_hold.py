"""How firmly walls hold a match, and how much of a scan falls on what is known."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from slam_worlds import CORRIDOR, ROOM, Lidar, range_data

from glassslam.geometry import transform_points
from glassslam.grid.probability_grid import ProbabilityGrid
from glassslam.matching.gradient import match_scan
from glassslam.slam.hold_kernels import hold_of, known_share, mean_probability, weakest_direction

ORIGIN = np.array([-1.0, 2.0])
numbers = st.floats(-3.0, 3.0)


def curvature_along(information, heading):
    """Information of a step of 1 m when the rotation is chosen best for it."""
    step = np.array([math.cos(heading), math.sin(heading)])
    with_turn = information[:2, 2] @ step
    return step @ information[:2, :2] @ step - with_turn**2 / max(information[2, 2], 1e-12)


@given(st.lists(st.tuples(numbers, numbers, numbers), min_size=3, max_size=9))
def test_no_direction_is_held_less_than_the_weakest(rows):
    jacobian = np.array(rows) + 0.01 * np.eye(len(rows), 3)
    information = jacobian.T @ jacobian
    heading, share = weakest_direction(information)
    assert -math.pi / 2 < heading <= math.pi / 2
    along = curvature_along(information, heading)
    around = [curvature_along(information, angle) for angle in np.linspace(0.0, math.pi, 181)]
    assert along <= min(around) + 1e-6 * max(around) + 1e-9
    assert share * max(around) == pytest.approx(max(along, 0.0), abs=1e-3 * max(around) + 1e-9)


def test_without_information_no_direction_is_weaker():
    assert weakest_direction(np.zeros((3, 3)))[1] == 1.0


def naive_cells(cells, points, pose, shift):
    """Values of the cells under points one after the other; -1 outside the grid."""
    values = []
    for x, y in transform_points(pose, points) + np.asarray(shift) - ORIGIN:
        column, row = math.floor(x / 0.1), math.floor(y / 0.1)
        inside = 0 <= row < cells.shape[0] and 0 <= column < cells.shape[1]
        values.append(int(cells[row, column]) if inside else -1)
    return np.array(values)


@given(st.integers(0, 2**31), st.integers(1, 30))
def test_the_kernels_agree_with_their_naive_twins(seed, count):
    random = np.random.default_rng(seed)
    cells = random.integers(0, 5, (20, 30)).astype(np.uint16)
    table = np.array([0.5, 0.1, 0.3, 0.7, 0.9], dtype=np.float32)
    points, pose = random.uniform(-2, 2, (count, 2)), np.array([0.5, 3.0, random.uniform(-3, 3)])
    shift = random.uniform(-0.5, 0.5, 2)
    mean = mean_probability(cells, table, ORIGIN, 10.0, points, pose, *shift)
    assert mean == pytest.approx(
        table[np.maximum(naive_cells(cells, points, pose, shift), 0)].mean(), abs=1e-6
    )
    share = known_share(cells, ORIGIN, 10.0, points, pose)
    assert share == pytest.approx((naive_cells(cells, points, pose, (0, 0)) > 0).mean())


def test_no_points_are_no_overlap():
    assert known_share(np.ones((3, 3), np.uint16), ORIGIN, 10.0, np.empty((0, 2)), np.zeros(3)) == 0.0


def held(world, poses):
    """Hold of a scan at the last pose in the map of the scans at all of them, and its direction."""
    lidar, grid = Lidar(world), ProbabilityGrid(0.05)
    scans = [range_data(lidar.look(0.0, pose)).returns for pose in poses]
    for pose, points in zip(poses, scans, strict=True):
        grid.insert(pose[:2], transform_points(pose, points), np.empty((0, 2)))
    found = match_scan(grid, scans[-1], poses[-1], translation_weight=1.0, rotation_weight=1.0)
    return hold_of(
        grid.cells, grid.table, grid.origin, 20.0, scans[-1], found.pose, found.information
    )  # fmt: skip


@pytest.mark.parametrize("turn", [0.0, 0.7, 2.0])
def test_bare_walls_hold_nothing_along_them_however_the_robot_looks(turn):
    poses = np.array([[0.1 * k, 1.0, turn] for k in range(30)])
    hold, heading = held(CORRIDOR, poses)
    assert hold < 0.05
    assert abs(heading) < 0.1


def test_a_room_holds_a_scan_in_all_directions():
    hold, _ = held(ROOM, np.array([[1.2 + 0.1 * k, 1.0, 0.0] for k in range(30)]))
    assert hold > 0.3
