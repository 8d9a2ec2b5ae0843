"""The finished map."""

import numpy as np
import pytest

from glassslam.config import MapConfig
from glassslam.slam.node import Node
from glassslam.slam.render import render


def node(index, returns, free_ends=(), sensor=(0.0, 0.0)):
    return Node(
        index, index, 0.0, np.zeros(3), np.array(sensor), np.array(returns, np.float32).reshape(-1, 2),
        np.array(free_ends, np.float32).reshape(-1, 2), 0.3,
    )  # fmt: skip


def value(grid, x, y):
    column, row = (int(np.floor((v - o) / grid.resolution)) for v, o in zip((x, y), grid.origin, strict=True))
    return grid.probability[row, column]


def test_returns_are_occupied_and_what_lies_before_them_is_free():
    nodes = [node(k, [[1.02, 0.02]]) for k in range(5)]
    grid = render(nodes, np.zeros((5, 3)), MapConfig(resolution=0.05))
    assert value(grid, 1.02, 0.02) > 0.95
    assert value(grid, 0.52, 0.02) < 0.2
    assert np.isnan(value(grid, 1.12, 0.02))
    assert grid.resolution == 0.05


def test_nodes_are_entered_at_the_poses_given_not_at_their_local_ones():
    grid = render([node(0, [[1.0, 0.0]])], np.array([[5.02, 2.02, np.pi / 2]]), MapConfig())
    assert value(grid, 5.02, 3.02) > 0.5


def test_rays_start_at_the_laser():
    grid = render([node(0, [[1.0, 0.0]], sensor=(0.5, 0.5))], np.zeros((1, 3)), MapConfig())
    assert value(grid, 0.52, 0.48) < 0.5
    assert np.isnan(value(grid, 0.3, 0.0))


def test_silent_beams_clear_without_an_end():
    grid = render([node(0, [], free_ends=[[1.02, 0.02]])], np.zeros((1, 3)), MapConfig())
    assert value(grid, 0.52, 0.02) < 0.5
    assert not (grid.probability > 0.5).any()


def test_probabilities_are_those_of_the_configuration():
    config = MapConfig(hit_probability=0.8, miss_probability=0.3)
    grid = render([node(0, [[1.02, 0.02]])], np.zeros((1, 3)), config)
    assert value(grid, 1.02, 0.02) == pytest.approx(0.8, abs=0.01)
    assert value(grid, 0.52, 0.02) == pytest.approx(0.3, abs=0.01)


def test_every_node_needs_a_pose():
    with pytest.raises(ValueError, match="zip"):
        render([node(0, [[1.0, 0.0]])], np.zeros((2, 3)), MapConfig())
