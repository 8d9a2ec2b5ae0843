"""Glass walls, in tiny worlds with one truth each."""

import math

import numpy as np
import pytest
from glass_worlds import CONFIG, World, answer, drive, opaque, pane, pass_through, spans

from glassslam.config import GlassWallConfig
from glassslam.geometry import compose, transform_points
from glassslam.glass.lines import axial_difference
from glassslam.glass.observations import GlassObservations
from glassslam.glass.stretches import STEP
from glassslam.glass.walls import BeamEvidence, Beams, fit_walls

UP = 0.5 * math.pi


def assert_spans(walls, *expected, slack=0.11):
    found = spans(walls)
    assert len(found) == len(expected), found
    for span, truth in zip(found, expected, strict=True):
        assert span == pytest.approx(truth, abs=slack)


def test_a_pane_seen_obliquely_with_few_answers_is_one_wall_between_its_outermost_answers():
    world = pane(0.0, 6.0, at=(0.2, 2.0, 3.5, 5.8))
    (wall,) = walls = world.walls()
    assert_spans(walls, (0.2, 5.8))
    assert wall.start[1] == pytest.approx(1.5, abs=0.02)
    assert wall.end[1] == pytest.approx(1.5, abs=0.02)
    assert (wall.observations, wall.nodes) == (4, 4)
    assert wall.probability > 0.99
    assert wall.length == pytest.approx(5.7, abs=0.2)
    # each answer proves itself and, by its extent, part of a neighbouring piece
    assert 4 * STEP <= wall.observed_length <= 8 * STEP + 1e-9
    assert 0.0 < wall.position_sigma < 0.02
    assert 0.0 < wall.angle_sigma < 0.02


def test_a_wall_goes_on_to_the_frame_that_holds_it():
    world = pane(0.0, 6.0, at=(0.4, 2.0, 3.5, 5.6))
    opaque(world, 1.5, -1.0, 0.0)
    opaque(world, 1.5, 6.0, 7.0)
    assert_spans(world.walls(), (0.0, 6.0))


def test_a_wall_does_not_reach_for_a_distant_frame():
    world = pane(0.0, 6.0, at=(1.5, 2.5, 3.5, 4.5))
    opaque(world, 1.5, -1.0, 0.0)
    opaque(world, 1.5, 6.0, 7.0)
    assert_spans(world.walls(), (1.5, 4.5))


def test_a_wall_ends_at_the_post_that_touches_its_last_observation():
    world = pane(0.0, 6.0, at=(0.12, 2.0, 3.5, 5.88))
    opaque(world, 1.5, -1.0, 0.0)
    opaque(world, 1.5, 6.0, 7.0)
    ((_, high),) = spans(world.walls())
    assert high == pytest.approx(6.0, abs=0.05)


def test_a_wall_does_not_go_on_where_no_beam_passed():
    world = World(drive(-2.0, 8.0))
    pass_through(world, 1.5, 0.4, 5.6)
    answer(world, 1.5, (0.5, 2.0, 3.5, 5.5))
    opaque(world, 1.5, -1.0, 0.0)
    opaque(world, 1.5, 6.0, 7.0)
    assert_spans(world.walls(), (0.5, 5.5))


def test_a_wall_inside_a_row_does_not_reach_for_a_distant_frame_either():
    world = World(drive(-2.0, 9.0))
    for low, high in ((0.0, 3.0), (4.0, 7.0)):
        pass_through(world, 1.5, low, high)
    answer(world, 1.5, (0.2, 1.0, 2.0, 5.0, 6.0, 6.8))
    opaque(world, 1.5, 3.0, 4.0)
    assert_spans(world.walls(), (0.2, 2.0), (5.0, 6.8))


def test_mullions_are_bridged():
    world = World(drive(-2.0, 8.0))
    for low, high in ((0.0, 1.95), (2.05, 3.95), (4.05, 6.0)):
        pass_through(world, 1.5, low, high)
    answer(world, 1.5, (0.2, 1.0, 3.0, 5.0, 5.8))
    opaque(world, 1.5, 1.95, 2.05)
    opaque(world, 1.5, 3.95, 4.05)
    assert_spans(world.walls(), (0.2, 5.8))


def test_an_opaque_wall_between_two_panes_is_no_glass():
    world = World(drive(-2.0, 8.0))
    for low, high in ((0.0, 2.4), (3.6, 6.0)):
        pass_through(world, 1.5, low, high)
    answer(world, 1.5, (0.2, 1.0, 2.2, 3.8, 5.0, 5.8))
    opaque(world, 1.5, 2.4, 3.6)
    assert_spans(world.walls(), (0.2, 2.4), (3.6, 5.8))


def door(rays_per_node):
    """Glass that answers whenever it is met at normal incidence, and an opening from 2.5 to 3.5."""
    world = pane(0.0, 6.0, at=np.repeat((0.0, 0.5, 1.0, 1.5, 2.0, 2.4, 3.6, 4.0, 4.5, 5.0, 5.5, 6.0), 2))
    for node, (x, _, _) in enumerate(world.poses):
        if 2.4 < x < 3.6:
            world.look(node, *[(x, 4.0)] * rays_per_node)
    return world


