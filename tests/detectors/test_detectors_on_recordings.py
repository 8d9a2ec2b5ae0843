"""The detectors on real recordings: known panes are found, and nothing where no glass is known."""

import itertools
import json
import math

import numpy as np
import pytest

from detectors.calibrated_peak import calibrated_peak
from detectors.intensity_peak import intensity_peak
from detectors.narrow_return import narrow_return
from detectors.profiles import load_profile
from detectors.self_calibration import self_calibration
from glassslam.records import LaserScan, Odometry
from glassslam.sources import open_recording

MULLION = 0.1
# header stamps and poses of the pi-map hallway were taken by different clocks, s
PIMAP_LAG = -0.13


def read(path):
    scans, poses = [], []
    for record in open_recording(path).records():
        if isinstance(record, LaserScan):
            scans.append(record)
        elif isinstance(record, Odometry):
            poses.append(record.pose)
    return scans, np.array(poses)


def detect(scan, calibration):
    return calibrated_peak(
        scan.ranges,
        scan.intensities,
        scan.angle_min,
        scan.angle_increment,
        calibration=calibration,
        no_echo=scan.range_max,
    )


def panes(data_dir, run):
    """(line x = a y + b, first y, last y) of every pane, mullions cut out."""
    truth = json.loads((data_dir / "glass_corridor" / "glass_line_approx.json").read_text())
    for row in truth["runs"][run]:
        ends = [row["y_from"], *row["mullions_y"], row["y_to"]]
        for k, (low, high) in enumerate(itertools.pairwise(ends)):
            yield row["x_of_y"], low + MULLION * (k > 0), high - MULLION * (k < len(ends) - 2)


def test_the_panes_of_a_corridor_are_found_with_a_calibration_from_other_runs(data_dir):
    scans, poses = read(data_dir / "glass_corridor" / "57068e0c49.bag")
    rows = []
    for scan, (x, y, theta) in zip(scans, poses, strict=True):
        found = detect(scan, load_profile("utm30lx"))
        c, s = math.cos(theta), math.sin(theta)
        ends = found.positions @ np.array([[c, s], [-s, c]]) + (x, y)
        rows.append(np.column_stack((ends, found.extent, found.probability)))
    observed = np.concatenate(rows)
    on_glass = np.zeros(len(observed), dtype=bool)
    covered = total = 0.0
    for (slope, offset), low, high in panes(data_dir, "57068e0c49"):
        near = np.abs(observed[:, 0] - slope * observed[:, 1] - offset) < 0.1
        on_glass |= near & (observed[:, 1] > low - 0.15) & (observed[:, 1] < high + 0.15)
        places = np.arange(low, high, 0.01)[:, None]
        pieces = observed[near & (observed[:, 3] > 0.5)]
        covered += 0.01 * (np.abs(places - pieces[:, 1]) <= pieces[:, 2]).any(axis=1).sum()
        total += high - low
    assert covered / total > 0.97
    assert on_glass.all()


@pytest.mark.parametrize(
    ("path", "profile"),
    [
        ("glass_corridor/ade451af16.bag", "utm30lx"),
        ("glass_corridor/fd2df1b87f.bag", "utm30lx"),
        ("museum/b0-2014-07-21-12-42-53-tiny.bag", "utm30lx"),
        ("ust10lx/localization_bag1_2022-03-29-19-23-29.bag", "ust10lx"),
        ("sick/20210125-tim781s-scandata.bag", "tim781"),
        ("sick/20210301_lms511.bag", "lms511"),
    ],
)
def test_no_glass_where_none_is_known(data_dir, path, profile):
    scans, _ = read(data_dir / path)
    assert sum(len(detect(scan, load_profile(profile))) for scan in scans) == 0


def test_plain_thresholds_do_not_transfer_between_sensors(data_dir):
    scans, _ = read(data_dir / "sick" / "20210125-tim781s-scandata.bag")
    hits = sum(
        len(
            intensity_peak(
                scan.ranges,
                scan.intensities,
                thresh=8000,
                grad=4000,
                width=5,
                angle_min=scan.angle_min,
                angle_increment=scan.angle_increment,
            )
        )
        for scan in scans
    )
    assert hits > 200


def test_a_recording_with_panes_calibrates_itself(data_dir):
    scans, _ = read(data_dir / "glass_corridor" / "67807dc50e.bag")
    pairs = [(scan.ranges, scan.intensities) for scan in scans]
    own = self_calibration("run", pairs, scans[0].angle_min, scans[0].angle_increment, range_max=30.0)
    profile = load_profile("utm30lx")
    for distance in (1.2, 2.0, 3.0):
        assert own.diffuse.level(distance) == pytest.approx(profile.diffuse.level(distance), rel=0.05)


def test_narrow_returns_of_a_real_glass_wall(data_dir):
    scans, _ = read(data_dir / "pimap" / "scene4.bag")
    text = np.loadtxt(data_dir / "pimap" / "scene4_pose.txt")
    stamps = text[:, 3] / 1e7 - 62135596800
    heading = np.unwrap(text[:, 6])
    rows = []
    for scan in scans:
        time = scan.stamp + PIMAP_LAG
        if not stamps[0] <= time <= stamps[-1]:
            continue
        x, y, theta = (np.interp(time, stamps, values) for values in (text[:, 4], text[:, 5], heading))
        found = narrow_return(scan.ranges, None, scan.angle_min, scan.angle_increment, range_min=0.15)
        turned = theta + found.bearing
        end_x, end_y = x + found.range * np.cos(turned), y + found.range * np.sin(turned)
        normal = np.abs((theta + found.normal - math.pi / 2 + math.pi) % (2 * math.pi) - math.pi)
        rows.append(np.column_stack((end_x, end_y - 1.22 - 0.0036 * end_x, normal, found.probability)))
    observed = np.concatenate(rows)
    true = (np.abs(observed[:, 1]) < 0.15) & (observed[:, 0] > 4.2) & (observed[:, 0] < 27.0)
    true &= observed[:, 2] < math.radians(8.0)
    assert true.sum() >= 110
    assert (~true).sum() <= 80
    assert np.std(observed[true, 2]) < math.radians(1.5)
    sure = observed[:, 3] > 0.7
    assert true[sure].mean() > 0.8


@pytest.mark.parametrize(
    "path",
    [
        "urg04/before1.bag",
        "tiago/scan_lidar.bag",
        "ust10lx/rosbag2_2026_03_07-23_31_14_0.db3",
        "wall/lidar_calibration_2m__0.mcap",
    ],
)
def test_no_narrow_return_of_glass_where_none_is_known(data_dir, path):
    scans, _ = read(data_dir / path)
    hits = 0
    for scan in scans:
        limits = {"no_echo": min(scan.range_max, 60.0), "range_min": max(scan.range_min, 0.05)}
        hits += len(narrow_return(scan.ranges, None, scan.angle_min, scan.angle_increment, **limits))
    assert hits == 0
