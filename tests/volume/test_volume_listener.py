"""Points of a 3D sensor and a finished run become a volume in the frame of its map."""

import math
from dataclasses import replace

import numpy as np
import pytest

from glassslam.config import Config
from glassslam.glass.ghosts import MIRRORED, SEEN_THROUGH, Ghosts
from glassslam.glass.layer import GlassLayer
from glassslam.glass.observations import GlassObservations
from glassslam.glass.walls import GlassWall
from glassslam.records import PointSet, Trajectory
from glassslam.slam.node import Node
from glassslam.slam.trajectory import PoseTracks
from glassslam.volume import projection
from glassslam.volume.listener import VolumeListener
from glassslam.volume.mapper import VolumeMapper
from glassslam.volume.options import VolumeOptions

HIT, MISS = math.log(0.7 / 0.3), math.log(0.4 / 0.6)
CONFIG = Config().volume


def node(number, stamp, *returns, free=()):
    """A scan from the centre of the base."""
    ends, silent = (np.array(points, dtype=np.float32).reshape(-1, 2) for points in (returns, free))
    return Node(number, number, stamp, np.zeros(3), np.zeros(2), ends, silent, 0.1)


def ping(stamp, *points, origin=(0.0, 0.0, 0.4)):
    return PointSet(stamp, np.array(points, dtype=np.float32).reshape(-1, 3), np.array(origin))


@pytest.fixture
def run(tiny_result):
    """Makes a run of nodes at poses, with a scan at each node and others in between."""

    def make(nodes, poses=((0.0, 0.0, 0.0),), scans=None, **changes):
        at_nodes = Trajectory(np.array([n.stamp for n in nodes]), np.array(poses, dtype=np.float64))
        final = at_nodes if scans is None else Trajectory(*map(np.array, scans))
        tracks = PoseTracks(final, final, at_nodes, final)
        return replace(tiny_result, nodes=tuple(nodes), tracks=tracks, **changes)

    return make


def value(tree, *place):
    return float(tree.log_odds_at(np.array([place], dtype=np.float64))[0])


def volume(result, *points, height=0.22, **parameters):
    return (
        VolumeListener(CONFIG.model_copy(update=parameters), points, laser_height=height)
        .joined(result)
        .volume
    )


def test_a_node_and_a_ping_share_one_volume(run):
    made = volume(run([node(0, 0.0, (2.01, 0.01))]), ping(0.02, (1.01, 0.01, 0.81)))
    assert value(made.tree, 2.01, 0.01, 0.22) == pytest.approx(HIT)
    assert value(made.tree, 1.0, 0.01, 0.22) == pytest.approx(MISS)
    assert value(made.tree, 1.01, 0.01, 0.81) == pytest.approx(HIT)
    assert made.counts == {"scans": 1, "point_sets": 1, "points": 1, "pairs": 1}
    assert made.dropped == {}
    assert made.config == CONFIG


def test_the_map_holds_what_is_above_the_plane_of_the_lidar_and_not_what_is_above_the_robot(run):
    result = run([node(0, 0.0, (3.01, 0.01))])
    made = volume(result, ping(0.0, (1.01, 0.01, 0.81), (2.01, 0.01, 2.41)))
    row = made.map.probability[int((0.01 - made.map.origin[1]) / 0.05)]
    table, lamp, wall = (row[int((x - made.map.origin[0]) / 0.05)] for x in (1.01, 2.01, 3.01))
    assert table > 0.65
    assert lamp < 0.5
    assert wall > 0.65


@pytest.mark.parametrize(
    ("configured", "recorded", "used"),
    [(None, 0.32, 0.32), (0.52, 0.32, 0.52), (None, None, 0.2), (0.52, None, 0.52), (None, 0.0, 0.0)],
)
def test_the_height_of_the_lidar_is_configured_or_recorded_or_usual(run, configured, recorded, used):
    result = run([node(0, 0.0, (1.01, 0.01))])
    made = volume(result, ping(0.0, (1.0, 0.0, 0.8)), height=recorded, lidar_height=configured)
    assert made.lidar_height == used
    assert value(made.tree, 1.01, 0.01, used + 0.01) == pytest.approx(HIT)


def test_without_a_ping_nothing_is_done(run):
    result = run([node(0, 0.0, (1.0, 0.0))])
    assert VolumeListener(CONFIG, []).joined(result) is result


def test_scans_stand_at_the_poses_of_their_nodes(run):
    nodes = [node(0, 0.0, (1.01, 0.01)), node(1, 1.0, (1.01, 0.01))]
    made = volume(run(nodes, [(0, 0, 0), (1, 2, math.pi / 2)]), ping(0.0, (0.5, 0.0, 0.9)))
    assert value(made.tree, 1.01, 0.01, 0.22) == pytest.approx(HIT)
    assert value(made.tree, 0.99, 3.01, 0.22) == pytest.approx(HIT)


