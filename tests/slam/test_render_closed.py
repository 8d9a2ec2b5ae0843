"""The map in which no beam goes through glass, and what silence says in it."""

import numpy as np
import pytest

from glassslam.config import Config
from glassslam.glass.layer import GlassLayer
from glassslam.glass.observations import GlassObservations
from glassslam.records import Trajectory
from glassslam.slam.node import Node
from glassslam.slam.render import render_run
from glassslam.slam.settled import SettledRun
from glassslam.slam.trajectory import PoseTracks

NO_GLASS = GlassLayer((), GlassObservations.empty(), np.empty((0, 2)), np.empty(0))
ODDS = ((0.8, 0.33), (0.65, 0.4), (0.599, 0.48), (0.55, 0.49))


def fan(x, y):
    """Ends of beams at every x of one y, m."""
    return np.column_stack((x, np.full(len(x), y))).astype(np.float32)


@pytest.fixture
def closed(tiny_result):
    """A wall at y = 1; so many of the beams that head for it are silent, and others that head for nothing."""

    def draw(silent, hit, miss):
        answers, others = fan(np.linspace(-1.0, 1.0, 81), 1.02), fan(np.linspace(-1.0, 1.0, 81), -1.02)
        quiet = np.concatenate((fan(np.linspace(-1.0, 1.0, silent), 1.3), others))
        node = Node(0, 0, 0.0, np.zeros(3), np.zeros(2), answers, quiet, 0.3)
        track = Trajectory(np.zeros(1), np.zeros((1, 3)))
        config = Config.model_validate({"map": {"hit_probability": hit, "miss_probability": miss}})
        run = SettledRun(
            config, (node,), (), (), PoseTracks(track, track, track, track), tiny_result.statistics
        )
        return render_run(run, NO_GLASS, closed=True).closed

    return draw


def value(grid, x, y):
    column, row = (int(np.floor((v - o) / grid.resolution)) for v, o in zip((x, y), grid.origin, strict=True))
    inside = 0 <= row < grid.probability.shape[0] and 0 <= column < grid.probability.shape[1]
    return grid.probability[row, column] if inside else np.nan


@pytest.mark.parametrize(("hit", "miss"), ODDS)
@pytest.mark.parametrize(("silent", "believed"), [(0, True), (10, True), (60, False)])
def test_whether_silence_clears_does_not_depend_on_the_odds_of_the_map(closed, silent, believed, hit, miss):
    """Of 91 beams that meet the wall 10 are silent, which makes 0.1; of 141 it is 60, which makes 0.3."""
    grid = closed(silent, hit, miss)
    assert value(grid, 0.02, 1.02) == pytest.approx(hit, abs=0.01), "drawn with the odds of the map"
    below = value(grid, 0.02, -0.52)
    assert below < 0.5 if believed else np.isnan(below)


def test_the_map_itself_is_drawn_with_the_odds_of_the_configuration(closed):
    common, weak = (closed(0, hit, miss) for hit, miss in (ODDS[0], ODDS[-1]))
    assert np.array_equal(np.isnan(common.probability), np.isnan(weak.probability))
    assert value(common, 0.02, 0.52) < value(weak, 0.02, 0.52) < 0.5
