"""Ranges and incidences in the truth of a simulated recording."""

import numpy as np
import pytest
from tiny_scene import SQUARE, scene

from detectors.labels import GLASS
from glassslam.evaluation.beam_labels import read_true_labels
from glassslam.geometry import compose
from glassslam.simulation import simulate, write_recording
from glassslam.simulation.truth_log import TruthLog

ROOM = {
    "walls": [
        {"name": "room", "material": "plaster", "points": SQUARE, "closed": True},
        {"name": "front", "material": "glass", "points": [[1, 4.2], [5, 4.2]], "panes": {"width": 1.0}},
    ],
    "laser_pose": [0.1, 0.0, 0.2],
    "drive": {"waypoints": [{"at": [2, 3]}, {"at": [4, 3.1]}]},
}


@pytest.fixture(scope="module")
def simulation():
    return simulate(scene(**ROOM), "utm30lx", seed=3, scan_rate=8.0)


@pytest.fixture(scope="module")
def truth(simulation, tmp_path_factory):
    bag = tmp_path_factory.mktemp("truth") / "room.bag"
    return read_true_labels(write_recording(simulation, bag).true_labels)


def test_incidence_is_that_of_the_beam_on_the_pane(simulation, truth):
    """The pane lies along x: the incidence of a beam is its angle to y, but for the motion in the sweep."""
    bearings = simulation.sensor.angle_min + simulation.sensor.angle_increment * np.arange(
        simulation.sensor.beams
    )
    headings = compose(simulation.truth.poses, np.array([0.1, 0.0, 0.2]))[:, 2]
    angle = headings[:, None] + bearings
    expected = np.degrees(np.arccos(np.abs(np.sin(angle))))
    glass = truth.labels == GLASS
    assert glass.sum() > 1000
    assert np.abs(truth.incidence_deg[glass] - expected[glass]).max() < 3.0
    assert (truth.incidence_deg[~glass] == 255).all()


def test_ranges_are_those_of_the_scans(simulation, truth):
    scans = [record.ranges for record in simulation.records() if hasattr(record, "ranges")]
    ranges = np.array([ranges for ranges in scans if len(ranges) == simulation.sensor.beams])
    near = ranges < 25.0
    assert near.any()
    assert truth.range_m[near] == pytest.approx(ranges[near], abs=0.051)
    assert (truth.range_m[~near] > 24.9).all()


def test_scans_that_no_pane_answers_have_no_incidence(tmp_path):
    segments = np.array([[0.0, 1.0, 1.0, 1.0]])
    log = TruthLog(segments)
    seen = next(iter(_observations(2)))
    log.add(seen)
    log.save(tmp_path / "t.npz", np.array([1.0]), np.zeros((1, 3)))
    read = read_true_labels(tmp_path / "t.npz")
    assert read.incidence_deg.tolist() == [[255, 255]]
    assert read.range_m == pytest.approx(np.array([[1.3, 25.5]]))


def _observations(beams):
    from glassslam.simulation.echo import Observation

    none = np.zeros(beams)
    yield Observation(
        np.array([1.31, np.inf], np.float32), none.astype(np.float32), np.array([1, 4], np.uint8),
        none.astype(np.uint8), np.full(beams, -1, np.int32), none.astype(np.float32),
    )  # fmt: skip
