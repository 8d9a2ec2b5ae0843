"""Glass that sonars hear and lidar beams pass."""

import math

import numpy as np
import pytest
from sonar_worlds import LEFT, RIGHT, ring, sweeps

from glassslam.config import GlassWallConfig, SonarConfig
from glassslam.geometry import compose, inverse, transform_points, wrap_angle
from glassslam.glass.beams import BeamEvidence, Beams
from glassslam.glass.observations import GlassObservations
from glassslam.glass.walls import fit_walls
from glassslam.sonar.glass import passed_share, reading_noise, sonar_glass_observations

CONFIG = SonarConfig()
WALL_Y = 1.0


class Corridor:
    """A robot drives along x; glass stands at y = 1, and what is behind it lidar beams reach at `behind`."""

    def __init__(self, behind=3.0, length=4.0, noise=0.0, heading=0.0, turn=0.0):
        random = np.random.default_rng(0)
        count = round(length / 0.08) + 1
        self.stamps = 0.3 * np.arange(count)
        truth = np.column_stack((0.08 * np.arange(count), np.zeros(count), np.full(count, heading)))
        self.map_from_world = np.array([0.5, -0.7, turn])
        self.poses = compose(self.map_from_world[None], truth)
        self.nodes = slice(None, None, 3)
        sonars = ring(LEFT, RIGHT)
        left = WALL_Y + random.normal(0.0, noise, count)
        self.sweeps = sweeps(np.column_stack((left, np.full(count, np.inf))), sonars, self.poses, self.stamps)
        across = np.linspace(-3.0, 3.0, 61)
        ends = np.column_stack((across, np.full(61, behind))).astype(np.float64)
        node_truth = truth[self.nodes]
        local = [transform_points(inverse(pose), ends + np.array([pose[0], 0.0])) for pose in node_truth]
        nothing = [np.empty((0, 2), np.float32) for _ in local]
        zero = [np.zeros(2) for _ in local]
        self.beams = BeamEvidence(
            Beams.pack(zero, [points.astype(np.float32) for points in local]), Beams.pack(zero, nothing)
        )

    @property
    def node_poses(self):
        return self.poses[self.nodes]

    def observed(self, config=CONFIG):
        return sonar_glass_observations(
            self.sweeps, self.beams, self.stamps[self.nodes], self.node_poses, config
        )

    def in_world(self, found):
        positions, normals = found.at(self.node_poses)
        world_from_map = inverse(self.map_from_world)
        return transform_points(world_from_map, positions), wrap_angle(normals + world_from_map[2])


def test_glass_is_found_where_it_stands():
    corridor = Corridor(noise=0.005)
    found = corridor.observed()
    positions, normals = corridor.in_world(found)
    assert len(found) >= 6
    assert np.abs(positions[:, 1] - WALL_Y).max() < 0.01
    assert np.abs(normals - LEFT).max() < math.radians(3.0)
    assert (found.extent <= 0.25 + 1e-9).all()
    covered = np.abs(positions[:, 0, None] - np.linspace(0.3, 3.7, 50)) <= found.extent[:, None] + 0.05
    assert covered.any(axis=0).all()


def test_a_wall_is_fitted_from_it():
    corridor = Corridor(noise=0.005)
    walls = fit_walls(corridor.observed(), corridor.node_poses, corridor.beams, GlassWallConfig(min_nodes=2))
    assert len(walls) == 1
    assert walls[0].length == pytest.approx(4.0, abs=0.4)


def test_the_map_may_lie_in_any_frame():
    straight, turned = Corridor(turn=0.0), Corridor(turn=2.5)
    for corridor in (straight, turned):
        positions, normals = corridor.in_world(corridor.observed())
        assert positions[:, 1] == pytest.approx(np.full(len(positions), WALL_Y), abs=1e-6)
        assert normals == pytest.approx(np.full(len(normals), LEFT), abs=1e-6)
    assert len(straight.observed()) == len(turned.observed())


def test_a_robot_that_drives_askew_still_finds_the_normal_of_the_wall():
    corridor = Corridor(heading=math.radians(6.0))
    _, normals = corridor.in_world(corridor.observed())
    assert len(normals) >= 6
    assert np.abs(normals - LEFT).max() < math.radians(1.0)


def test_an_opaque_wall_is_no_glass():
    assert len(Corridor(behind=1.02).observed()) == 0


@pytest.mark.parametrize(("behind", "is_glass"), [(1.2, False), (1.35, True)])
def test_what_stands_just_behind_glass_must_be_far_enough(behind, is_glass):
    assert (len(Corridor(behind=behind).observed()) > 0) == is_glass


def test_where_no_lidar_beam_went_nothing_is_claimed():
    corridor = Corridor()
    nowhere = Beams.pack(
        [np.zeros(2)] * len(corridor.node_poses), [np.empty((0, 2), np.float32)] * len(corridor.node_poses)
    )
    found = sonar_glass_observations(
        corridor.sweeps,
        BeamEvidence(nowhere, nowhere),
        corridor.stamps[corridor.nodes],
        corridor.node_poses,
        CONFIG,
    )
    assert len(found) == 0


