"""Glass that was there and is gone: only silence at normal incidence, later and as near, takes it away."""

import math

import numpy as np
from glass_worlds import World, answer, drive, opaque, pane, pass_through, spans
from hypothesis import given
from hypothesis import strategies as st

from glassslam.geometry import transform_points
from glassslam.glass.evidence_kernels import count_silent_nodes

STEP, BEYOND, LIMIT = 0.1, 0.25, math.radians(4.0)


def naive(poses, sensors, points, first, foot, direction, start, bins, reach, last, known):
    """What the kernel counts, with sets of (node, piece)."""
    across = np.array([-direction[1], direction[0]])
    silent = set()
    for n, pose in enumerate(poses):
        sensor = transform_points(pose, sensors[n : n + 1])[0] - foot
        place = sensor @ direction
        if abs(sensor @ across) > reach or not start - reach <= place < start + bins * STEP + reach:
            continue
        for local in points[first[n] : first[n + 1]].astype(np.float64):
            end = transform_points(pose, local[None])[0] - foot
            if (end @ across) * (sensor @ across) >= 0 or abs(end @ across) < BEYOND:
                continue
            beam = end - sensor
            if math.atan2(abs(beam @ direction), abs(beam @ across)) >= LIMIT:
                continue
            share = (sensor @ across) / (sensor @ across - end @ across)
            piece = math.floor(((sensor + share * beam) @ direction - start) / STEP)
            if 0 <= piece < bins and not known[n, piece]:
                silent.add((n, piece))
    before, after = np.zeros(bins, dtype=np.int64), np.zeros(bins, dtype=np.int64)
    for n, piece in silent:
        (after if n > last[piece] else before)[piece] += 1
    return before, after


@given(st.integers(0, 10**6), st.floats(-math.pi, math.pi))
def test_it_counts_as_its_naive_twin(seed, angle):
    random = np.random.default_rng(seed)
    nodes, bins = 6, 30
    lengths = random.integers(0, 40, nodes)
    first = np.concatenate(([0], np.cumsum(lengths)))
    poses, sensors = random.uniform(-2.0, 2.0, (nodes, 3)), random.uniform(-0.3, 0.3, (nodes, 2))
    points = random.uniform(-4.0, 4.0, (int(lengths.sum()), 2)).astype(np.float32)
    line = (random.uniform(-1.0, 1.0, 2), np.array([math.cos(angle), math.sin(angle)]))
    last, known = random.integers(-1, nodes, bins), random.integers(0, 2, (nodes, bins)).astype(np.uint8)
    expected = naive(poses, sensors, points, first, *line, -1.5, bins, 1.5, last, known)
    before, after = np.zeros(bins, dtype=np.int64), np.zeros(bins, dtype=np.int64)
    count_silent_nodes(
        poses, sensors, points, first, *line, -1.5, STEP, BEYOND, LIMIT, 1.5, last, known, before, after
    )
    assert (before.tolist(), after.tolist()) == (expected[0].tolist(), expected[1].tolist())


def door(*, answers=6, looks=8, distance=1.5, late=True):
    """A pane of 1 m that answers while the robot stands before it, and then, or before, is gone."""
    stands = [(0.05 * (k % 3), 1.5 - distance, 0.0) for k in range(looks)]
    faces = [(0.05 * (k % 3), 0.0, 0.0) for k in range(answers)]
    world = World([*faces, *stands] if late else [*stands, *faces])
    shut = range(answers) if late else range(looks, looks + answers)
    for node in range(len(world.poses)):
        x, y, _ = world.poses[node]
        if node in shut:
            for offset in (-0.4, -0.2, 0.0, 0.2, 0.4):
                world.see(node, (x + offset, 1.5), 0.5 * math.pi, extent=0.1)
        else:
            world.look(node, *[(x + 1.02 * (t - x), y + 2.0 * (1.5 - y)) for t in np.arange(-0.5, 0.6, 0.01)])
            # straight through, beam by beam: as a lidar that turns a little would look
            world.look(node, *[(x + t, 3.0) for t in np.arange(-0.06, 0.07, 0.01)])
    return world


def covered(walls, x):
    return any(low <= x <= high for low, high in spans(walls))


def test_a_door_that_was_opened_is_no_longer_glass_where_beams_passed():
    assert covered(door(looks=0).walls(), 0.05)
    assert not covered(door().walls(), 0.05)


def test_a_door_that_was_shut_later_is_glass():
    assert covered(door(late=False).walls(), 0.05)


def test_one_silent_look_is_no_proof():
    assert covered(door(looks=1).walls(), 0.05)


def test_silence_from_farther_than_the_answers_proves_nothing():
    assert covered(door(distance=4.0).walls(), 0.05)


def test_oblique_beams_never_withdraw_glass():
    world = pane(0.0, 6.0, at=[0.5, 1.5, 2.5, 3.5, 4.5, 5.5])
    for _ in range(5):
        pass_through(world, 1.5, 0.0, 6.0)
    assert covered(world.walls(), 3.0)


def test_a_stretch_withdrawn_is_not_bridged_from_both_sides():
    nodes = drive(-1.0, 7.0, step=0.25) + drive(2.6, 3.4, step=0.1)
    world = World(nodes)
    pass_through(world, 1.5, 0.0, 6.0)
    answer(world, 1.5, [0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0, 5.5])
    opaque(world, 1.5, -0.3, 0.0)
    opaque(world, 1.5, 6.0, 6.3)
    for node in range(len(nodes) - 9, len(nodes)):
        x = world.poses[node, 0]
        world.look(node, *[(x + t, 3.0) for t in np.arange(-0.1, 0.11, 0.01)])
    walls = world.walls()
    assert not covered(walls, 3.0)
    assert covered(walls, 1.0)
    assert covered(walls, 5.0)


def test_what_sonars_hear_as_well_the_lidar_does_not_take_back():
    world = door()
    for node in range(6):
        world.see(node, (0.05, 1.5), 0.5 * math.pi, extent=0.5, kind=1)
    assert covered(world.walls(), 0.05)
