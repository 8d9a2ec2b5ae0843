"""Recordings in, a calibration out: faced panes, panes in a map, matte walls, places without glass."""

import json
import math
import re

import numpy as np
import pytest
from pane_recordings import BEAMS, STEP, WALL, bearings, driving, scan_at, standing

from glassslam.calibration import Roi, Session, calibrate
from glassslam.errors import CalibrationError
from glassslam.simulation.rosbag1 import write_rosbag1


@pytest.fixture(scope="module")
def faced(tmp_path_factory):
    """The procedure of the paper: a pane at 1 m, then at 2 m, and a room without glass."""
    folder = tmp_path_factory.mktemp("faced")
    return calibrate(
        [
            Session(standing(folder / "one.bag", 1.0), "glass", 1.0),
            Session(standing(folder / "two.bag", 2.0), "glass", 2.0),
            Session(standing(folder / "none.bag", 1.0, with_pane=False), "no-glass"),
        ],
        name="mine",
    )


def test_the_sensor_is_described(faced):
    made = faced.calibration
    assert (made.sensor, made.beams, made.date) == ("mine", BEAMS, "2020-09-13")
    assert made.angle_increment == pytest.approx(STEP, rel=1e-5)
    assert (made.range_min, made.range_max) == (pytest.approx(0.1), 30.0)
    assert made.diffuse.level(2.0) == pytest.approx(WALL, rel=0.03)
    assert made.detector == "calibrated_peak"
    assert made.saturation == math.inf


def test_the_pane_is_found_where_it_was_stated(faced):
    rows = [(row.recording, row.scans, row.with_surface, row.at_normal) for row in faced.recordings]
    assert rows == [("one.bag", 20, 20, 20), ("two.bag", 20, 20, 20), ("none.bag", 20, 0, 0)]
    assert [row.measured for row in faced.recordings] == [
        pytest.approx(1.0, abs=0.02), pytest.approx(2.0, abs=0.02), None,
    ]  # fmt: skip


def test_thresholds_lie_between_walls_and_panes(faced):
    assert faced.proven
    assert WALL < faced.calibration.thresh < 4.8 * WALL
    assert faced.calibration.pane.decay == pytest.approx(7.5, rel=0.15)
    assert faced.calibration.pane.haze == pytest.approx(0.8, rel=0.15)


def test_rates_rest_on_places_not_on_repetitions(faced):
    rates = faced.calibration.evidence["calibrated_peak"]
    assert (rates["detection"]["successes"], rates["detection"]["trials"]) == (40, 40)
    assert rates["detection"]["independent"] == 2
    assert rates["detection"]["low"] == pytest.approx(0.34, abs=0.01)
    assert rates["false_alarm"]["successes"] == 0
    assert rates["false_alarm"]["independent"] == 3
    assert [entry["to"] for entry in rates["by_distance"]] == [1.5, 3.0]


def test_the_user_is_told_how_little_that_is(faced):
    assert (
        "panes were tried from 2 places: of all panes seen squarely as few as 34% may be found"
        in faced.warnings
    )
    assert any(text.startswith("false alarms were counted at 3 places") for text in faced.warnings)


def test_the_evidence_names_the_recordings_without_their_folders(faced):
    evidence = faced.calibration.evidence
    assert evidence["recordings"] == ["one.bag", "two.bag", "none.bag"]
    assert evidence["sessions"][0]["distance"] == 1.0
    assert evidence["scans"] == 60


def test_a_pane_that_is_not_there(tmp_path):
    bag = standing(tmp_path / "run.bag", 1.0)
    with pytest.raises(CalibrationError) as caught:
        calibrate([Session(bag, "glass", 3.0)])
    stated, _, found = caught.value.message.partition("; ")
    assert stated == "run.bag: no pane of glass at 3 m (within 0.24 m) at bearings from -30 to 30 deg"
    assert re.fullmatch(r"the nearest return there is (0\.9\d|1\.00) m away", found)
    assert caught.value.exit_code == 1


def test_where_nothing_answers(tmp_path):
    bag = standing(tmp_path / "run.bag", 1.0)
    with pytest.raises(
        CalibrationError, match=r"no matte wall at 1 m .* in the box 9,9,10,10; nothing answers"
    ):
        calibrate([Session(bag, "matte", 1.0, roi=Roi.parse("9,9,10,10"))])


def test_a_wall_stated_as_glass_is_doubted(tmp_path):
    scans = [scan_at((2.0, 0.0, 0.0), seed=k) for k in range(10)]
    write_rosbag1(scans, tmp_path / "wall.bag")
    made = calibrate([Session(tmp_path / "wall.bag", "glass", 2.0)])
    assert any("as bright as a matte wall beside its normal: is it glass?" in text for text in made.warnings)
    assert any("has no mirror peak" in text for text in made.warnings)