def test_beams_without_echo_pass_glass_too():
    corridor = Corridor()
    silent = BeamEvidence(corridor.beams.silent, corridor.beams.returns)
    found = sonar_glass_observations(
        corridor.sweeps, silent, corridor.stamps[corridor.nodes], corridor.node_poses, CONFIG
    )
    assert len(found) == len(corridor.observed()) > 0


def test_scattered_readings_are_no_surface():
    corridor = Corridor(noise=0.3)
    assert len(corridor.observed()) == 0


def test_a_noisy_ring_finds_glass_in_longer_pieces():
    corridor = Corridor(noise=0.04, length=6.0)
    positions, normals = corridor.in_world(corridor.observed())
    assert len(positions) >= 2
    assert np.abs(positions[:, 1] - WALL_Y).max() < 0.05
    assert (np.abs(normals - LEFT) < 4.0 * corridor.observed().normal_sigma).all()
    assert corridor.observed().extent.max() > 0.25


@pytest.mark.parametrize(("sigma", "expected"), [(0.0, 0.0), (0.01, 0.01), (0.04, 0.04), (0.3, 0.06)])
def test_noise_is_measured_whatever_the_motion(sigma, expected):
    """A sonar that nears a wall steadily, with a leap to another wall on the way."""
    stamps = 0.3 * np.arange(400)
    ranges = 2.5 - 0.004 * np.arange(400) - 0.5 * (np.arange(400) > 200)
    ranges = ranges + np.random.default_rng(1).normal(0.0, sigma, 400)
    rows = np.column_stack((stamps, np.zeros((400, 3)), ranges))
    assert reading_noise([rows, rows[:0]], 1.0) == pytest.approx(expected, rel=0.15, abs=1e-6)
    assert reading_noise([rows], 0.1) == 0.0


def test_uncertainty_is_honest():
    quiet, loud = Corridor(noise=0.001).observed(), Corridor(noise=0.01).observed()
    assert (quiet.position_sigma >= CONFIG.glass.range_bias).all()
    assert (loud.normal_sigma <= math.radians(CONFIG.glass.max_normal_sigma_deg)).all()
    assert loud.normal_sigma.mean() >= quiet.normal_sigma.mean()
    assert (quiet.probability == CONFIG.glass.probability).all()


def test_observations_follow_their_nodes():
    corridor = Corridor()
    found = corridor.observed()
    moved = compose(np.array([1.0, 2.0, 0.3])[None], corridor.node_poses)
    before, after = found.at(corridor.node_poses)[0], found.at(moved)[0]
    assert after == pytest.approx(transform_points(np.array([1.0, 2.0, 0.3]), before))
    outward = np.column_stack((np.cos(found.normal), np.sin(found.normal)))
    assert found.sensor == pytest.approx(found.position - WALL_Y * outward, abs=1e-6)


def test_without_nodes_or_sweeps_there_is_nothing():
    corridor = Corridor()
    nothing = sonar_glass_observations(corridor.sweeps, corridor.beams, np.empty(0), np.empty((0, 3)), CONFIG)
    silent = sweeps(np.empty((0, 2)), ring(LEFT, RIGHT))
    nobody = sonar_glass_observations(
        silent, corridor.beams, corridor.stamps[corridor.nodes], corridor.node_poses, CONFIG
    )
    assert len(nothing) == len(nobody) == 0


def test_the_share_of_beams_that_pass_is_counted_at_the_piece():
    """One piece at (0, 1) of 0.2 m; of 10 beams of a node at the origin 7 go on and 3 end on it."""
    ends = [(0.05 * k - 0.15, 2.0) for k in range(7)] + [(0.0, 1.0), (0.05, 1.1), (-0.05, 0.95)]
    far_away = [(3.0, 2.0), (0.0, -5.0)]
    returns = Beams.pack([np.zeros(2)], [np.array(ends + far_away, dtype=np.float32)])
    nothing = Beams.pack([np.zeros(2)], [np.empty((0, 2), np.float32)])
    piece = np.array([[0.0, 0.0, 0.0, LEFT, 1.0, 0.05, 0.02, 0.1, 6.0]])
    assert passed_share(piece, BeamEvidence(returns, nothing), np.zeros((1, 3)), 0.25) == pytest.approx([0.7])


def test_observations_of_several_sensors_are_one_set():
    corridor = Corridor()
    found = corridor.observed()
    both = GlassObservations.joined([found, found])
    assert len(both) == 2 * len(found)
    assert both.position[len(found) :] == pytest.approx(found.position)
    assert both.node.dtype == np.int64
    assert len(GlassObservations.joined([])) == 0


def test_pieces_belong_to_the_node_nearest_in_time_whatever_the_order_of_nodes():
    corridor = Corridor()
    found = corridor.observed()
    backwards = sonar_glass_observations(
        corridor.sweeps,
        corridor.beams,
        corridor.stamps[corridor.nodes][::-1],
        corridor.node_poses[::-1],
        CONFIG,
    )
    assert (len(corridor.node_poses) - 1 - backwards.node).tolist() == found.node.tolist()
