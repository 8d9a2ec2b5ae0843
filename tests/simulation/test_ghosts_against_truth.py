"""Ghosts found behind true glass, against what the beams of a simulation truly met."""

import numpy as np
import pytest
from tiny_scene import scene

from detectors.labels import GHOST
from glassslam.config import SensorConfig
from glassslam.geometry import compose, transform_points
from glassslam.glass.beams import BeamEvidence, Beams
from glassslam.glass.ghosts import MIRRORED, find_ghosts
from glassslam.glass.walls import GlassWall
from glassslam.records import LaserScan
from glassslam.simulation import simulate
from glassslam.slam.range_data import prepare

HALLWAY = {
    "walls": [
        {"name": "room", "material": "plaster", "points": [[0, 0], [12, 0], [12, 6], [0, 6]], "closed": True},
        {"name": "front", "material": "glass", "points": [[0.5, 2.2], [11.5, 2.2]]},
    ],
    "posts": [
        {
            "name": "columns",
            "material": "plaster",
            "radius": 0.15,
            "at": [[4, 4], [7, 5], [10, 0.6], [2, 1.8]],
        }
    ],
    "drive": {"waypoints": [{"at": [1, 1.2]}, {"at": [9, 1.2]}]},
}
LASER = np.array([0.1, 0.0, 0.0])
STILL = np.zeros(3)


@pytest.fixture(scope="module")
def hallway():
    """Ghosts among all returns with true poses and true glass; and their true labels and ends."""
    simulation = simulate(scene(**HALLWAY, laser_pose=tuple(LASER)), "utm30lx", seed=1, scan_rate=4.0)
    truth, returns, silent, ends = [], [], [], []
    seen = []
    scans = [record for record in simulation.records(seen.append) if isinstance(record, LaserScan)]
    for scan, observation, pose in zip(scans, seen, simulation.truth.poses, strict=True):
        data = prepare(scan, LASER, STILL, SensorConfig())
        heard = np.isfinite(observation.ranges) & (observation.ranges < 30.0)
        truth.append(np.stack((observation.labels[heard] == GHOST, observation.mirrored[heard] == 1), axis=1))
        returns.append(data.returns.astype(np.float32))
        silent.append(data.free_ends.astype(np.float32))
        ends.append(transform_points(pose, data.returns))
    sensors = [LASER[:2]] * len(scans)
    beams = BeamEvidence(Beams.pack(sensors, returns), Beams.pack(sensors, silent))
    panes = simulation.plan.segments[[name == "front" for name in simulation.plan.names]]
    walls = [GlassWall(pane[:2], pane[2:], 9, 9, 1.0, 0.01, 0.01, 1.0) for pane in panes]
    found = find_ghosts(walls, compose(simulation.truth.poses, STILL), beams, 0.12)
    return found, np.concatenate(truth), np.concatenate(ends)


def test_what_lies_behind_glass_is_found(hallway):
    found, truth, ends = hallway
    said, ghost = found.labels > 0, truth[:, 0]
    behind = ghost & (ends[:, 1] > 2.4)
    assert behind.sum() > 2000
    assert (said & ghost).sum() > 0.98 * said.sum()
    assert (said & behind).sum() > 0.98 * behind.sum()


def test_mirror_images_are_likelier_mirrored_than_what_is_seen_through(hallway):
    found, truth, _ = hallway
    mirrored, through = ((found.labels > 0) & chosen for chosen in (truth[:, 1], truth[:, 0] & ~truth[:, 1]))
    assert mirrored.sum() > 100
    assert found.mirrored[mirrored].mean() > 2.0 * found.mirrored[through].mean()


def test_little_that_is_really_there_is_taken_for_an_image(hallway):
    """The end wall goes on behind the glass, where it looks like the image of its own front part."""
    found, truth, _ = hallway
    through = (found.labels > 0) & truth[:, 0] & ~truth[:, 1]
    assert (found.labels[through] == MIRRORED).sum() < 0.01 * through.sum()
