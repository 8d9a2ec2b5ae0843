"""Decision layers, by hand-computed examples."""

import itertools
import math

import numpy as np
import pytest
from fusion_worlds import LEFT, ring, sweeps
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from glassslam.config import FusionConfig
from glassslam.fusion.layer_kernels import clear_rays, count_ends
from glassslam.fusion.layers import attach, end_point_layer, minmax, pessimistic

NAN = math.nan
# P(free) as the study writes it; the maps hold P(occupied) = 1 - P(free)
LASER_FREE = np.array([[0.9, 0.2, 0.6, 0.8, NAN, NAN, 0.3]])
SONAR_FREE = np.array([[0.7, 0.4, 0.1, 0.2, 0.3, NAN, 0.3]])
OPINIONS = 1.0 - np.stack((LASER_FREE, SONAR_FREE))


def test_pessimistic_fusion_by_hand():
    probability, source = pessimistic(OPINIONS)
    assert 1.0 - probability == pytest.approx(np.array([[0.7, 0.2, 0.1, 0.2, 0.3, NAN, 0.3]]), nan_ok=True)
    assert source.tolist() == [[2, 1, 2, 2, 2, 0, 3]]


def test_minmax_fusion_by_hand():
    """Means 0.8, 0.3, 0.35, 0.5, 0.4 (unseen is 0.5), none, 0.3."""
    probability, source = minmax(OPINIONS)
    assert 1.0 - probability == pytest.approx(np.array([[0.9, 0.2, 0.1, 0.5, 0.3, NAN, 0.3]]), nan_ok=True)
    assert source.tolist() == [[1, 1, 2, 0, 2, 0, 3]]


def test_three_sensors_have_their_own_numbers():
    opinions = np.array([[[0.2, 0.9]], [[0.6, 0.1]], [[0.8, 0.8]]])
    probability, source = minmax(opinions)
    assert probability.tolist() == [[0.8, 0.9]]
    assert source.tolist() == [[3, 1]]


maps = arrays(np.float64, (2, 3, 4), elements=st.one_of(st.floats(0.0, 1.0), st.just(NAN)))


@given(maps)
def test_the_source_names_the_sensor_that_has_the_value(opinions):
    for rule in (pessimistic, minmax):
        probability, source = rule(opinions)
        prior = np.where(np.isnan(opinions), 0.5, opinions)
        for sensor in (0, 1):
            mine = source == sensor + 1
            assert np.array_equal(probability[mine], prior[sensor][mine])
        assert (prior[0] == prior[1])[source == 3].all()
        assert np.isnan(probability).tolist() == np.isnan(opinions).all(axis=0).tolist()


@given(maps)
def test_pessimistic_is_never_freer_than_minmax(opinions):
    careful, sure = pessimistic(opinions)[0], minmax(opinions)[0]
    known = ~np.isnan(careful)
    assert (careful[known] >= sure[known] - 1e-9).all()


def test_attaching_lays_occupied_cells_over_the_lidar_map():
    lidar = np.array([[0.1, NAN, 0.98, 0.1, NAN]], np.float32)
    sonar = np.array([[0.7, 0.66, 0.9, 0.64, NAN]], np.float32)
    probability, source = attach(lidar, sonar, 0.65)
    assert probability[0] == pytest.approx([0.9, 0.9, 0.98, 0.1, NAN], nan_ok=True)
    assert source.tolist() == [[2, 2, 1, 1, 0]]


def layer(ranges, yaws=(0.0,), **config):
    count = len(ranges)
    poses = [(0.05, 0.05, 0.0)] * count
    return end_point_layer(sweeps(poses, ring(*yaws), ranges), FusionConfig(**config))


def value(grid, x, y):
    index = (
        math.floor((y - grid.origin[1]) / grid.resolution),
        math.floor((x - grid.origin[0]) / grid.resolution),
    )
    return float(grid.probability[index])


def test_the_layer_has_the_share_of_readings_that_end_in_a_cell():
    grid = layer([[1.0]] + [[1.5]] * 3)
    assert grid.resolution == 0.1
    assert value(grid, 1.05, 0.05) == pytest.approx(0.25)
    assert value(grid, 1.55, 0.05) == pytest.approx(1.0)
    assert value(grid, 0.55, 0.05) == 0.0
    assert math.isnan(value(grid, 1.05, 0.15))


