"""The width of the cone, measured from readings made with a known one."""

import math

import numpy as np
import pytest
from sonar_worlds import LEFT, RIGHT, ring, sweeps

from glassslam.slam.result import OccupancyMap
from glassslam.sonar.beam_width import measure_beam_width
from glassslam.sonar.ray_kernels import nearest_in_cones


def posts(count=300, seed=3):
    """A field of single posts: the nearest one within the cone depends on the width of the cone."""
    random = np.random.default_rng(seed)
    cells = np.full((160, 160), 0.1, dtype=np.float32)
    cells[tuple(random.integers(0, 160, (2, count)))] = 0.9
    return OccupancyMap(cells, 0.05, (-4.0, -4.0))


def heard(grid, half_width_deg, count=120, noise=0.02):
    """Sweeps of three sonars that hear the nearest post in a cone of the given half width."""
    random = np.random.default_rng(1)
    poses = np.column_stack((random.uniform(-1.5, 1.5, (count, 2)), random.uniform(-3, 3, count)))
    placed = sweeps(np.zeros((count, 3)), ring(0.0, LEFT, RIGHT), poses)
    rays = placed.sensors.reshape(-1, 3).copy()
    rays[:, :2] = (rays[:, :2] + 4.0) / 0.05
    nearest = np.empty((len(rays), 1))
    nearest_in_cones(grid.probability, rays, np.radians([half_width_deg]), 60, 60.0, 0.65, nearest)
    ranges = nearest.reshape(count, 3) * 0.05 + random.normal(0.0, noise, (count, 3))
    return sweeps(ranges, placed.ring, poses)


@pytest.mark.parametrize("half_width_deg", [6.0, 12.0, 25.0])
def test_the_width_with_which_readings_were_made_is_found(half_width_deg):
    grid = posts()
    found = measure_beam_width(heard(grid, half_width_deg), grid)
    assert math.degrees(found.width) == pytest.approx(2.0 * half_width_deg, abs=4.0)
    assert found.low <= found.width <= found.high
    assert found.agreement.max() > 0.9
    assert found.spread == pytest.approx(0.02, abs=0.01)
    assert abs(found.bias) < 0.02


def test_readings_that_the_lidar_cannot_explain_do_not_count():
    grid = posts()
    seen = heard(grid, 12.0)
    mixed = np.where(np.arange(120)[:, None] % 2 == 0, 0.15, seen.ranges)
    found = measure_beam_width(sweeps(mixed, seen.ring, seen.poses), grid)
    assert math.degrees(found.width) == pytest.approx(24.0, abs=5.0)
    assert found.readings < 0.7 * np.isfinite(seen.ranges).sum()


def test_an_empty_map_tells_no_width():
    grid = OccupancyMap(np.full((40, 40), 0.1, np.float32), 0.05, (-1.0, -1.0))
    found = measure_beam_width(sweeps([[1.0]] * 100, ring(0.0)), grid)
    assert math.isnan(found.width)
    assert found.readings == 0


def test_it_gives_the_same_answer_twice():
    grid = posts()
    first, second = (measure_beam_width(heard(grid, 12.0), grid) for _ in range(2))
    assert (first.width, first.low, first.high) == (second.width, second.low, second.high)
