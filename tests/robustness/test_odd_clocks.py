"""Header stamps of one clock, record stamps of another, as where two computers record."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parents[1] / "sources"))
from tiny_bags import T0, odom, scan, write_ros1

from glassslam import map_recording
from glassslam.cli import main

BEAMS = np.tile([2.0, 2.5, 3.0], 30)
ANGLES = {"angle_min": -1.5, "angle_max": 1.5, "angle_increment": 3.0 / 89}


def bag(path, headers):
    """A creeping robot; `headers` gives the header stamp of a scan recorded at a time."""
    drive = [
        message
        for k in range(20)
        for message in (
            odom(k / 10, 0.05 * k),
            scan(k / 10 + 0.01, BEAMS, stamp=headers(T0 + k / 10 + 0.01), **ANGLES),
        )
    ]
    return write_ros1(path, drive)


@pytest.mark.parametrize("ahead", [-86400.0, -3600.0, -0.17, 0.5, 3600.0])
def test_the_order_of_the_file_counts_and_the_difference_is_told(tmp_path, ahead, capsys):
    path = bag(tmp_path / "run.bag", lambda at: at + ahead)
    result = map_recording(path)
    assert len(result.trajectory.stamps) == 20
    np.testing.assert_allclose(result.trajectory.stamps[0], T0 + 0.01 + ahead, atol=1e-3)
    assert np.isfinite(result.trajectory.poses).all()
    assert main(["inspect", str(path), "--json"]) == 0
    (told,) = json.loads(capsys.readouterr().out)["scans"]
    assert told["stamps"]["offset"] == pytest.approx(-ahead, abs=1e-3)
    another_clock = any("clock" in warning for warning in result.statistics.warnings)
    assert another_clock == (abs(ahead) > 1.0)


@pytest.mark.parametrize("value", [0.0, 1.0, 2e9])
def test_a_clock_that_stands(tmp_path, value):
    result = map_recording(bag(tmp_path / "run.bag", lambda _: value))
    assert len(result.trajectory.stamps) == 20
    assert np.isfinite(result.trajectory.poses).all()


def test_a_gap_of_a_month_in_the_record_times(tmp_path):
    drive = [
        scan(k / 10 + 2_592_000.0 * (k >= 10), BEAMS, stamp=T0 + k / 10 + 2_592_000.0 * (k >= 10), **ANGLES)
        for k in range(20)
    ]
    result = map_recording(write_ros1(tmp_path / "run.bag", drive))
    assert len(result.trajectory.stamps) == 20
