import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from optics_worlds import first_surface

from glassslam.simulation.raycast import SegmentGrid, clearance

ROOM = np.array([[0.0, 0, 4, 0], [4, 0, 4, 3], [4, 3, 0, 3], [0, 3, 0, 0]])

coordinate = st.integers(-60, 60).map(lambda k: k / 10)
segments = st.lists(
    st.tuples(coordinate, coordinate, coordinate, coordinate).filter(lambda s: s[:2] != s[2:]),
    min_size=1,
    max_size=12,
).map(lambda rows: np.array(rows, dtype=np.float64))
angle = st.floats(-math.pi, math.pi, allow_nan=False)


def naive_cast(x, y, theta, beyond, walls):
    return first_surface(x, y, math.cos(theta), math.sin(theta), beyond, walls)


def test_rays_from_the_middle_of_a_room_meet_its_four_walls():
    hits = SegmentGrid.build(ROOM).cast(np.full((4, 2), 1.0), np.array([0.0, np.pi / 2, np.pi, -np.pi / 2]))
    assert hits.distance == pytest.approx([3.0, 2.0, 1.0, 1.0])
    assert hits.segment.tolist() == [1, 2, 3, 0]
    assert hits.cosine == pytest.approx([1.0, 1.0, 1.0, 1.0])


def test_a_slanted_ray_meets_a_wall_at_the_cosine_of_its_angle():
    hits = SegmentGrid.build(ROOM).cast(np.array([[1.0, 1.0]]), np.array([np.deg2rad(30)]))
    assert hits.distance[0] == pytest.approx(3.0 / np.cos(np.deg2rad(30)))
    assert hits.cosine[0] == pytest.approx(np.cos(np.deg2rad(30)))


def test_a_ray_into_the_open_meets_nothing():
    hits = SegmentGrid.build(ROOM[:1]).cast(np.array([[1.0, 1.0], [9.0, 9.0]]), np.array([1.0, 0.0]))
    assert np.isinf(hits.distance).all()
    assert hits.segment.tolist() == [-1, -1]
    assert hits.cosine.tolist() == [0.0, 0.0]


def test_a_ray_from_outside_the_grid_enters_it():
    hits = SegmentGrid.build(ROOM).cast(np.array([[-50.0, 1.0], [1.0, 90.0]]), np.array([0.0, -np.pi / 2]))
    assert hits.distance == pytest.approx([50.0, 87.0])
    assert hits.segment.tolist() == [3, 2]


def test_a_ray_goes_on_beyond_a_pane():
    pane = np.vstack((ROOM, [[2.0, 0, 2, 3]]))
    grid = SegmentGrid.build(pane)
    origin, ahead = np.array([[1.0, 1.0]]), np.array([0.0])
    first = grid.cast(origin, ahead)
    second = grid.cast(origin, ahead, beyond=first.distance + 1e-9)
    assert (first.distance[0], second.distance[0]) == (pytest.approx(1.0), pytest.approx(3.0))
    assert (first.segment[0], second.segment[0]) == (4, 1)


def test_a_near_post_hides_the_wall_listed_in_the_same_cell():
    walls = np.array([[0.0, 1.2, 4, 1.2], [1.0, 1.1, 1.3, 1.1]])
    hits = SegmentGrid.build(walls, cell=2.0).cast(np.array([[1.1, 0.0]]), np.array([np.pi / 2]))
    assert (hits.distance[0], hits.segment[0]) == (pytest.approx(1.1), 1)


@settings(max_examples=200, deadline=None)
@given(
    walls=segments,
    x=coordinate,
    y=coordinate,
    theta=angle,
    beyond=st.sampled_from([0.0, 0.37, 2.0]),
    cell=st.sampled_from([0.3, 1.1, 5.0]),
)
def test_agrees_with_the_naive_twin(walls, x, y, theta, beyond, cell):
    hits = SegmentGrid.build(walls, cell).cast(np.array([[x, y]]), np.array([theta]), beyond)
    distance, _ = naive_cast(x, y, theta, beyond, walls)
    nearby = [naive_cast(x, y, theta, b, walls)[0] for b in (beyond - 1e-7, beyond + 1e-7)]
    grazed = any(
        abs(naive_cast(x, y, theta + e, beyond, walls)[0] - distance) > 1e-3
        for e in (-1e-6, 1e-6)
        if np.isfinite(distance)
    )
    if grazed or np.isinf(distance) or nearby[0] != nearby[1]:
        return
    assert hits.distance[0] == pytest.approx(distance, rel=1e-9, abs=1e-9)


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_agrees_with_the_naive_twin_in_general_position(seed):
    random = np.random.default_rng(seed)
    walls = random.uniform(-5, 5, (30, 4))
    origins, angles = random.uniform(-7, 7, (20, 2)), random.uniform(-4, 4, 20)
    beyond = random.choice([0.0, 1.0], 20)
    hits = SegmentGrid.build(walls).cast(origins, angles, beyond)
    expected = [naive_cast(*o, a, b, walls) for o, a, b in zip(origins, angles, beyond, strict=True)]
    assert hits.segment.tolist() == [index for _, index in expected]
    assert hits.distance == pytest.approx([distance for distance, _ in expected])


@pytest.mark.parametrize("theta", [0.0, np.pi / 2, np.pi, -np.pi / 2])
def test_rays_along_cell_borders_are_not_lost(theta):
    walls = np.array([[-3.0, -3, 3, -3], [3, -3, 3, 3], [3, 3, -3, 3], [-3, 3, -3, -3]])
    grid = SegmentGrid.build(walls, cell=1.0)
    origins = np.array([[k / 2, k / 2] for k in range(-5, 6)])
    hits = grid.cast(origins, np.full(11, theta))
    along = origins[:, 0] * np.cos(theta) + origins[:, 1] * np.sin(theta)
    assert hits.distance == pytest.approx(3.0 - along)


def test_clearance_is_the_distance_to_the_nearest_point_of_any_segment():
    points = np.array([[1.0, 1.0], [2.0, 2.9], [6.0, 0.0], [7.0, 7.0]])
    assert clearance(points, ROOM) == pytest.approx([1.0, 0.1, 2.0, 5.0])


def naive_clearance(point, walls):
    fractions = np.linspace(0, 1, 2001)[:, None]
    return min(np.hypot(*(w[:2] + fractions * (w[2:] - w[:2]) - point).T).min() for w in walls)


@settings(max_examples=50, deadline=None)
@given(walls=segments, x=coordinate, y=coordinate)
def test_clearance_agrees_with_a_dense_sampling(walls, x, y):
    point = np.array([x, y])
    assert clearance(point[None], walls)[0] == pytest.approx(naive_clearance(point, walls), abs=0.01)
