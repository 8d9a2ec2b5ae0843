"""Every rule by its name, on one small world."""

from dataclasses import replace

import numpy as np
import pytest
from fusion_worlds import LEFT, RIGHT, ring, sweeps

from glassslam.config import FusionConfig, SonarConfig
from glassslam.errors import UsageError
from glassslam.fusion.fuse import METHODS, fuse
from glassslam.fusion.listener import SonarListener, by_walls
from glassslam.glass.layer import GlassLayer
from glassslam.glass.observations import GlassObservations
from glassslam.glass.walls import GlassWall
from glassslam.records import RangeRing, Trajectory
from glassslam.slam.result import OccupancyMap
from glassslam.slam.trajectory import PoseTracks

LIDAR = """
    ########
    ........
    ........
    ........
    ........
    """
SONAR = """
    ????????
    ????????
    ########
    ........
    ........
    """
PLACED = sweeps([(0.25 + 0.5 * k, 0.25, 0.0) for k in range(8)], ring(LEFT), [[1.0]] * 8)


def glass_cells(fused):
    """P(occupied) along the glass, y = 1.25, in the frame of the fused map."""
    grid = fused.map
    row = int(np.floor((1.25 - grid.origin[1]) / grid.resolution))
    columns = np.floor((np.arange(0.25, 4.0, 0.5) - grid.origin[0]) / grid.resolution).astype(int)
    return grid.probability[row, columns]


@pytest.mark.parametrize("method", METHODS)
def test_every_rule_gives_a_map_that_covers_both(draw_map, method):
    lidar, sonar = draw_map(LIDAR), draw_map(SONAR)
    fused = fuse(method, lidar, sonar, PLACED, FusionConfig(glass_gap=0.4))
    assert fused.map.probability.dtype == np.float32
    assert fused.map.resolution == (0.1 if method == "overlay" else 0.5)
    assert np.nanmax(fused.map.probability) <= 1.0
    assert np.nanmin(fused.map.probability) >= 0.0
    if fused.source is not None:
        assert fused.source.shape == fused.map.probability.shape
        assert fused.source.dtype == np.uint8


@pytest.mark.parametrize("method", ["overlay", "attach", "pessimistic", "rsf_glass", "rsf_all"])
def test_rules_that_trust_one_sensor_close_the_glass(draw_map, method):
    fused = fuse(method, draw_map(LIDAR), draw_map(SONAR), PLACED, FusionConfig(glass_gap=0.4))
    assert (glass_cells(fused) >= 0.65).all()
    assert fused.source is not None


@pytest.mark.parametrize(
    ("method", "expected"), [("lop", 0.75 * 0.1 + 0.25 * 0.9), ("iop", 0.5), ("bayes", 0.5), ("minmax", 0.5)]
)
def test_pools_weigh_the_lidar_against_the_sonar(draw_map, method, expected):
    fused = fuse(method, draw_map(LIDAR), draw_map(SONAR))
    assert glass_cells(fused) == pytest.approx(np.full(8, expected), abs=1e-6)


def test_the_prior_and_the_weights_are_those_of_the_configuration(draw_map):
    config = FusionConfig(lidar_weight=0.0, sonar_weight=2.0)
    assert glass_cells(fuse("liop", draw_map(LIDAR), draw_map(SONAR), None, config)) == pytest.approx(
        np.full(8, 0.9), abs=1e-6
    )
    doubtful = glass_cells(fuse("bayes", draw_map(LIDAR), draw_map(SONAR), None, FusionConfig(prior=0.2)))
    assert (doubtful > 0.6).all()


def test_maps_on_different_grids_are_joined(draw_map):
    sonar = draw_map("#", resolution=0.25, origin=(5.0, 5.0))
    fused = fuse("bayes", draw_map(LIDAR), sonar)
    assert fused.map.resolution == 0.25
    assert fused.map.probability[-1, -1] == pytest.approx(0.9)


def test_an_unknown_rule_is_refused_by_name(draw_map):
    with pytest.raises(UsageError, match="no fusion named 'magic'") as caught:
        fuse("magic", draw_map(LIDAR), draw_map(SONAR))
    assert caught.value.hint == f"choose from {', '.join(METHODS)}"


@pytest.mark.parametrize("method", ["overlay", "rsf_glass", "rsf_all"])
def test_rules_along_rays_need_the_sweeps(draw_map, method):
    with pytest.raises(UsageError, match=f"fusion '{method}' needs the sonar sweeps") as caught:
        fuse(method, draw_map(LIDAR), draw_map(SONAR))
    assert caught.value.hint == "give them with their poses"


