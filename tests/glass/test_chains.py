"""Chains of pieces that continue each other."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glassslam.glass.chains import chains, merge_pieces, straight_parts
from glassslam.glass.lines import axial_difference

UP = 0.5 * math.pi
GAP, DISTANCE = 4.0, 0.12


def row(xs, y=0.0, normal=UP):
    """Pieces along x."""
    xs = np.asarray(xs, dtype=np.float64)
    return np.column_stack((xs, np.full(len(xs), y))), np.full(len(xs), normal)


def joined(*rows):
    return np.concatenate([r[0] for r in rows]), np.concatenate([r[1] for r in rows])


def chained(positions, normals):
    return {frozenset(chain.tolist()) for chain in chains(positions, normals, GAP, DISTANCE)}


def bent(degrees, length=12.0, step=0.5, curve=0.0):
    """A line along x that turns at the origin."""
    along = np.arange(-length, length + 0.5 * step, step)
    turn = math.radians(degrees)
    x = np.where(along < 0, along, along * math.cos(turn))
    y = np.where(along < 0, 0.0, along * math.sin(turn)) + curve * along**2
    return np.column_stack((x, y))


def test_pieces_of_one_cell_and_direction_become_their_mean():
    positions = np.array([[0.02, 0.02], [0.06, 0.04], [0.02, 0.02], [3.02, 0.02]])
    normals = np.array([UP, UP + 0.02 + math.pi, 0.0, UP])
    centres, axes, group = merge_pieces(positions, normals)
    assert len(centres) == 3
    assert group[0] == group[1]
    assert len({group[0], group[2], group[3]}) == 3
    assert centres[group[0]] == pytest.approx([0.04, 0.03])
    assert axial_difference(axes[group[0]], UP + 0.01) < 1e-9


@given(st.integers(0, 10**6), st.integers(1, 40))
def test_every_piece_is_near_the_mean_of_its_group(seed, count):
    random = np.random.default_rng(seed)
    positions, normals = random.uniform(-1.0, 1.0, (count, 2)), random.uniform(-7.0, 7.0, count)
    centres, axes, group = merge_pieces(positions, normals)
    assert np.hypot(*(positions - centres[group]).T).max() < 0.1 * math.sqrt(2.0)
    assert axial_difference(normals, axes[group]).max() < math.radians(10.0)
    assert sorted(set(group.tolist())) == list(range(len(centres)))


def test_pieces_on_one_line_are_one_chain():
    assert chained(*row([0.0, 1.0, 2.0, 5.0])) == {frozenset({0, 1, 2, 3})}


def test_a_step_longer_than_the_gap_separates():
    assert chained(*row([0.0, 1.0, 5.5])) == {frozenset({0, 1}), frozenset({2})}


def test_pieces_side_by_side_are_no_chain():
    assert chained(*joined(row([0.0]), row([1.0], y=0.6))) == {frozenset({0}), frozenset({1})}


def test_pieces_of_other_directions_are_no_chain():
    assert chained(*joined(row([0.0]), row([1.0], normal=UP + 0.3))) == {frozenset({0}), frozenset({1})}


def test_a_piece_off_the_tangent_of_its_neighbour_is_no_chain_though_the_neighbour_lies_on_its_own():
    """The step runs along the second piece, but 6 deg more than the slack from the first."""
    heading = math.radians(7.5)
    positions = np.array([[0.0, 0.0], [3.0 * math.cos(heading), 3.0 * math.sin(heading)]])
    tangent_of_second = np.array([UP, UP + heading])
    assert chained(positions, tangent_of_second) == {frozenset({0}), frozenset({1})}
    assert chained(positions, np.full(2, UP + heading)) == {frozenset({0, 1})}


def test_pieces_seen_from_both_sides_are_one_chain():
    assert chained(*joined(row([0.0, 2.0]), row([1.0], normal=-UP))) == {frozenset({0, 1, 2})}


def test_parallel_panes_a_metre_apart_are_two_chains():
    both = joined(row(np.arange(0.0, 6.0)), row(np.arange(0.0, 6.0), y=1.0))
    assert chained(*both) == {frozenset(range(6)), frozenset(range(6, 12))}


def test_the_largest_chain_comes_first():
    found = chains(*joined(row([0.0]), row([20.0, 21.0, 22.0]), row([50.0, 51.0])), GAP, DISTANCE)
    assert [len(chain) for chain in found] == [3, 2, 1]


@given(st.integers(0, 10**6))
def test_chains_do_not_depend_on_the_order_of_the_pieces(seed):
    random = np.random.default_rng(seed)
    positions = random.uniform(0.0, 6.0, (30, 2))
    normals = random.choice([0.0, UP, 1.0], 30) + random.normal(0.0, 0.02, 30)
    shuffled = random.permutation(30)
    again = {
        frozenset(shuffled[list(chain)].tolist()) for chain in chained(positions[shuffled], normals[shuffled])
    }
    assert again == chained(positions, normals)


def test_a_straight_chain_is_one_part():
    positions = bent(0.0) + np.random.default_rng(1).normal(0.0, 0.02, (49, 2))
    (part,) = straight_parts(positions, np.arange(49), 0.07)
    assert sorted(part.tolist()) == list(range(49))


def test_a_bent_chain_is_cut_at_its_bend_and_only_there():
    positions = bent(6.0)
    first, second = straight_parts(positions, np.arange(49), 0.07)
    assert first[-1] == second[0]
    assert positions[first[-1]] == pytest.approx([0.0, 0.0], abs=1.0)
    assert len(first) + len(second) == 50


def test_the_parts_of_a_curve_are_joined_and_straight():
    positions = bent(0.0, length=20.0, curve=0.002)
    parts = straight_parts(positions, np.arange(len(positions)), 0.07)
    assert len(parts) > 2
    for before, after in itertools.pairwise(parts):
        assert before[-1] == after[0]
    for part in parts:
        x, y = positions[part].T
        assert np.abs(y - np.polyval(np.polyfit(x, y, 1), x)).max() < 0.1


def test_a_single_stray_does_not_cut_a_chain():
    positions = bent(0.0)
    positions[24, 1] += 0.3
    assert len(straight_parts(positions, np.arange(49), 0.07)) == 1


def test_a_bend_within_a_short_chain_is_left_to_the_fit():
    assert len(straight_parts(bent(10.0, length=3.0), np.arange(13), 0.07)) == 1


@given(st.permutations(range(49)))
def test_parts_do_not_depend_on_the_order_of_the_chain(order):
    positions = bent(6.0)
    parts = straight_parts(positions, np.array(order), 0.07)
    expected = straight_parts(positions, np.arange(49), 0.07)
    assert {frozenset(part.tolist()) for part in parts} == {frozenset(part.tolist()) for part in expected}


def test_parts_name_the_pieces_of_the_whole_run():
    positions = np.vstack((np.full((3, 2), 99.0), bent(0.0)))
    (part,) = straight_parts(positions, np.arange(3, 52), 0.07)
    assert sorted(part.tolist()) == list(range(3, 52))