def test_points_stand_at_the_poses_of_all_scans_and_between_them(run):
    poses = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 2.0, 0.0]]
    result = run(
        [node(0, 0.0, (3.0, 0.0)), node(1, 2.0, (3.0, 0.0))], [poses[0], poses[2]], ([0.0, 1.0, 2.0], poses)
    )
    made = volume(result, ping(0.5, (1.01, 0.01, 0.91)), ping(1.5, (1.01, 0.01, 0.91)))
    assert value(made.tree, 1.51, 0.01, 0.91) == pytest.approx(HIT)
    assert value(made.tree, 2.01, 1.01, 0.91) == pytest.approx(HIT)
    assert math.isnan(value(made.tree, 1.51, 1.01, 0.91))


def test_the_volume_is_that_of_a_mapper_fed_by_hand(run):
    random = np.random.default_rng(2)
    stamps = np.arange(6) / 2
    nodes = [node(k, t, *random.uniform(-4, 4, (30, 2)), free=random.uniform(-4, 4, (5, 2)))
             for k, t in enumerate(stamps)]  # fmt: skip
    poses = np.column_stack((0.3 * stamps, np.zeros(6), 0.1 * stamps))
    pings = [ping(t, *random.uniform(0.1, 3, (4, 3))) for t in random.uniform(0, 2.5, 20)]
    by_hand = VolumeMapper(Trajectory(stamps, poses), VolumeOptions(lidar_height=0.22))
    for _, _, record in sorted(
        [(n.stamp, 0, n) for n in nodes] + [(p.stamp, 1, p) for p in pings], key=lambda e: e[:2]
    ):
        if isinstance(record, PointSet):
            by_hand.add(record)
        else:
            by_hand.add_rays(
                record.stamp, poses[record.index], record.sensor, record.returns, record.free_ends
            )
    made, expected = volume(run(nodes, poses), *pings), by_hand.finish()
    leaves, wanted = made.tree.leaves(), expected.fused.leaves()
    assert len(wanted) > 1000
    np.testing.assert_array_equal(leaves.codes, wanted.codes)
    np.testing.assert_array_equal(leaves.log_odds, wanted.log_odds)
    assert made.counts == expected.counts


WALL = GlassWall(np.array([1.01, -1.01]), np.array([1.01, 1.01]), 9, 5, 1.0, 0.01, 0.01, 2.0)


def glass(*labels):
    """One wall a metre ahead, and what the returns are that came through it."""
    shares = np.full(len(labels), 0.5, np.float32)
    found = Ghosts(np.array(labels, np.uint8), 0.0 * shares, shares, shares[:0])
    return GlassLayer((WALL,), GlassObservations.empty(), np.empty((0, 2)), np.empty(0), ghosts=found)


def with_scheme(scheme):
    return Config.from_mapping({"glass": {"scheme": scheme}})


def test_mirror_images_end_at_the_wall_and_what_is_seen_through_it_stays(run):
    nodes = [node(0, 0.0, (2.01, 0.01), (2.01, 0.31))]
    layer = glass(SEEN_THROUGH, MIRRORED)
    made = volume(run(nodes, glass=layer), ping(0.0, (0.5, 0.0, 0.9)))
    assert value(made.tree, 2.01, 0.01, 0.22) == pytest.approx(HIT)
    assert math.isnan(value(made.tree, 2.01, 0.31, 0.22))
    assert value(made.tree, 0.92, 0.14, 0.22) == pytest.approx(MISS)


def test_glass_stands_in_the_plane_of_the_lidar_though_beams_pass(run):
    nodes = [node(k, 0.1 * k, (2.01, 0.01)) for k in range(8)]
    poses = np.zeros((8, 3))
    made = volume(run(nodes, poses, glass=glass(*[SEEN_THROUGH] * 8)), ping(0.0, (0.5, 0.0, 0.9)))
    assert value(made.tree, 1.01, 0.01, 0.22) == pytest.approx(made.tree.clamp.high)
    assert value(made.tree, 1.01, 0.91, 0.22) == pytest.approx(made.tree.clamp.high)
    assert value(made.tree, 0.9, 0.01, 0.22) < 0.0
    assert math.isnan(value(made.tree, 1.01, 0.91, 0.3))


def test_without_a_scheme_glass_is_what_was_measured(run):
    result = run([node(0, 0.0, (2.01, 0.01))], glass=glass(SEEN_THROUGH), config=with_scheme("off"))
    made = volume(result, ping(0.0, (0.5, 0.0, 0.9)))
    assert value(made.tree, 1.01, 0.01, 0.22) == pytest.approx(MISS)


