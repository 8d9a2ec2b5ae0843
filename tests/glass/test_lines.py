"""Lines through oriented pieces of surface."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glassslam.glass.lines import Line, axial_difference, fit_line, members, with_scatter

USELESS = 1e3


def pieces(angle, along, across=0.0, turned=0.0):
    """Pieces at places along a line through (1, 2), and their normals."""
    direction = np.array([math.cos(angle), math.sin(angle)])
    normal = np.array([-direction[1], direction[0]])
    along, across = np.asarray(along, dtype=np.float64), np.broadcast_to(across, len(along))
    positions = np.array([1.0, 2.0]) + along[:, None] * direction + across[:, None] * normal
    return positions, np.full(len(along), angle + 0.5 * math.pi) + turned


def fit(positions, normals, position_sigma=0.02, normal_sigma=0.02):
    count = len(positions)
    return fit_line(
        positions,
        normals,
        np.array(np.broadcast_to(position_sigma, count)),
        np.array(np.broadcast_to(normal_sigma, count)),
    )


@given(st.floats(-3.0, 3.0), st.integers(0, 10**6))
def test_without_normals_it_is_weighted_least_squares(angle, seed):
    random = np.random.default_rng(seed)
    along = np.sort(random.uniform(-5.0, 5.0, 12))
    sigma = random.uniform(0.01, 0.1, 12)
    positions, normals = pieces(angle, along, random.normal(0.0, 0.05, 12))
    line = fit(positions, normals, sigma, USELESS)

    offsets = positions - np.array([1.0, 2.0])
    x = offsets @ [math.cos(angle), math.sin(angle)]
    y = offsets @ [-math.sin(angle), math.cos(angle)]
    design = np.column_stack((np.ones(12), x)) / sigma[:, None]
    (height, slope), *_ = np.linalg.lstsq(design, y / sigma, rcond=None)
    assert axial_difference(line.angle, angle + math.atan(slope)) < 1e-4
    expected = np.column_stack((x, height + slope * x))
    turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
    assert np.abs(line.gap(np.array([1.0, 2.0]) + expected @ turn)).max() < 1e-3
    covariance = np.linalg.inv(design.T @ design)
    assert line.angle_sigma == pytest.approx(math.sqrt(covariance[1, 1]), rel=1e-3)
    assert line.position_sigma == pytest.approx(1.0 / math.sqrt(np.sum(sigma**-2.0)))


def test_a_short_wall_follows_the_normals():
    positions, normals = pieces(0.4, [-0.05, 0.0, 0.05], across=[-0.02, 0.0, 0.02])
    assert axial_difference(fit(positions, normals).angle, 0.4) < math.radians(2.0)


def test_a_long_wall_follows_the_positions():
    positions, normals = pieces(0.4, np.linspace(-5.0, 5.0, 9), turned=math.radians(5.0))
    assert axial_difference(fit(positions, normals, normal_sigma=0.1).angle, 0.4) < math.radians(0.05)


def test_normals_are_joined_by_their_weights():
    positions, _ = pieces(0.0, [0.0, 0.0])
    line = fit(positions, np.array([0.5 * math.pi, 0.5 * math.pi + 0.1]), 0.02, np.array([0.01, 0.02]))
    assert line.angle == pytest.approx(0.02, abs=1e-4)
    assert line.angle_sigma == pytest.approx(1.0 / math.sqrt(0.01**-2 + 0.02**-2))


@given(st.floats(-3.0, 3.0))
def test_it_does_not_matter_from_which_side_the_wall_was_seen(angle):
    positions, normals = pieces(angle, np.linspace(-1.0, 1.0, 6))
    turned = normals + math.pi * (np.arange(6) % 2)
    assert axial_difference(fit(positions, normals).angle, fit(positions, turned).angle) < 1e-9


@given(st.floats(0.0, 2.0), st.integers(1, 5))
def test_uncertainty_shrinks_with_evidence(half_length, repeats):
    positions, normals = pieces(0.7, [-half_length, half_length])
    few = fit(positions, normals)
    many = fit(np.repeat(positions, 4 * repeats, axis=0), np.repeat(normals, 4 * repeats))
    assert many.position_sigma == pytest.approx(few.position_sigma / (2.0 * math.sqrt(repeats)))
    assert many.angle_sigma == pytest.approx(few.angle_sigma / (2.0 * math.sqrt(repeats)))


def test_a_longer_wall_has_a_surer_direction():
    short, long = (fit(*pieces(0.7, [-half, half])) for half in (0.5, 2.0))
    assert long.angle_sigma < 0.6 * short.angle_sigma


def test_a_single_piece_is_a_line_along_its_surface():
    line = fit(*pieces(0.3, [0.0]), 0.05, 0.1)
    assert line.foot == pytest.approx([1.0, 2.0])
    assert axial_difference(line.angle, 0.3) < 1e-9
    assert (line.position_sigma, line.angle_sigma) == (pytest.approx(0.05), pytest.approx(0.1))


@given(st.floats(-10.0, 10.0), st.floats(-10.0, 10.0))
def test_the_axial_difference_is_symmetric_and_at_most_a_right_angle(a, b):
    difference = float(axial_difference(a, b))
    assert 0.0 <= difference <= 0.5 * math.pi
    assert difference == pytest.approx(float(axial_difference(b, a)), abs=1e-9)
    assert difference == pytest.approx(float(axial_difference(a + math.pi, b)), abs=1e-9)
    assert difference == pytest.approx(abs(math.asin(math.sin(a - b))), abs=1e-6)


def test_members_are_near_and_turned_as_the_line():
    line = Line(np.zeros(2), 0.0, 0.01, 0.01)
    up = 0.5 * math.pi
    positions = np.array([[3.0, 0.05], [3.0, 0.2], [3.0, -0.05], [3.0, 0.0]])
    normals = np.array([up, up, -up, up + 0.3])
    assert members(line, positions, normals, 0.1, 0.2).tolist() == [True, False, True, False]


def test_a_line_measures_along_and_across_from_its_foot():
    line = Line(np.array([1.0, 1.0]), 0.5 * math.pi, 0.01, 0.01)
    points = np.array([[1.0, 4.0], [-1.0, 1.0]])
    assert line.along(points) == pytest.approx([3.0, 0.0])
    assert line.gap(points) == pytest.approx([0.0, 2.0])


def witnessed(seed, witnesses, each, shared, own=0.005):
    """Pieces of a wall of 6 m seen from `witnesses` places, whose errors they share, and what is stated."""
    random = np.random.default_rng(seed)
    nodes = np.repeat(10 * np.arange(witnesses), each) + random.integers(0, 10, witnesses * each)
    along = np.repeat(random.uniform(-2.5, 2.5, witnesses), each) + random.uniform(-0.5, 0.5, len(nodes))
    across = np.repeat(random.normal(0.0, shared, witnesses), each) + random.normal(0.0, own, len(nodes))
    turned = np.repeat(random.normal(0.0, 2.0 * shared, witnesses), each) + random.normal(
        0.0, own, len(nodes)
    )
    positions, normals = pieces(0.3, along, across, turned)
    sigma = np.full(len(nodes), own)
    return positions, normals, sigma, sigma, nodes


@pytest.mark.parametrize(("shared", "each"), [(0.0, 1), (0.02, 20), (0.1, 5)])
def test_what_a_witness_sees_counts_once(shared, each):
    deviations, too_sure = [], []
    for seed in range(300):
        seen = witnessed(seed, 12, each, shared)
        plain = fit_line(*seen[:4])
        line = with_scatter(plain, *seen)
        assert (line.angle, line.foot.tolist()) == (plain.angle, plain.foot.tolist())
        error = (line.angle - 0.3 + 0.5 * math.pi) % math.pi - 0.5 * math.pi
        across = float(Line(np.array([1.0, 2.0]), 0.3, 0.0, 0.0).gap(line.foot[None])[0])
        deviations.append((across / line.position_sigma, error / line.angle_sigma))
        too_sure.append((across / plain.position_sigma, error / plain.angle_sigma))
    spread = np.sqrt(np.mean(np.square(deviations), axis=0))
    assert ((spread > 0.75) & (spread < 1.35)).all()
    if shared:
        assert (np.sqrt(np.mean(np.square(too_sure), axis=0)) > 4.0).all()


@given(st.integers(0, 10**6), st.integers(1, 6), st.integers(1, 5))
def test_scatter_is_never_below_that_of_independent_witnesses(seed, witnesses, each):
    seen = witnessed(seed, witnesses, each, 0.0)
    plain = fit_line(*seen[:4])
    line = with_scatter(plain, *seen)
    independent = 0.999 * math.sqrt(each)  # the line is turned a little from the first direction
    assert line.position_sigma >= independent * plain.position_sigma
    assert line.angle_sigma >= independent * plain.angle_sigma
