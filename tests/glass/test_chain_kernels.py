"""Joining pieces, against the same rule written with sparse graphs."""

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from glassslam.glass.chain_kernels import join_pieces
from glassslam.glass.lines import axial_difference

GAP, DISTANCE, TOUCHING, SLACK = 4.0, 0.12, 0.2, math.radians(4.0)


def joined(centres, normals):
    parents = np.empty(len(centres), dtype=np.int64)
    join_pieces(centres, normals, GAP, DISTANCE, TOUCHING, SLACK, parents)
    return parents


def naive(centres, normals):
    """The least piece of every piece's chain."""
    i, j = np.triu_indices(len(centres), 1)
    step = centres[j] - centres[i]
    length = np.hypot(step[:, 0], step[:, 1])
    heading = np.arctan2(step[:, 1], step[:, 0])
    allowed = np.where(length < TOUCHING, np.pi, SLACK + np.arctan2(DISTANCE, length))
    fits = (length <= GAP) & (axial_difference(normals[i], normals[j]) < 2.0 * SLACK)
    for end in (i, j):
        fits &= axial_difference(normals[end] + 0.5 * np.pi, heading) < allowed
    links = coo_array((np.ones(fits.sum()), (i[fits], j[fits])), shape=(len(centres),) * 2)
    _, component = connected_components(links, directed=False)
    least = np.array([np.flatnonzero(component == c)[0] for c in range(component.max() + 1)])
    return least[component]


@given(st.integers(0, 10**6), st.integers(1, 60), st.booleans())
def test_it_joins_as_its_naive_twin(seed, count, is_wall):
    random = np.random.default_rng(seed)
    centres = random.uniform(-6.0, 6.0, (count, 2)) * ((1.0, 0.02) if is_wall else (1.0, 1.0))
    normals = random.normal(0.5 * np.pi, 0.08, count) if is_wall else random.uniform(-4.0, 4.0, count)
    assert joined(centres, normals).tolist() == naive(centres, normals).tolist()


def test_a_chain_goes_on_from_piece_to_piece():
    centres = np.array([[0.0, 0.0], [9.0, 0.0], [3.0, 0.0], [6.0, 0.0]])
    assert joined(centres, np.full(4, 0.5 * np.pi)).tolist() == [0, 0, 0, 0]


def test_parallel_walls_stay_apart():
    centres = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
    assert joined(centres, np.full(4, 0.5 * np.pi)).tolist() == [0, 0, 2, 2]