class TestRecording:
    """A robot at y = 0 drives along glass at y = 1; the lidar sees free space up to y = 2."""

    @pytest.fixture
    def maps(self, tiny_result):
        def make(drift=0.0, **config):
            stamps = 0.1 * np.arange(31)
            final = np.column_stack((stamps, np.zeros(31), np.zeros(31)))
            local = final + np.array([0.0, drift, 0.0])
            truth, drifted = Trajectory(stamps, final), Trajectory(stamps, local)
            tracks = PoseTracks(drifted, drifted, Trajectory(stamps[::10], final[::10]), truth)
            cells = np.full((60, 120), 0.1, np.float32)
            cells[50:52] = 0.9
            lidar = OccupancyMap(cells, 0.05, (-1.5, -0.5))
            sweeps = [RangeRing(float(stamp), np.array([1.0], np.float32)) for stamp in stamps]
            listener = SonarListener(ring(LEFT), SonarConfig(**config), sweeps)
            run = replace(tiny_result, map=lidar, lidar_map=lidar, tracks=tracks)
            return listener.joined(run).sonar

        return make

    def occupied_rows(self, grid, low=0.5, high=2.5):
        """y of the occupied cells between two x, m."""
        columns = slice(*(int((x - grid.origin[0]) / grid.resolution) for x in (low, high)))
        rows = np.flatnonzero((grid.probability[:, columns] > 0.65).any(axis=1))
        return grid.origin[1] + (rows + 0.5) * grid.resolution

    def test_the_sonar_map_and_the_fused_map_show_the_glass(self, maps):
        made = maps(fusion={"method": "rsf_all"})
        assert np.abs(self.occupied_rows(made.sonar_map) - 1.0).max() < 0.1
        assert {round(float(y), 1) for y in self.occupied_rows(made.fused_map)} >= {1.0, 2.0}
        assert made.sweeps == 31

    @pytest.mark.parametrize(("kind", "y"), [("Loc", 1.3), ("PG", 1.3), ("FG", 1.0), ("FGfit", 1.0)])
    def test_the_poses_are_of_the_kind_that_was_asked_for(self, maps, kind, y):
        made = maps(drift=0.3, pose_kind=kind)
        assert np.abs(self.occupied_rows(made.sonar_map) - y).max() < 0.1

    def test_the_rule_is_the_one_that_was_asked_for(self, maps):
        assert maps(fusion={"method": "bayes"}).source is None
        assert maps(fusion={"method": "rsf_all"}).source is not None

    def test_same_input_same_bytes(self, maps):
        assert maps().fused_map.probability.tobytes() == maps().fused_map.probability.tobytes()


class TestByWalls:
    """What the lidar maps, closed at glass walls, with free space that only the sonars know."""

    def fused(self, tiny_result, draw_map, walls=(), reading=1.25):
        """A sonar at (0.25, 0.25) looks left, along the first column, and hears something at `reading`."""
        lidar = draw_map("?...\n?#..\n????\n....")
        layer = GlassLayer(walls, GlassObservations.empty(), np.empty((0, 2)), np.empty(0))
        run = replace(tiny_result, map=lidar, lidar_map=lidar, closed_map=lidar, glass=layer)
        heard = sweeps([(0.25, 0.25, 0.0)], ring(LEFT), [[reading]])
        return by_walls(run, heard, SonarConfig(arc_thickness=0.1))

    def wall(self, observations, by_sonar):
        ends = np.array([0.1, 0.75]), np.array([1.9, 0.75])
        return GlassWall(*ends, observations, 5, 0.99, 0.01, 0.01, 1.0, by_sonar)

    @pytest.mark.parametrize(
        ("reading", "column"), [(0.7, [1, 2, 0, 0]), (1.25, [1, 2, 2, 0]), (np.nan, [1, 0, 0, 0])]
    )
    def test_what_the_lidar_did_not_see_is_free_up_to_the_reading(
        self, tiny_result, draw_map, reading, column
    ):
        fused = self.fused(tiny_result, draw_map, reading=reading)
        assert fused.source[:, 0].tolist() == column
        assert (~np.isnan(fused.map.probability[:, 0])).tolist() == [number > 0 for number in column]

    def test_nothing_is_cleared_behind_what_is_occupied(self, tiny_result, draw_map):
        lidar = draw_map("?...\n?...\n#...\n....")
        run = replace(tiny_result, map=lidar, lidar_map=lidar, closed_map=lidar)
        heard = sweeps([(0.25, 0.25, 0.0)], ring(LEFT), [[1.8]])
        assert by_walls(run, heard, SonarConfig()).source[:, 0].tolist() == [1, 1, 0, 0]

    @pytest.mark.parametrize(("returns", "is_obstacle"), [(0.8, False), (0.94, True)])
    def test_one_return_with_nothing_beside_it_is_no_obstacle(
        self, tiny_result, draw_map, returns, is_obstacle
    ):
        lidar = draw_map("#??.\n????\n?##?\n....")
        lidar.probability[lidar.probability > 0.65] = returns
        run = replace(tiny_result, map=lidar, lidar_map=lidar, closed_map=lidar)
        fused = by_walls(run, sweeps([], ring(LEFT)), SonarConfig())
        occupied = fused.map.probability > 0.65
        assert occupied[3, 0] == is_obstacle
        assert fused.source[3, 0] == is_obstacle
        assert occupied[1].tolist() == [False, True, True, False], "two of them are a thing"

    @pytest.mark.parametrize(("observations", "by_sonar", "who"), [(9, 0, 1), (9, 9, 2), (9, 4, 3)])
    def test_walls_tell_which_sensors_saw_them(self, tiny_result, draw_map, observations, by_sonar, who):
        fused = self.fused(tiny_result, draw_map, (self.wall(observations, by_sonar),))
        assert fused.source[1].tolist() == [who] * 4


def test_two_sonars_can_stand_for_the_ring(tiny_result, draw_map):
    """The sonar ahead hears a wall; with the sides alone its reading is left out of the sonar map."""
    grid = draw_map("........")
    track = Trajectory(np.arange(3.0), np.zeros((3, 3)))
    run = replace(tiny_result, map=grid, lidar_map=grid, tracks=PoseTracks(track, track, track, track))

    def x_of_walls(sonars):
        config = SonarConfig.model_validate({"fusion": {"method": "attach", "sonars": sonars}})
        readings = np.array([1.0, 1.5, 1.0], np.float32)
        sweeps = [RangeRing(stamp, readings) for stamp in (0.0, 0.5, 1.0, 1.5)]
        heard = SonarListener(ring(LEFT, 0.0, RIGHT), config, sweeps).joined(run).sonar.sonar_map
        columns = np.flatnonzero((heard.probability > 0.65).any(axis=0))
        return heard.origin[0] + (columns + 0.5) * heard.resolution

    assert x_of_walls("all").max() == pytest.approx(1.5, abs=0.1)
    assert x_of_walls("sides").max() < 0.3