def test_an_opening_in_glass_that_always_answers_stays_open():
    assert_spans(door(10).walls(), (0.0, 2.4), (3.6, 6.0))


def test_a_few_beams_through_are_no_opening():
    assert_spans(door(1).walls(), (0.0, 6.0))


def test_glass_that_seldom_answers_is_not_opened_by_its_silence():
    world = door(10)
    for node, (x, _, _) in enumerate(world.poses):
        if 2.4 < x < 3.6:
            world.look(node, *[(x, 4.0)] * 50)
        else:
            world.look(node, *[(x, 4.0)] * 12)
    assert_spans(world.walls(), (0.0, 6.0))


def test_a_gap_through_which_nobody_looked_is_not_bridged():
    world = World(drive(-2.0, 10.0))
    answer(world, 1.5, (0.0, 0.1, 0.2, 0.3, 3.0, 3.1, 3.2, 3.3))
    assert_spans(world.walls(config=GlassWallConfig(min_nodes=1)), (0.0, 0.3), (3.0, 3.3))


@pytest.mark.parametrize("seed", range(10))
def test_noise_with_random_normals_is_no_wall(seed):
    random = np.random.default_rng(seed)
    world = World(drive(0.0, 10.0))
    for node in random.integers(0, len(world.poses), 80):
        point = (random.uniform(0.0, 10.0), random.uniform(-4.0, 4.0))
        world.see(int(node), point, random.uniform(-math.pi, math.pi), probability=0.6)
    assert world.walls() == []


def test_a_few_that_fit_a_line_among_many_that_do_not_are_no_wall():
    """With random normals some fit any line; a wall needs more than that."""
    world = pane(0.0, 6.0, at=(0.2, 2.0, 3.5, 5.8))
    for k, x in enumerate(np.arange(0.3, 5.7, 0.1)):
        world.see(k % len(world.poses), (x, 1.5), UP + 0.4 + 0.5 * (k % 5))
    assert world.walls() == []
    assert_spans(world.walls(config=GlassWallConfig(min_nodes=2, min_excess=0.5)), (0.2, 5.8))


def test_what_lies_on_a_wall_makes_no_second_one():
    world = pane(0.0, 6.0, at=(0.2, 1.0, 2.0, 3.0, 4.0, 5.0, 5.8))
    for node, x in ((7, 2.25), (8, 2.35), (9, 2.45)):
        world.see(node, (x, 1.5), UP + 0.2)
    (wall,) = world.walls()
    assert wall.length > 5.0


def test_two_parallel_panes_a_metre_apart_stay_two():
    world = pane(0.0, 6.0, at=(0.2, 2.0, 3.5, 5.8))
    pass_through(world, 2.5, 0.0, 6.0)
    answer(world, 2.5, (0.2, 2.0, 3.5, 5.8))
    walls = world.walls()
    assert_spans(walls, (0.2, 5.8), (0.2, 5.8))
    assert sorted(float(wall.start[1]) for wall in walls) == pytest.approx([1.5, 2.5], abs=0.02)


def test_panes_on_both_sides_of_a_corridor_are_two_walls():
    world = pane(0.0, 6.0, at=(0.2, 2.0, 3.5, 5.8))
    pass_through(world, -1.5, 0.0, 6.0)
    answer(world, -1.5, (0.2, 2.0, 3.5, 5.8))
    assert sorted(float(wall.start[1]) for wall in world.walls()) == pytest.approx([-1.5, 1.5], abs=0.02)


def test_a_corner_gives_two_walls():
    world = World([*drive(0.0, 4.5), *[(4.5, -0.5 * k, -UP) for k in range(1, 9)]])
    for node, (x, y, _) in enumerate(world.poses):
        if y == 0.0:
            world.see(node, (x, 1.5), UP)
            world.look(node, *[(x + dx, 3.0) for dx in np.linspace(-6.0, 1.0, 60)])
        if x == 4.5:
            world.see(node, (6.0, y), 0.0)
            world.look(node, *[(7.5, y + dy) for dy in np.linspace(-6.0, 1.0, 60)])
    walls = world.walls()
    headings = sorted(
        math.degrees(float(axial_difference(np.arctan2(*(w.end - w.start)[::-1]), 0.0))) for w in walls
    )
    assert headings == pytest.approx([0.0, 90.0], abs=1.0)
    assert sum(wall.length for wall in walls) == pytest.approx(4.5 + 4.0, abs=0.5)


