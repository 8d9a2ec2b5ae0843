"""Revisit Scan Fusion in worlds drawn as text."""

import math

import numpy as np
import pytest
from fusion_worlds import LEFT, RIGHT, drawn, ring, sweeps
from hypothesis import given
from hypothesis import strategies as st

from glassslam.config import FusionConfig
from glassslam.fusion.revisit import revisit_scan_fusion, side_sonars
from glassslam.fusion.revisit_kernels import first_stop, ray_cells, revisit

SIGNS = {"#": 0.9, ".": 0.1, "+": 0.5}
# cells of 0.5 m: a gap of 0.5 m is one cell
LIDAR = """
    ######
    ......
    ??????
    ......
    ......
    ######
    """
SONAR = """
    ??????
    ??????
    ??##??
    ......
    ......
    ######
    """


def fused(lidar, sonar, poses, yaws, variant, **config):
    config = {"glass_gap": 0.5, **config}
    probability, source = revisit_scan_fusion(
        lidar, sonar, sweeps(poses, ring(*yaws)), FusionConfig(**config), variant
    )
    return drawn(probability, SIGNS), source[::-1].tolist()


UNDER_GLASS, BESIDE_IT = (1.25, 0.75, 0.0), (0.25, 0.75, 0.0)


def test_a_ray_that_meets_glass_is_the_sonars(draw_map):
    picture, source = fused(draw_map(LIDAR), draw_map(SONAR), [UNDER_GLASS], [LEFT], "glass")
    assert picture == ["######", "......", "??#???", "......", "......", "######"]
    assert [row[2] for row in source] == [1, 1, 2, 2, 2, 1]
    assert [row[0] for row in source] == [1, 1, 0, 1, 1, 1]


def test_with_all_rays_unknown_space_up_to_the_lidars_wall_becomes_free(draw_map):
    picture, source = fused(draw_map(LIDAR), draw_map(SONAR), [BESIDE_IT], [LEFT], "all")
    assert picture == ["######", "......", ".?????", "......", "......", "######"]
    assert [row[0] for row in source] == [1, 1, 1, 1, 1, 1]


def test_without_them_rays_that_meet_no_glass_write_nothing(draw_map):
    picture, _ = fused(draw_map(LIDAR), draw_map(SONAR), [BESIDE_IT], [LEFT, RIGHT], "glass")
    assert picture == drawn(draw_map(LIDAR).probability, SIGNS)


@pytest.mark.parametrize(("gap", "is_glass"), [(0.9, True), (1.0, False)])
def test_the_difference_must_exceed_the_gap(draw_map, gap, is_glass):
    """The lidar ray is 4 cells long and the sonar ray 2, 1 m less."""
    picture, _ = fused(draw_map(LIDAR), draw_map(SONAR), [UNDER_GLASS], [LEFT], "all", glass_gap=gap)
    assert (picture[2][2] == "#") == is_glass


def test_a_sonar_wall_behind_the_lidars_is_not_believed(draw_map):
    lidar = draw_map(".....#..")
    sonar = draw_map(".......#")
    picture, _ = fused(lidar, sonar, [(0.25, 0.25, 0.0)], [0.0], "all")
    assert picture == [".....#.."]


def test_a_ray_that_nothing_stops_is_not_written(draw_map):
    nothing = draw_map("????????")
    picture, source = fused(nothing, nothing, [(0.25, 0.25, 0.0)], [0.0], "all")
    assert picture == ["????????"]
    assert source == [[0] * 8]


def test_glass_without_a_lidar_wall_behind_it_is_measured_to_the_border(draw_map):
    picture, _ = fused(draw_map("........"), draw_map("...#????"), [(0.25, 0.25, 0.0)], [0.0], "glass")
    assert picture == ["...#...."]


def test_the_lidar_map_itself_is_left_alone(draw_map):
    lidar = draw_map(LIDAR)
    before = lidar.probability.copy()
    fused(lidar, draw_map(SONAR), [UNDER_GLASS], [LEFT], "all")
    assert np.array_equal(lidar.probability, before, equal_nan=True)


def test_a_robot_outside_of_the_maps_sees_nothing(draw_map):
    picture, _ = fused(draw_map(LIDAR), draw_map(SONAR), [(-9.0, 0.0, 0.0)], [0.0], "all")
    assert picture == drawn(draw_map(LIDAR).probability, SIGNS)


