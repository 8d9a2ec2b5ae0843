"""A real 3D ultrasonic sensor that stands for a minute while things are moved before it."""

import numpy as np
import pytest

from glassslam.records import PointSet, Trajectory
from glassslam.sources.options import SourceOptions
from glassslam.sources.sonarfile import open_sonar
from glassslam.volume.files import VOLUME_FILES, write_volume
from glassslam.volume.mapper import build_volume
from glassslam.volume.octomap_file import most_likely
from glassslam.volume.storage import load_volume


@pytest.fixture(scope="module")
def recorded(data_dir):
    bag = data_dir / "toposens" / "test.bag"
    if not bag.is_file():
        pytest.skip(f"{bag} is absent")
    dropped = []
    records = list(open_sonar(bag, SourceOptions()).records(dropped.append))
    assert dropped == []
    return records


@pytest.fixture(scope="module")
def volume(recorded):
    return build_volume(recorded, Trajectory(np.zeros(1), np.zeros((1, 3))))


def test_all_pings_are_entered(recorded, volume):
    assert all(isinstance(record, PointSet) for record in recorded)
    assert volume.counts == {"scans": 0, "point_sets": 1239, "points": 4036, "pairs": 0}
    assert volume.dropped == {}


def nearest_occupied(tree, place):
    centres = tree.centres(tree.occupied().voxels())
    return float(np.linalg.norm(centres - place, axis=1).min())


@pytest.mark.parametrize("place", [(1.49, -0.26, -1.86), (2.05, 1.65, 2.55)])
def test_what_always_answers_is_occupied(volume, place):
    # the median of a cluster of more than a thousand echoes
    assert nearest_occupied(volume.fused, place) < 0.15


def test_what_was_taken_away_is_free_again(volume):
    # something stood 0.99 m ahead for the first quarter of the minute, then at 1.98 m
    assert nearest_occupied(volume.fused, (1.97, -0.21, 0.03)) < 0.1
    centres = volume.fused.centres(volume.fused.occupied().voxels())
    ahead = np.abs(centres - (0.99, -0.1, 0.01)).max(axis=1) < 0.06
    assert not ahead.any()


def test_the_space_between_sensor_and_target_is_free(volume):
    beam = np.linspace((0.1, -0.01, 0.0), (1.5, -0.16, 0.02), 40)
    assert (volume.fused.log_odds_at(beam) < 0.0).mean() > 0.9


def test_its_files_come_back(volume, tmp_path):
    paths = write_volume(volume.fused, tmp_path)
    assert [path.name for path in paths] == list(VOLUME_FILES)
    voxels = volume.fused.leaves().voxels()
    again = load_volume(tmp_path / "volume.npz").leaves().voxels()
    assert np.array_equal(again.codes, voxels.codes)
    assert np.array_equal(again.log_odds, voxels.log_odds)
    assert (tmp_path / "volume.bt").read_bytes().endswith(b"\ndata\n" + most_likely(volume.fused).binary())
