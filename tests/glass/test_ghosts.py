"""Returns from behind glass walls."""

import numpy as np
import pytest
from glass_worlds import World
from hypothesis import given
from hypothesis import strategies as st

from glassslam.geometry import transform_points
from glassslam.glass import ghost_kernels as kernels
from glassslam.glass.beams import Beams
from glassslam.glass.ghosts import (
    DIRECT,
    MIRRORED,
    SEEN_THROUGH,
    Ghosts,
    crossings,
    find_ghosts,
    ghost_cells,
    mirror_odds,
    mirror_probability,
)
from glassslam.glass.walls import GlassWall

TOLERANCE = 0.12


def wall(start, end):
    return GlassWall(np.array(start, float), np.array(end, float), 10, 5, 0.99, 0.01, 0.01, 1.0)


ABOVE = wall((0, 2), (4, 2))
BOTH = np.array([[0.0, 2.0, 4.0, 2.0], [0.0, 3.0, 4.0, 3.0]])


def ghosts(world, walls=(ABOVE,)):
    return find_ghosts(walls, world.poses, world.beams, TOLERANCE)


def looking(*ends, silent=(), pose=(2.0, 0.0, 0.0)):
    """One node below the wall, whose beams end at places of the map."""
    world = World([pose])
    world.hit(0, *ends)
    world.look(0, *silent)
    return world


def random_beams(seed):
    random = np.random.default_rng(seed)
    lengths = random.integers(0, 9, 4)
    poses = random.uniform(-2.0, 2.0, (4, 3))
    ends = [random.uniform(-4.0, 4.0, (n, 2)).astype(np.float32) for n in lengths]
    return poses, Beams.pack(list(random.uniform(-0.3, 0.3, (4, 2))), ends), random


def placed(poses, beams):
    """Sensor and end of every beam in the map frame, one after the other."""
    for n, pose in enumerate(poses):
        sensor = transform_points(pose, beams.sensors[n : n + 1])[0]
        for end in beams.ends[beams.first[n] : beams.first[n + 1]].astype(np.float64):
            yield sensor, transform_points(pose, end[None])[0]


def naive_crossing(sensor, end, segments, tolerance):
    """First of the segments between sensor and end that the end is not near; share up to it; cosine there."""
    best, first, cosine = 1.0, -1, 0.0
    for number, (x0, y0, x1, y1) in enumerate(segments):
        start, along = np.array([x0, y0]), np.array([x1 - x0, y1 - y0])
        matrix = np.column_stack((end - sensor, -along))
        if abs(np.linalg.det(matrix)) < 1e-12:
            continue
        share, place = np.linalg.solve(matrix, start - sensor)
        normal = np.array([-along[1], along[0]]) / np.hypot(*along)
        if 0.0 < share < best and 0.0 <= place <= 1.0 and abs((end - start) @ normal) > tolerance:
            best, first = share, number
            cosine = abs((end - sensor) @ normal) / np.hypot(*(end - sensor))
    return first, best, cosine


@given(st.integers(0, 10**6), st.sampled_from([0.0, 0.12, 0.5]))
def test_crossings_are_those_of_their_naive_twin(seed, tolerance):
    poses, beams, random = random_beams(seed)
    segments = random.uniform(-3.0, 3.0, (5, 4))
    found, share, cosines = crossings(segments, poses, beams, tolerance)
    expected = [naive_crossing(*beam, segments, tolerance) for beam in placed(poses, beams)]
    assert found.tolist() == [first for first, _, _ in expected]
    assert share == pytest.approx([best for _, best, _ in expected], abs=1e-5)
    assert cosines == pytest.approx([cosine for _, _, cosine in expected], abs=1e-5)


@given(st.tuples(*[st.floats(-5, 5)] * 6))
def test_the_distance_of_a_segment_is_that_of_its_nearest_point(numbers):
    x, y, *ends = numbers
    share = np.linspace(0.0, 1.0, 4001)
    naive = np.hypot(ends[0] + share * (ends[2] - ends[0]) - x, ends[1] + share * (ends[3] - ends[1]) - y)
    assert kernels.distance_to_segment(x, y, np.array(ends)) == pytest.approx(naive.min(), abs=0.004)


def naive_evidence(poses, beams, found, segments, corner, cell, direct, real, few):
    def is_known(point, counts):
        column, row = (int(v) for v in np.floor((point - corner) / cell))
        beside = counts[max(row - 1, 0) : max(row + 2, 0), max(column - 1, 0) : max(column + 2, 0)]
        return bool((beside >= few).any())

    for k, (_, end) in enumerate(placed(poses, beams)):
        if found[k] < 0:
            yield 0
            continue
        start, stop = segments[found[k], :2], segments[found[k], 2:]
        normal = np.array([start[1] - stop[1], stop[0] - start[0]]) / np.hypot(*(stop - start))
        image = end - 2.0 * ((end - start) @ normal) * normal
        yield is_known(image, direct) + 2 * is_known(end, real)


