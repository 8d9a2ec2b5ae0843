"""Every rule by its name, on one small world."""

import numpy as np
import pytest
from fusion_worlds import LEFT, ring, sweeps

from glassslam.config import FusionConfig, SonarConfig
from glassslam.errors import UsageError
from glassslam.fusion.fuse import METHODS, fuse
from glassslam.fusion.run import fuse_recording
from glassslam.records import RangeRing, Trajectory
from glassslam.slam.result import OccupancyMap
from glassslam.sonar.poses import PoseTracks

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

    def layer(self, drift=0.0, **config):
        stamps = 0.1 * np.arange(31)
        final = np.column_stack((stamps, np.zeros(31), np.zeros(31)))
        local = final + np.array([0.0, drift, 0.0])
        truth, drifted = Trajectory(stamps, final), Trajectory(stamps, local)
        tracks = PoseTracks(drifted, drifted, Trajectory(stamps[::10], final[::10]), truth)
        records = [RangeRing(float(t), np.array([1.0], np.float32)) for t in stamps]
        cells = np.full((60, 120), 0.1, np.float32)
        cells[50:52] = 0.9
        lidar = OccupancyMap(cells, 0.05, (-1.5, -0.5))
        return fuse_recording(records, ring(LEFT), tracks, lidar, SonarConfig(**config))

    def occupied_rows(self, grid, low=0.5, high=2.5):
        """y of the occupied cells between two x, m."""
        columns = slice(*(int((x - grid.origin[0]) / grid.resolution) for x in (low, high)))
        rows = np.flatnonzero((grid.probability[:, columns] > 0.65).any(axis=1))
        return grid.origin[1] + (rows + 0.5) * grid.resolution

    def test_the_sonar_map_and_the_fused_map_show_the_glass(self):
        layer = self.layer()
        assert np.abs(self.occupied_rows(layer.sonar_map) - 1.0).max() < 0.1
        assert {round(float(y), 1) for y in self.occupied_rows(layer.fused.map)} >= {1.0, 2.0}
        assert len(layer.sweeps.stamps) == 31

    @pytest.mark.parametrize(("kind", "y"), [("Loc", 1.3), ("PG", 1.3), ("FG", 1.0), ("FGfit", 1.0)])
    def test_the_poses_are_of_the_kind_that_was_asked_for(self, kind, y):
        layer = self.layer(drift=0.3, pose_kind=kind)
        assert np.abs(self.occupied_rows(layer.sonar_map) - y).max() < 0.1

    def test_the_rule_is_the_one_that_was_asked_for(self):
        assert self.layer(fusion={"method": "bayes"}).fused.source is None
        assert self.layer(fusion={"method": "rsf_all"}).fused.source is not None

    def test_same_input_same_bytes(self):
        first, second = self.layer(), self.layer()
        assert first.fused.map.probability.tobytes() == second.fused.map.probability.tobytes()
