"""Sonar of real recordings, where they are at hand."""

import numpy as np
import pytest

from glassslam.errors import RecordingError, UsageError
from glassslam.records import LaserScan, PointSet, RangeRing
from glassslam.sources import SourceOptions, open_recording
from glassslam.sources.inspection import inspect_recording
from glassslam.sources.pimap import read_pimap
from glassslam.sources.sonarfile import open_sonar

TIAGO_RING = """
field_of_view_deg: 28.6
range_min: 0.02
range_max: 1.0
sonars: [[-0.25, 0.1, 150], [-0.28, 0.0, 180], [-0.25, -0.1, -150]]
"""


@pytest.fixture
def hallway(data_dir):
    folder = data_dir / "pimap"
    return open_recording(folder / "scene4.bag", SourceOptions(sonar=folder / "scene4_sonar.txt"))


def test_the_hallway_with_sonar(hallway):
    records = list(hallway.records())
    sweeps = np.array([record.ranges for record in records if isinstance(record, RangeRing)])
    assert hallway.info.sonar_ring.name == "pioneer-3dx"
    assert (sum(isinstance(record, LaserScan) for record in records), sweeps.shape) == (1264, (2024, 16))
    # one of eight sonars of an array fires every 40 ms, and a line is written every 100 ms
    assert 1.0 - np.isnan(sweeps).mean() == pytest.approx(100 / 320, abs=0.05)
    assert np.isinf(sweeps).mean() == pytest.approx(0.12, abs=0.01)
    # all silent for a second: the sonars were switched on after the log was
    assert np.isnan(sweeps[:12]).all()
    assert (hallway.dropped, hallway.warnings) == ({}, [])


def test_scans_come_as_without_sonar(hallway, data_dir):
    alone = open_recording(data_dir / "pimap" / "scene4.bag").records()
    merged = (record for record in hallway.records() if isinstance(record, LaserScan))
    for a, b in zip(alone, merged, strict=True):
        assert (a.stamp, a.record_stamp, a.range_max) == (b.stamp, b.record_stamp, b.range_max)
        np.testing.assert_array_equal(a.ranges, b.ranges)


@pytest.mark.parametrize("scene", range(1, 9))
def test_every_pioneer_fires_in_320_ms(data_dir, scene):
    path = data_dir / "pimap" / f"scene{scene}_sonar.txt"
    (found,) = inspect_recording(path).sonars
    assert (found.sonars, found.ring, found.limit) == (16, "pioneer-3dx", 5.0)
    assert found.cycle == pytest.approx(0.32, abs=0.001)
    assert found.rate == pytest.approx(10.0, abs=0.01)
    assert 0.70 < found.shares["not_new"] < 0.74


def test_ticks_are_the_stamps_of_scan_headers(data_dir):
    """Not the times at which scans were recorded, which are 0.17 s later and jitter."""
    folder = data_dir / "pimap"
    scans = [r for r in open_recording(folder / "scene4.bag").records() if isinstance(r, LaserScan)]
    ticks = np.unique(read_pimap(folder / "scene4_pose.txt").times)

    def lag(times):
        near = np.clip(np.searchsorted(times, ticks), 1, times.size - 1)
        before = np.abs(times[near - 1] - ticks) < np.abs(times[near] - ticks)
        return ticks - times[near - before]

    headers = lag(np.array([scan.stamp for scan in scans]))
    assert np.median(headers) == pytest.approx(scans[0].time_increment * 359, abs=1e-5)
    assert np.ptp(headers) < 3e-5
    assert np.ptp(lag(np.array([scan.record_stamp for scan in scans]))) > 4e-4
    assert len(ticks) == 1179


def test_sweeps_were_written_at_a_steady_rate(data_dir):
    folder = data_dir / "pimap"
    times = read_pimap(folder / "scene4_sonar.txt").sweep_times
    np.testing.assert_allclose(np.diff(times), 0.1, atol=1e-5)
    stamps = [r.stamp for r in open_recording(folder / "scene4.bag").records() if isinstance(r, LaserScan)]
    assert stamps[0] < times[0] < times[-1] < stamps[-1]


def test_other_scenes_are_of_other_days(data_dir):
    folder = data_dir / "pimap"
    with pytest.raises(RecordingError, match="do not overlap in time"):
        open_recording(folder / "scene4.bag", SourceOptions(sonar=folder / "scene1_sonar.txt"))


def test_tiago_ranges_need_a_ring(data_dir, tmp_path):
    path = data_dir / "tiago" / "sonar.bag"
    with pytest.raises(UsageError, match="no transform from a base frame to the sonars base_sonar_01_link, "):
        open_sonar(path, SourceOptions())
    ring = tmp_path / "tiago.yaml"
    ring.write_text(TIAGO_RING)
    sonar = open_sonar(path, SourceOptions(sonar_ring=ring))
    dropped = []
    sweeps = np.array([record.ranges for record in sonar.records(dropped.append)])
    assert (sonar.ring.name, sonar.topics, dropped) == ("tiago", ("/sonar_base",), [])
    assert np.count_nonzero(~np.isnan(sweeps)) <= 609
    assert np.isinf(sweeps).any(axis=0).all()
    assert np.nanmin(sweeps) == pytest.approx(0.46)
    # the robot stands; after seconds without any change ranges no longer count as new
    assert 0.2 < np.isnan(sweeps).mean() < 0.95


@pytest.mark.parametrize(("name", "count", "points"), [("test.bag", 1239, 3.3), ("ts_scans.bag", 17, 31.0)])
def test_toposens_points(data_dir, name, count, points):
    sonar = open_sonar(data_dir / "toposens" / name, SourceOptions())
    sets = list(sonar.records(pytest.fail))
    assert {type(record) for record in sets} == {PointSet}
    assert len(sets) == count
    assert np.mean([len(record.points) for record in sets]) == pytest.approx(points, abs=0.1)
    distances = np.concatenate([np.linalg.norm(record.points, axis=1) for record in sets])
    assert 0.2 < distances.min() < distances.max() < 6.0
    assert sonar.ring is None
    assert "toposens" in sonar.warnings[0]


def test_a_radar_is_no_sonar(data_dir):
    bag = data_dir / "sick" / "rms_1xxx_lms_1xx_movement_off.bag"
    if not bag.is_file():
        pytest.skip(f"{bag} is absent")
    info = open_recording(bag).info
    assert (info.sonar_ring, info.sonar_topics, info.points_topics) == (None, (), ())