def test_side_sonars_of_a_pioneer_are_the_first_that_look_sideways():
    yaws = np.radians([90, 50, 30, 10, -10, -30, -50, -90, -90, -130, -150, -170, 170, 150, 130, 90])
    assert side_sonars(ring(*yaws)).tolist() == [0, 7]
    assert side_sonars(ring(*np.radians([80, 60, 0, -60, -80]))).tolist() == [0, 4]


def test_only_side_sonars_are_revisited_when_asked(draw_map):
    lidar, sonar = draw_map(LIDAR), draw_map(SONAR)
    for sonars, written in (("all", "."), ("sides", "?")):
        picture, _ = fused(lidar, sonar, [(0.25, 0.75, 0.0)], [LEFT + 0.02, RIGHT, 1.0], "all", sonars=sonars)
        assert picture[2][1] == written


@given(st.floats(-math.pi, math.pi), st.integers(0, 19), st.integers(0, 29))
def test_a_ray_is_connected_and_leads_to_the_border(angle, row, column):
    path = np.empty((50, 2), np.int64)
    count = ray_cells(row, column, angle, path, 20, 30)
    cells = path[:count]
    assert cells[0].tolist() == [row, column]
    assert (np.abs(np.diff(cells, axis=0)).max(axis=1) == 1).all() if count > 1 else True
    assert cells[-1, 0] in (0, 19) or cells[-1, 1] in (0, 29)
    away = (cells[:, 1] - column) * math.sin(angle) - (cells[:, 0] - row) * math.cos(angle)
    assert np.abs(away).max() <= 1.0


def naive_revisit(rays, lidar, sonar, gap, everything, start):
    """The rule of the paper ray by ray, with Bresenham's line from the cell lists of `ray_cells`."""
    fused = start.copy()
    rows, columns = start.shape
    for x, y, yaw in rays:
        path = np.empty((rows + columns, 2), np.int64)
        count = ray_cells(math.floor(y), math.floor(x), yaw, path, rows, columns)
        cells = [tuple(cell) for cell in path[:count].tolist()]
        if len(cells) < 2:
            continue
        stops = [naive_stop(grid, cells) for grid in (lidar, sonar)]
        lengths = [math.dist(cells[0], cells[count - 1 if stop is None else stop]) for stop in stops]
        is_glass = lengths[0] - lengths[1] > gap
        stop = stops[1] if is_glass else stops[0]
        if stop is None or not (is_glass or everything):
            continue
        for cell in cells[:stop]:
            fused[cell] = 0.1
        if (sonar if is_glass else lidar)[cells[stop]]:
            fused[cells[stop]] = 0.9
    return fused


def naive_stop(grid, cells):
    """The first occupied cell, or the first step, but not from the sonar itself, between two that touch."""
    for k in range(1, len(cells)):
        (r0, c0), (r1, c1) = cells[k - 1], cells[k]
        if grid[r1, c1] or (k > 1 and r0 != r1 and c0 != c1 and grid[r0, c1] and grid[r1, c0]):
            return k
    return None


@given(st.integers(0, 10**6), st.booleans())
def test_rays_are_written_as_by_the_naive_twin(seed, everything):
    random = np.random.default_rng(seed)
    lidar, sonar = random.uniform(size=(2, 15, 22)) < 0.06
    start = random.choice([0.1, 0.9, np.nan], (15, 22)).astype(np.float32)
    rays = np.column_stack(
        (random.uniform(-2, 24, 12), random.uniform(-2, 17, 12), random.uniform(-4, 4, 12))
    )
    result, source = start.copy(), np.zeros((15, 22), np.uint8)
    revisit(rays, lidar, sonar, 2.0, everything, 0.1, 0.9, np.empty((37, 2), np.int64), result, source)
    expected = naive_revisit(rays, lidar, sonar, 2.0, everything, start)
    assert result == pytest.approx(expected, nan_ok=True)
    changed = ~((result == start) | (np.isnan(result) & np.isnan(start)))
    assert (source[changed] > 0).all()


def test_a_wall_that_runs_aslant_holds_a_ray():
    """Its cells touch at corners, through which Bresenham's line would slip."""
    wall = np.fliplr(np.eye(4, dtype=bool))
    path = np.array([[0, 0], [1, 1], [2, 2], [3, 3]])
    assert first_stop(wall, path, 4) == 2
    wall[1, 2] = False
    assert first_stop(wall, path, 4) == 4


def test_the_cell_under_the_sonar_stops_no_ray():
    path = np.array([[0, 0], [0, 1], [0, 2]])
    assert first_stop(np.array([[True, False, True]]), path, 3) == 2
    assert first_stop(np.array([[True, False, False]]), path, 3) == 3