def warnings(result, *points, height=0.22, **parameters):
    listener = VolumeListener(CONFIG.model_copy(update=parameters), points, height)
    return listener.joined(result).statistics.warnings[len(result.statistics.warnings) :]


def test_a_lidar_outside_of_the_band_of_heights_is_told(run):
    result = run([node(0, 0.0, (2.0, 0.0))])
    assert warnings(result, ping(0.0, (1.0, 0.0, 0.5))) == []
    assert warnings(result, ping(0.0, (1.0, 0.0, 0.5)), height=0.0) == [
        "the plane of the lidar, 0 m above the base, lies outside of the heights 0.1 to 1.8 m of the map of"
        " the volume (volume.lidar_height, volume.band_low)"
    ]


def test_points_that_are_left_out_are_told_when_they_are_many(run):
    result = run([node(0, 0.0, (2.0, 0.0))])
    behind = [ping(0.0, (-1.0, 0.0, 0.5), (-1.0, 0.1, 0.5), (1.0, 0.0, 0.5))]
    assert warnings(result, *behind) == [
        "the volume holds 1 points, and more was left out: 2 x point outside of the field of view"
    ]
    assert warnings(result, *behind, ultrasonic_half_angle_deg=180.0) == []


def test_a_volume_too_large_to_be_drawn_costs_a_warning_and_not_the_map(run, monkeypatch):
    monkeypatch.setattr(projection, "MOST_CELLS", 100)
    result = run([node(0, 0.0, (2.0, 0.0))])
    joined = VolumeListener(CONFIG, [ping(0.0, (1.0, 1.0, 0.5))], 0.22).joined(result)
    assert joined.volume is None
    assert joined.map is result.map
    assert joined.statistics.warnings[-1].startswith(
        "there is no volume: 2 x 1 m in voxels of 0.05 m are too many"
    )
    assert joined.statistics.warnings[-1].endswith("(raise volume.resolution)")


def test_the_run_that_was_joined_stays_as_it_was(run):
    result = run([node(0, 0.0, (2.0, 0.0))])
    before = dict(result.statistics.stages), list(result.statistics.warnings)
    joined = VolumeListener(CONFIG, [ping(0.0, (1.0, 0.0, 0.5))], 0.0).joined(result)
    assert (result.statistics.stages, result.statistics.warnings) == before
    assert joined.statistics.stages["volume"].wall > 0.0
    assert (result.volume, joined.volume is None) == (None, False)


def test_a_volume_in_which_nothing_can_be_placed_costs_a_warning_and_not_the_map(run):
    result = run([node(0, 0.0, (2.0, 0.0))])
    far = ping(0.0, (1.0, 0.0, 0.5), origin=(1e9, 0.0, 0.0))
    joined = VolumeListener(CONFIG, [far], laser_height=1e9).joined(result)
    assert joined.volume is None
    assert joined.statistics.warnings[-1] == (
        "there is no volume: nothing of it could be placed (1 x scan too far from the origin of the volume,"
        " 1 x point set too far from the origin of the volume)"
    )


@pytest.mark.parametrize("odd", [1e9, 1e30, 3e38, 1e300, math.inf, math.nan])
def test_points_and_places_out_of_all_bounds_lose_nothing_else(run, odd):
    result = run([node(0, 0.0, (2.01, 0.01))])
    sound = ping(0.0, (1.01, 0.01, 0.81))
    places = [
        ping(0.0, (1.0, 0.0, 0.5), origin=(odd, 0.0, 0.0)),
        ping(0.0, (1.0, 0.0, 0.5), origin=(0.0, 0.0, -odd)),
    ]
    points = [(x, 0.0, z) for x, z in ((odd, 0.5), (0.5, odd)) if not 3e38 < odd < math.inf]
    made = volume(result, sound, *places, ping(0.0, *points))
    assert value(made.tree, 1.01, 0.01, 0.81) == pytest.approx(HIT)
    assert value(made.tree, 2.01, 0.01, 0.22) == pytest.approx(HIT)


@pytest.mark.parametrize("height", [1e9, 1e300])
def test_a_height_of_the_lidar_out_of_all_bounds_leaves_the_points(run, height):
    made = volume(run([node(0, 0.0, (2.01, 0.01))]), ping(0.0, (1.01, 0.01, 0.81)), height=height)
    assert value(made.tree, 1.01, 0.01, 0.81) == pytest.approx(HIT)
    assert made.dropped == {"scan too far from the origin of the volume": 1}