@pytest.mark.parametrize(("passed", "is_occupied"), [(13, True), (14, False)])
def test_a_cell_is_occupied_from_a_share_of_007_on(passed, is_occupied):
    grid = layer([[1.0]] + [[1.5]] * passed)
    lidar = np.full(grid.probability.shape, 0.1, np.float32)
    laid, _ = attach(lidar, grid.probability, FusionConfig().overlay_min_occupancy)
    row, column = math.floor((0.05 - grid.origin[1]) / 0.1), math.floor((1.05 - grid.origin[0]) / 0.1)
    assert (laid[row, column] > 0.5) == is_occupied


@pytest.mark.parametrize("reading", [2.5, math.inf, math.nan, 0.01])
def test_readings_beyond_the_limit_and_no_readings_are_not_entered(reading):
    assert layer([[reading]]).probability.size == 0


def test_end_points_stand_where_the_sonar_looks():
    grid = layer([[0.5]], yaws=(LEFT,))
    assert value(grid, 0.05, 0.55) == 1.0


@given(st.integers(0, 10**6))
def test_counting_ends_as_the_naive_twin(seed):
    random = np.random.default_rng(seed)
    starts, ends = random.uniform(0, 12, (6, 2)), random.uniform(0, 12, (6, 2))
    ended, passed = np.zeros((12, 12), np.int64), np.zeros((12, 12), np.int64)
    count_ends(starts, ends, ended, passed)
    naive = np.zeros((12, 12), np.int64)
    for (x0, y0), (x1, y1) in zip(starts, ends, strict=True):
        steps = math.ceil(2.0 * math.hypot(x1 - x0, y1 - y0)) + 1
        line = [(y0 + (y1 - y0) * s / steps, x0 + (x1 - x0) * s / steps) for s in range(steps)]
        for cell in {(math.floor(y), math.floor(x)) for y, x in line} - {(math.floor(y1), math.floor(x1))}:
            naive[cell] += 1
    assert passed.tolist() == naive.tolist()
    assert ended.sum() == 6
    assert all(ended[math.floor(y), math.floor(x)] for x, y in ends)


@given(st.integers(0, 10**6))
def test_rays_clear_up_to_the_first_wall_as_by_the_naive_twin(seed):
    random = np.random.default_rng(seed)
    occupied = random.uniform(size=(12, 15)) < 0.1
    starts, ends = random.uniform(-1.0, 14.0, (2, 5, 2))
    cleared = np.zeros(occupied.shape, np.bool_)
    clear_rays(starts, ends, occupied, cleared)
    naive = np.zeros(occupied.shape, bool)
    for (x0, y0), (x1, y1) in zip(starts, ends, strict=True):
        steps = math.ceil(2.0 * math.hypot(x1 - x0, y1 - y0)) + 1
        line = [(y0 + (y1 - y0) * s / steps, x0 + (x1 - x0) * s / steps) for s in range(steps)]
        cells = [(math.floor(y), math.floor(x)) for y, x in line]
        for (r, c), (row, column) in itertools.pairwise([cells[0], *cells]):
            if not (0 <= row < 12 and 0 <= column < 15) or occupied[row, column]:
                break
            if occupied[r, column] and occupied[row, c]:
                break
            naive[row, column] = True
    assert cleared.tolist() == naive.tolist()


@pytest.mark.parametrize(("wall", "is_held"), [("#+++ +#++ ++#+ +++#", True), ("#+++ ++++ ++#+ +++#", False)])
def test_rays_do_not_slip_through_walls_that_run_aslant(wall, is_held):
    occupied = np.array([[cell == "#" for cell in row] for row in wall.split()])[::-1]
    cleared = np.zeros((4, 4), np.bool_)
    clear_rays(np.array([[0.5, 0.6]]), np.array([[2.6, 2.7]]), occupied, cleared)
    assert cleared[1, 1]
    assert cleared[2, 2] != is_held