@given(st.integers(0, 10**6))
def test_evidence_of_mirrors_is_that_of_its_naive_twin(seed):
    poses, beams, random = random_beams(seed)
    segments = random.uniform(-3.0, 3.0, (3, 4))
    found, _, _ = crossings(segments, poses, beams, 0.0)
    corner, cell = np.array([-6.03, -6.02]), 0.31
    direct, real = random.integers(0, 4, (2, 39, 40)).astype(np.uint8)
    known = np.zeros(len(found), np.uint8)
    kernels.mirror_evidence(
        poses, beams.ends, beams.first, found, segments, corner, cell, direct, real, 3, known
    )
    expected = naive_evidence(poses, beams, found, segments, corner, cell, direct, real, 3)
    assert known.tolist() == list(expected)


def cells_of(poses, beams, corner, cell, shape):
    """Row and column of every end, None outside the grid."""
    for _, end in placed(poses, beams):
        column, row = (int(v) for v in np.floor((end - corner) / cell))
        yield (row, column) if 0 <= row < shape[0] and 0 <= column < shape[1] else None


@given(st.integers(0, 10**6))
def test_counts_and_marks_are_those_of_their_naive_twins(seed):
    poses, beams, random = random_beams(seed)
    corner, cell, shape = np.array([-2.5, -2.5]), 0.97, (5, 6)
    labels = random.integers(0, 3, len(beams.ends)).astype(np.uint8)
    counts, direct, behind = np.zeros(shape, np.uint8), np.zeros(shape, bool), np.zeros(shape, np.uint8)
    kernels.count_ends(poses, beams.ends, beams.first, labels == 0, corner, cell, counts)
    kernels.mark_ends(poses, beams.ends, beams.first, labels, corner, cell, direct, behind)
    expected, others = np.zeros(shape, np.uint8), np.zeros(shape, np.uint8)
    for k, place in enumerate(cells_of(poses, beams, corner, cell, shape)):
        if place is not None:
            (others if labels[k] else expected)[place] += 1
    assert counts.tolist() == expected.tolist()
    assert direct.tolist() == (expected > 0).tolist()
    assert behind.tolist() == others.tolist()


def test_counts_stop_where_they_are_full():
    ends = np.full((300, 2), 0.5, np.float32)
    counts, behind = np.zeros((1, 1), np.uint8), np.zeros((1, 1), np.uint8)
    first, corner = np.array([0, 300]), np.zeros(2)
    kernels.count_ends(np.zeros((1, 3)), ends, first, np.ones(300, bool), corner, 1.0, counts)
    direct = np.zeros((1, 1), bool)
    kernels.mark_ends(np.zeros((1, 3)), ends, first, np.ones(300, np.uint8), corner, 1.0, direct, behind)
    assert (counts[0, 0], behind[0, 0], direct[0, 0]) == (255, 255, False)


def test_what_stands_behind_a_wall_is_seen_through_it():
    assert ghosts(looking((2.5, 4.0))).labels.tolist() == [SEEN_THROUGH]


@pytest.mark.parametrize("end", [(2.5, 1.0), (2.5, 1.95), (2.5, 2.1), (9.0, 3.0), (2.0, -3.0)])
def test_what_stands_before_on_or_beside_a_wall_is_direct(end):
    found = ghosts(looking(end))
    assert (found.labels.tolist(), found.share.tolist(), found.mirrored.tolist()) == ([DIRECT], [1.0], [0.0])


def test_the_share_tells_where_the_wall_is():
    found = ghosts(looking((2.0, 4.0), silent=[(2.0, 5.0), (2.0, 1.0)]))
    assert found.share.tolist() == [pytest.approx(0.5)]
    assert found.silent_share.tolist() == [pytest.approx(0.4), 1.0]


def test_the_first_of_two_walls_counts():
    world = looking((2.0, 6.0))
    found, share, _ = crossings(BOTH[::-1].copy(), world.poses, world.beams.returns, TOLERANCE)
    assert (found.tolist(), share.tolist()) == ([1], [pytest.approx(1 / 3)])


def test_the_poses_decide():
    """The same beams, with the node on the other side of the wall."""
    world = looking((2.5, 4.0))
    moved = np.array([[2.0, 5.0, 0.0]])
    assert find_ghosts([ABOVE], moved, world.beams, TOLERANCE).labels.tolist() == [DIRECT]