def test_a_pane_never_faced_squarely_proves_nothing(tmp_path):
    angles = bearings(200, math.radians(6.0))
    scans = [scan_at((1.5, 0.0, 0.0), pane_x=2.5, seed=k, angles=angles) for k in range(10)]
    write_rosbag1(scans, tmp_path / "aside.bag")
    made = calibrate([Session(tmp_path / "aside.bag", "glass", 1.0, roi=Roi.parse("0:40"))])
    assert not made.proven
    assert (
        "aside.bag: no pane answers at normal incidence; the robot must face it squarely once"
        in made.warnings
    )
    assert (
        "no pane was seen: the thresholds are those of other sensors, unproven on this one" in made.warnings
    )
    assert (made.calibration.thresh, made.calibration.faint) == (0.0, 0.45)


def test_a_matte_wall_settles_the_curve_at_its_distance(tmp_path):
    scans = [scan_at((2.0, 0.0, 0.0), seed=k) for k in range(10)]
    dark = [scan_at((0.0, 0.0, 0.0), seed=k, matte=0.5) for k in range(10)]
    write_rosbag1(scans, tmp_path / "wall.bag")
    write_rosbag1(dark, tmp_path / "dark.bag")
    made = calibrate(
        [Session(tmp_path / "wall.bag", "matte", 2.0), Session(tmp_path / "dark.bag", "unknown")]
    )
    assert made.calibration.diffuse.level(2.1) == pytest.approx(WALL, rel=0.1)
    assert made.recordings[0].with_surface == 10
    assert not made.proven


def test_a_full_turn_that_begins_at_the_wall(tmp_path):
    angles = bearings(360, 0.0, math.radians(1.0))
    scans = [scan_at((2.0, 0.0, 0.0), seed=k, angles=angles) for k in range(10)]
    write_rosbag1(scans, tmp_path / "turn.bag")
    made = calibrate([Session(tmp_path / "turn.bag", "matte", 2.0)])
    assert made.recordings[0].measured == pytest.approx(2.0, abs=0.01)
    # both sides of the seam are seen
    assert np.count_nonzero(made.surfaces.incidences < math.radians(40)) > 0
    assert made.surfaces.ranges.size >= 10 * 80


def test_panes_of_a_map_are_carried_into_the_scans(tmp_path):
    bag = driving(tmp_path / "run.bag")
    # the map begins where the robot does: the pane is 2 m ahead of it
    pane = {"type": "LineString", "coordinates": [[2.0, -0.3], [2.0, 1.3]]}
    feature = {"type": "Feature", "properties": {"kind": "glass"}, "geometry": pane}
    path = tmp_path / "panes.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": [feature]}))
    made = calibrate([Session(bag, "glass", panes=path)])
    (row,) = made.recordings
    assert row.with_surface == row.at_normal == 60
    assert row.measured == pytest.approx(1.6, abs=0.05)
    assert made.calibration.evidence["calibrated_peak"]["detection"]["successes"] == 60
    assert made.calibration.pane.decay == pytest.approx(7.5, rel=0.15)


def test_a_file_without_panes(tmp_path):
    bag = standing(tmp_path / "run.bag")
    path = tmp_path / "none.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": []}))
    with pytest.raises(CalibrationError, match=r"none.geojson holds no pane"):
        calibrate([Session(bag, "glass", panes=path)])


def test_intensities_that_tell_nothing(tmp_path):
    bag = standing(tmp_path / "flat.bag", ceiling=1.0)
    with pytest.raises(CalibrationError, match=r"flat.bag: all intensities are 1"):
        calibrate([Session(bag)])


def test_a_saturated_lidar_is_calibrated_but_sees_no_glass(tmp_path):
    bag = standing(tmp_path / "bright.bag", ceiling=4000.0)
    made = calibrate([Session(bag)])
    assert (made.calibration.informative, made.calibration.detector) == (False, "off")
    assert made.calibration.saturation == 4000.0
    assert any("saturated at 4000; glass cannot be told by them" in text for text in made.warnings)


def test_mirror_peaks_cut_off_are_told(tmp_path):
    bag = standing(tmp_path / "cut.bag", ceiling=6000.0)
    made = calibrate([Session(bag, "glass", 1.0)])
    assert made.calibration.saturation == 6000.0
    assert "intensities saturate at 6000: 20 of 20 mirror peaks are cut off there" in made.warnings


def test_recordings_of_different_lidars(tmp_path):
    coarse = bearings(180, -math.pi / 2, math.radians(1.0))
    write_rosbag1([scan_at((0, 0, 0), angles=coarse)], tmp_path / "coarse.bag")
    with pytest.raises(CalibrationError) as caught:
        calibrate([Session(standing(tmp_path / "fine.bag")), Session(tmp_path / "coarse.bag")])
    assert caught.value.message == "fine.bag and coarse.bag are of different lidars: steps of 0.5 and 1 deg"
