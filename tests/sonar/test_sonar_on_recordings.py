"""Sonars of the pi-map hallway: a glass wall along y = 1.22 + 0.0036 x from x = 4.2 to 27 m."""

import math

import numpy as np
import pytest

import glassslam as gs
from glassslam.config import FusionConfig, SonarConfig
from glassslam.fusion.fuse import fuse
from glassslam.fusion.revisit import side_sonars
from glassslam.records import RangeRing, SonarRing, Trajectory
from glassslam.slam.trajectory import PoseTracks
from glassslam.sonar.mapping import build_sonar_map
from glassslam.sonar.ray_kernels import first_occupied
from glassslam.sonar.sweeps import placed_sweeps

# mm and deg: the rings of a Pioneer 3-DX
SONARS = (
    (69, 136, 90), (114, 119, 50), (148, 78, 30), (166, 27, 10), (166, -27, -10), (148, -78, -30),
    (114, -119, -50), (69, -136, -90), (-157, -136, -90), (-203, -119, -130), (-237, -78, -150),
    (-255, -27, -170), (-255, 27, 170), (-237, 78, 150), (-203, 119, 130), (-157, 136, 90),
)  # fmt: skip
RING = SonarRing(
    np.array([(x / 1e3, y / 1e3, math.radians(yaw)) for x, y, yaw in SONARS]), math.radians(30.0), 0.1, 5.0
)


def read(path):
    """Stamps, s, and the columns after them."""
    rows = [line.split() for line in path.read_text().splitlines() if line.strip()]
    stamps = np.array([int(row[3]) / 1e7 - 62135596800 for row in rows])
    return stamps, np.array([row[4:] for row in rows], dtype=np.float64)


@pytest.fixture(scope="module")
def recorded(data_dir):
    """Sweeps with stale repeats and silence marked, and the track of the pose file."""
    folder = data_dir / "pimap"
    stamps, ranges = read(folder / "scene4_sonar.txt")
    stale = np.vstack((np.zeros((1, 16), bool), ranges[1:] == ranges[:-1]))
    ranges = np.where(stale, np.nan, np.where(ranges >= 5.0, np.inf, ranges))
    records = [RangeRing(float(t), row.astype(np.float32)) for t, row in zip(stamps, ranges, strict=True)]
    times, poses = read(folder / "scene4_pose.txt")
    first = np.unique(times, return_index=True)[1]
    return records, Trajectory(times[first], poses[first])


@pytest.fixture(scope="module")
def placed(recorded):
    records, track = recorded
    return placed_sweeps(records, RING, PoseTracks(track, track, track, track))


def covered(grid, tolerance=0.15):
    """Share of the glass wall within the tolerance of an occupied cell."""
    rows, columns = np.nonzero(grid.probability >= 0.65)
    x = grid.origin[0] + (columns + 0.5) * grid.resolution
    y = grid.origin[1] + (rows + 0.5) * grid.resolution
    along = np.arange(4.25, 27.0, 0.1)
    wall = np.column_stack((along, 1.22 + 0.0036 * along))
    distance = np.hypot(wall[:, None, 0] - x, wall[:, None, 1] - y).min(axis=1)
    return float((distance <= tolerance).mean())


@pytest.mark.parametrize(("algorithm", "least"), [("BFA", 0.97), ("DS", 0.97), ("ICL", 0.7), ("ICo", 0.6)])
def test_sonar_maps_show_the_glass_wall(placed, algorithm, least):
    assert covered(build_sonar_map(placed, SonarConfig(algorithm=algorithm))) >= least


def test_fusion_closes_the_hallway_on_its_glass_side(recorded, data_dir):
    """From the robot, in the frame of the lidar's own map, a ray to the left meets a wall within 1.5 m."""
    records, _ = recorded
    config = gs.Config.from_mapping({"glass": {"detector": "off"}})
    result = gs.map_recording(data_dir / "pimap" / "scene4.bag", config)
    tracks = PoseTracks(*(result.trajectory,) * 4)
    sweeps = placed_sweeps(records, RING, tracks)
    sonar_map = build_sonar_map(sweeps, SonarConfig())
    travel = np.hypot(*(sweeps.poses[:, :2] - sweeps.poses[0, :2]).T)
    along = (travel > 4.5) & (travel < 25.0) & (np.abs(sweeps.poses[:, 2]) < 0.4)

    def closed(grid):
        left = sweeps.sensors[along, side_sonars(RING)[0]]
        start = (left[:, :2] - np.asarray(grid.origin)) / grid.resolution
        reach = 1.5 / grid.resolution
        hits = [
            first_occupied(grid.probability, x, y, yaw, reach, 0.65)
            for (x, y), yaw in zip(start, left[:, 2], strict=True)
        ]
        return float(np.isfinite(hits).mean())

    assert along.sum() > 500
    assert closed(result.map) < 0.4
    shares = {
        sonars: closed(fuse("rsf_all", result.map, sonar_map, sweeps, FusionConfig(sonars=sonars)).map)
        for sonars in ("all", "sides")
    }
    assert min(shares.values()) > 0.95