def test_a_bent_map_gives_straight_parts_that_join():
    slope = math.tan(math.radians(4.0))
    world = World(drive(-11.0, 11.0))
    for node, (x, _, _) in enumerate(world.poses):
        y = 1.5 + slope * max(x, 0.0)
        world.see(node, (x, y), UP + (math.radians(4.0) if x > 0 else 0.0))
        world.look(node, *[(x + dx, y + 2.0) for dx in np.linspace(-3.0, 3.0, 120)])
    walls = sorted(world.walls(), key=lambda wall: min(wall.start[0], wall.end[0]))
    assert_spans(walls, (-11.0, 0.0), (0.0, 11.0), slack=1.3)
    # no gap between them along the wall, and none across
    left = max(walls[0].start, walls[0].end, key=lambda p: p[0])
    right = min(walls[1].start, walls[1].end, key=lambda p: p[0])
    assert left[0] >= right[0] - STEP
    assert abs(left[1] - right[1]) < 0.1


@pytest.mark.parametrize("turn", [0.0, 0.7, 2.0, math.pi])
def test_walls_move_with_the_nodes(turn):
    world = pane(0.0, 6.0, at=(0.2, 2.0, 3.5, 5.8))
    (before,) = world.walls()
    motion = np.array([3.0, -2.0, turn])
    (after,) = world.walls(poses=compose(motion[None], world.poses))
    ends = transform_points(motion, np.array([before.start, before.end]))
    found = np.array([after.start, after.end])
    straight, swapped = (np.hypot(*(found - side).T).max() for side in (ends, ends[::-1]))
    # the pieces of the line begin elsewhere, so that the ends may differ by one
    assert min(straight, swapped) < 1.5 * STEP
    assert after.observations == before.observations
    assert after.length == pytest.approx(before.length, abs=1.5 * STEP)


def test_observations_that_a_wrong_pose_tears_apart_join_when_it_is_put_right():
    world = pane(0.0, 6.0, at=(0.2, 2.0, 3.5, 5.8))
    wrong = world.poses.copy()
    wrong[len(wrong) // 2 :, 1] += 1.0
    assert world.walls(poses=wrong) == []
    assert_spans(world.walls(), (0.2, 5.8))


def test_strays_off_the_wall_do_not_bend_it():
    world = pane(0.0, 6.0, at=(0.2, 1.0, 2.0, 2.7, 3.5, 4.5, 5.8))
    world.see(4, (3.0, 1.75), UP)
    world.see(8, (4.0, 1.5), UP + 0.5)
    (wall,) = world.walls()
    assert wall.observations == 7
    assert max(abs(wall.start[1] - 1.5), abs(wall.end[1] - 1.5)) < 0.02


def test_two_observations_are_no_wall():
    assert pane(0.0, 2.0, at=(0.5, 1.5)).walls() == []


def test_observations_of_one_node_are_no_wall():
    world = pane(0.0, 6.0, nodes=drive(-2.0, 8.0))
    for x in (2.6, 3.0, 3.4, 3.8):
        world.see(10, (x, 1.5), UP, probability=0.97)
    assert world.walls() == []


def test_weak_observations_are_no_wall():
    world = pane(0.0, 6.0)
    for node, x in enumerate((0.5, 2.0, 3.5)):
        world.see(node, (x, 1.5), UP, probability=0.55)
    assert world.walls() == []
    weak = GlassWallConfig(min_nodes=2, min_probability=0.5)
    assert len(world.walls(config=weak)) == 1


def test_without_observations_there_is_no_wall():
    nothing = Beams.pack([np.zeros(2)], [np.empty((0, 2), np.float32)])
    evidence = BeamEvidence(nothing, nothing)
    assert fit_walls(GlassObservations.empty(), np.zeros((1, 3)), evidence, CONFIG) == []


def test_beams_are_packed_by_node():
    ends = [np.ones((2, 2), np.float32), np.empty((0, 2), np.float32), np.full((1, 2), 3, np.float32)]
    packed = Beams.pack([np.zeros(2)] * 3, ends)
    assert packed.first.tolist() == [0, 2, 2, 3]
    assert packed.sensors.shape == (3, 2)
    assert packed.ends[packed.first[2] :].tolist() == [[3.0, 3.0]]
    empty = Beams.pack([], [])
    assert (empty.sensors.shape, empty.ends.shape, empty.first.tolist()) == ((0, 2), (0, 2), [0])


def test_posts_that_the_lidar_takes_for_anything_but_glass_do_not_speak_against_what_sonars_hear():
    """Narrow returns from the posts between panes; sonars hear the panes."""
    sonar = 1
    world = pane(0.0, 6.0, at=())
    for k, x in enumerate(np.repeat(np.arange(0.2, 6.0, 1.0), 8)):
        world.see(k % len(world.poses), (x, 1.5), UP, probability=0.2)
    assert world.walls() == []
    for node, x in enumerate((0.5, 1.5, 2.5, 3.5, 4.5, 5.5)):
        world.see(node, (x, 1.5), UP, probability=0.9, extent=0.3, kind=sonar)
    (wall,) = world.walls()
    assert wall.by_sonar == 6
    assert wall.length > 5.0
