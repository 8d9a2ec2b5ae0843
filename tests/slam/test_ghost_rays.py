"""Ghosts on their way through SLAM: out of matching when asked, out of the map when asked."""

import numpy as np
import pytest
from glass_scans import FINE, before_a_pane
from slam_worlds import ROOM, Lidar, prediction, range_data

from detectors.labels import GHOST
from glassslam.config import Config, MapConfig, SensorConfig
from glassslam.glass.ghosts import DIRECT, MIRRORED, SEEN_THROUGH, Ghosts
from glassslam.records import LaserScan
from glassslam.slam.ghost_rays import visible_rays
from glassslam.slam.local import LocalSlam, prepared
from glassslam.slam.mapper import Mapper
from glassslam.slam.node import Node
from glassslam.slam.range_data import RangeData, prepare
from glassslam.slam.render import render

STILL = np.zeros(3)


def points(*rows):
    return np.array(rows, np.float32).reshape(-1, 2)


def node(returns, *, free_ends=(), apart=(), sensor=(0.0, 0.0)):
    return Node(
        0, 0, 0.0, np.zeros(3), np.array(sensor), points(*returns), points(*free_ends), 0.3, False,
        points(*apart),
    )  # fmt: skip


def labelled(labels, share, silent=()):
    labels = np.array(labels, np.uint8)
    nothing = np.zeros(len(labels), np.float32)
    return Ghosts(labels, nothing, np.array(share, np.float32), np.array(silent, np.float32))


NODE = node([[1.0, 0.0], [0.0, 4.0]], apart=[[0.0, -4.0]], free_ends=[[5.0, 0.0]])
FOUND = labelled([DIRECT, SEEN_THROUGH, MIRRORED], [1.0, 0.5, 0.25], [0.5])


def shown(kept, nodes=(NODE,), found=FOUND):
    return [[part.tolist() for part in rays] for rays in visible_rays(nodes, found, kept)]


def test_all_are_shown():
    assert shown("all") == [[[[1, 0], [0, 4], [0, -4]], [[5, 0]]]]
    assert shown("none", found=None) == shown("all")


def test_rays_of_mirror_images_end_at_the_mirror():
    assert shown("seen_through") == [[[[1, 0], [0, 4]], [[5, 0], [0, -1]]]]


def test_no_ray_goes_on_behind_glass():
    assert shown("none") == [[[[1, 0]], [[2.5, 0], [0, 2], [0, -1]]]]


def test_ways_begin_at_the_laser():
    beside = node([[3.0, 2.0]], sensor=(1.0, 2.0))
    assert shown("none", [beside], labelled([SEEN_THROUGH], [0.5])) == [[[], [[2, 2]]]]


def test_every_node_has_its_own_part():
    nodes = [node([[1, 0]], free_ends=[[2, 0]]), node([]), node([[4, 0], [6, 0]], free_ends=[[8, 0]])]
    found = labelled([DIRECT, SEEN_THROUGH, DIRECT], [1.0, 0.5, 1.0], [0.5, 0.25])
    assert shown("none", nodes, found) == [
        [[[1, 0]], [[1, 0]]],
        [[], []],
        [[[6, 0]], [[2, 0], [2, 0]]],
    ]


def value(grid, x, y):
    column, row = (int(np.floor((v - o) / grid.resolution)) for v, o in zip((x, y), grid.origin, strict=True))
    inside = 0 <= row < grid.probability.shape[0] and 0 <= column < grid.probability.shape[1]
    return grid.probability[row, column] if inside else np.nan


def test_a_map_without_ghosts_is_free_up_to_the_glass_and_unknown_behind():
    one = [node([[4.02, 0.02]])]
    found = labelled([SEEN_THROUGH], [0.5])
    whole, cut = (render(one, np.zeros((1, 3)), MapConfig(), found, kept) for kept in ("all", "none"))
    assert value(whole, 4.02, 0.02) > 0.5
    assert value(whole, 3.02, 0.02) < 0.5
    assert value(cut, 1.52, 0.02) < 0.5
    assert np.isnan(value(cut, 3.02, 0.02))
    assert np.isnan(value(cut, 4.02, 0.02))


def test_beams_behind_glass_are_set_apart():
    scan = LaserScan(0.0, np.array([1.0, 2.0, np.inf, 3.0], np.float32), 0.0, np.pi / 2, 0.1, 30.0)
    behind = np.array([False, True, False, False])
    whole = prepare(scan, STILL, STILL, SensorConfig())
    split = prepare(scan, STILL, STILL, SensorConfig(), behind)
    assert split.ghosts == pytest.approx(np.array([[0.0, 2.0]]), abs=1e-9)
    assert split.returns.tolist() == whole.returns[[0, 2]].tolist()
    assert split.free_ends.tolist() == whole.free_ends.tolist()
    assert len(whole.ghosts) == 0


def test_ghosts_stay_in_the_node_but_not_in_the_submap():
    seen = range_data(Lidar(ROOM).look(0.0, np.array([2.0, 2.0, 0.0])))
    ghosts = np.array([[7.02, 0.02], [7.03, 0.02], [8.0, 1.0]])
    data = prepared(RangeData(0.0, seen.sensor, seen.returns, seen.free_ends, ghosts), 0.05)
    local = LocalSlam(Config())
    result = local.add(data, prediction([0.0, 0.0, 0.0]))
    assert result.node.ghosts == pytest.approx(np.array([[7.02, 0.02], [8.0, 1.0]]), abs=1e-6)
    assert len(result.node.ends) == len(result.node.returns) + 2
    grid = result.submaps[0].grid
    assert np.isnan(grid.probability_at(ghosts)).all()
    assert (grid.probability_at(seen.returns) > 0.5).all()


@pytest.mark.parametrize("kept", [True, False])
def test_the_configuration_decides_whether_they_are_matched(kept, monkeypatch):
    """Everything to the right of the robot is said to lie behind glass."""
    glass = {"detector": "intensity_peak", "thresh": 5000.0, "ghosts_in_matching": kept}
    mapper = Mapper(Config.from_mapping({"glass": glass}))
    sighted = mapper._glass.sighted

    def seen(scan, twist):
        sighting = sighted(scan, twist)
        sighting.labels[: len(scan.ranges) // 2] = GHOST
        return sighting

    monkeypatch.setattr(mapper._glass, "sighted", seen)
    for scan in before_a_pane(FINE, count=4):
        mapper.add(scan)
    mapper.finish()
    nodes = mapper._global.nodes
    assert nodes
    for one in nodes:
        assert (len(one.ghosts) == 0) is kept
        assert (one.returns[:, 1].min() < -0.5) is np.bool_(kept)
