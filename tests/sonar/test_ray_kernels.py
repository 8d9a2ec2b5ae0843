"""Rays cast in a lidar map."""

import math

import numpy as np
import pytest

from glassslam.sonar.ray_kernels import first_occupied, nearest_in_cones


@pytest.fixture
def room(draw_map):
    return draw_map(
        """
        ????????
        ########
        ........
        ........
        ........
        """
    ).probability


@pytest.mark.parametrize(
    ("angle_deg", "distance"), [(90, 2.5), (0, math.inf), (-90, math.inf), (45, 2.5 * 2**0.5)]
)
def test_a_ray_ends_at_the_first_occupied_cell_or_at_the_border(room, angle_deg, distance):
    assert first_occupied(room, 2.5, 0.5, math.radians(angle_deg), 20.0, 0.65) == pytest.approx(
        distance, abs=0.51
    )


def test_a_ray_goes_no_farther_than_its_reach(room):
    assert first_occupied(room, 2.5, 0.5, 0.5 * math.pi, 2.0, 0.65) == math.inf


def test_unknown_cells_stop_no_ray(room):
    assert first_occupied(np.full_like(room, np.nan), 2.5, 0.5, 0.5 * math.pi, 20.0, 0.65) == math.inf


def test_wider_cones_see_nearer_surfaces_as_the_naive_twin_says():
    random = np.random.default_rng(4)
    cells = np.where(random.uniform(size=(40, 40)) < 0.05, 0.9, 0.1).astype(np.float32)
    rays = np.column_stack((random.uniform(10, 30, (20, 2)), random.uniform(-3, 3, 20)))
    half_widths = np.radians([2.0, 5.0, 11.0])
    nearest = np.empty((20, 3))
    nearest_in_cones(cells, rays, half_widths, 2, 15.0, 0.65, nearest)
    for ray, found in zip(rays, nearest, strict=True):
        offsets = [0.0]
        for h, (inner, outer) in enumerate(zip(np.radians([0.0, 2.0, 5.0]), half_widths, strict=True)):
            offsets += [0.5 * (inner + outer), outer]
            cast = [
                first_occupied(cells, *ray[:2], ray[2] + s * a, 15.0, 0.65) for a in offsets for s in (-1, 1)
            ]
            assert found[h] == pytest.approx(min(cast))
    assert (np.diff(nearest[np.isfinite(nearest).all(axis=1)], axis=1) <= 0).all()