def test_without_walls_or_beams_nothing_is_a_ghost():
    assert ghosts(looking((2.5, 4.0)), walls=()).labels.tolist() == [DIRECT]
    assert ghosts(looking()).labels.tolist() == []


def hallway(*, known=True, behind=False):
    """A node that meets the wall at a glancing angle, with a post whose image stands behind it at (6, 2.4).

    The wall runs along y = 2; seen from (0, 1.6), the image is met at 82 degrees. `known` says whether other
    beams have met the post itself at (6, 1.6), `behind` whether some have met a surface at its image.
    """
    world = World([(0.0, 1.6, 0.0), (7.0, 1.6, 0.0), (8.0, 4.0, 0.0)])
    world.hit(0, (6.0, 2.4))
    if known:
        world.hit(1, *[(6.0, 1.6)] * 5)
    if behind:
        world.hit(2, *[(6.0, 2.4)] * 5)
    return ghosts(world, walls=(wall((0, 2), (7, 2)),))


def test_an_image_folded_back_onto_a_known_surface_is_mirrored():
    found = hallway()
    assert found.labels[0] == MIRRORED
    assert found.mirrored[0] > 0.7
    assert found.labels[1:].tolist() == [DIRECT] * 5


def test_where_nothing_is_known_to_be_mirrored_it_is_seen_through():
    assert hallway(known=False).labels.tolist() == [SEEN_THROUGH]
    assert hallway(known=False).mirrored[0] < 0.05


def test_a_surface_that_was_met_from_behind_is_less_likely_an_image():
    assert hallway(behind=True).mirrored[0] < hallway().mirrored[0]


def test_what_is_seen_through_the_pane_at_other_angles_as_well_is_there():
    """Five beams meet the place of the image through the pane, far from a glancing angle."""
    world = World([(0.0, 1.6, 0.0), (7.0, 1.6, 0.0), (6.0, 0.5, 0.0)])
    world.hit(0, (6.0, 2.4))
    world.hit(1, *[(6.0, 1.6)] * 5)
    world.hit(2, *[(6.0, 2.4)] * 5)
    found = ghosts(world, walls=(wall((0, 2), (7, 2)),))
    assert found.labels.tolist() == [SEEN_THROUGH] + [DIRECT] * 5 + [SEEN_THROUGH] * 5


def test_panes_mirror_at_glancing_angles():
    angles = np.radians([0, 30, 60, 70, 80, 88]).astype(np.float32)
    odds = mirror_odds(np.cos(angles), np.full(6, 1, np.uint8))
    assert (np.diff(odds) > 0).all()
    assert odds[0] < 0.05
    assert odds[-1] > 5.0


def test_odds_are_finite_however_flat_the_beam():
    assert np.isfinite(mirror_odds(np.zeros(4, np.float32), np.arange(4, dtype=np.uint8))).all()


def test_a_map_of_any_size_is_searched_in_bounded_memory():
    """Two nodes 100 km apart: the cells become coarser, and the answer comes all the same."""
    world = World([(2.0, 0.0, 0.0), (1e5, 1e5, 0.0)])
    world.hit(0, (2.5, 4.0))
    beams = world.beams.returns
    segments = np.array([[0.0, 2.0, 4.0, 2.0]])
    found, _, cosines = crossings(segments, world.poses, beams, TOLERANCE)
    assert 0.0 < mirror_probability(segments, world.poses, beams, found, cosines)[0] < 1.0


def labelled(*labels):
    out = np.array(labels, np.uint8)
    none = np.zeros(len(out), np.float32)
    return Ghosts(out, none, none, none[:0])


def test_a_map_hides_what_it_does_not_keep():
    found = labelled(DIRECT, SEEN_THROUGH, MIRRORED)
    assert found.hidden("all").tolist() == [False, False, False]
    assert found.hidden("seen_through").tolist() == [False, False, True]
    assert found.hidden("none").tolist() == [False, True, True]
    assert [found.count(label) for label in (DIRECT, SEEN_THROUGH, MIRRORED)] == [1, 1, 1]


def test_cells_belong_to_ghosts_where_two_of_them_and_nothing_else_end():
    world = World([(0.0, 0.0, 0.0)])
    world.hit(0, (0.5, 0.5), (0.6, 0.5), (1.5, 0.5), (2.5, 0.5), (2.6, 0.5), (2.7, 0.5))
    labels = np.array([SEEN_THROUGH, MIRRORED, MIRRORED, SEEN_THROUGH, SEEN_THROUGH, DIRECT], np.uint8)
    cells = ghost_cells(labels, world.poses, world.beams.returns, (1, 3), (0.0, 0.0), 1.0)
    assert cells.tolist() == [[True, False, False]]
