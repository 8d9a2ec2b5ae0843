"""Recordings of a lidar in a matte room of 8 m x 6 m that faces a pane of 1.6 m, or none."""

import math

import numpy as np

from glassslam.records import LaserScan, Odometry
from glassslam.simulation.rosbag1 import write_rosbag1

STEP = math.radians(0.5)
BEAMS = 541
FIRST = math.radians(-135.0)
WALL = 4000.0
T0 = 1_600_000_000.0


def bearings(count=BEAMS, first=FIRST, step=STEP):
    return first + step * np.arange(count)


def room(angles, pose):
    """Ranges from inside a room of x -4..4 and y -3..3."""
    x, y, theta = pose
    c, s = np.cos(angles + theta), np.sin(angles + theta)
    with np.errstate(divide="ignore"):
        along_x = np.where(c > 0, 4.0 - x, 4.0 + x) / np.abs(c)
        along_y = np.where(s > 0, 3.0 - y, 3.0 + y) / np.abs(s)
    return np.minimum(along_x, along_y)


def scan_at(pose, *, pane_x=None, seed=0, stamp=T0, angles=None, matte=1.0, peak=4.0, ceiling=math.inf):
    """A scan in the room; a pane stands at x = `pane_x`, y from -0.8 to 0.8, and answers near its normal."""
    random = np.random.default_rng(seed)
    angles = bearings() if angles is None else angles
    ranges = room(angles, pose)
    levels = matte * np.exp(0.03 * random.standard_normal(angles.size))
    if pane_x is not None:
        phi = (angles + pose[2] + np.pi) % (2 * np.pi) - np.pi
        ahead = np.abs(phi) < math.radians(28.0)
        distance = (pane_x - pose[0]) / np.cos(np.where(ahead, phi, 0.0))
        hit = ahead & (np.abs(pose[1] + distance * np.sin(phi)) < 0.8)
        ranges = np.where(hit, distance, ranges)
        lobe = 0.8 * np.exp(-7.5 * np.abs(phi)) + peak * np.exp(-((phi / math.radians(0.5)) ** 2))
        levels = np.where(hit, lobe * np.exp(0.1 * random.standard_normal(angles.size)), levels)
    noise = 0.005 * random.standard_normal(angles.size)
    return LaserScan(
        stamp,
        (ranges + noise).astype(np.float32),
        float(angles[0]),
        float(angles[1] - angles[0]),
        0.1,
        30.0,
        intensities=np.minimum(np.round(WALL * levels), ceiling).astype(np.float32),
    )


def standing(path, distance=1.0, *, count=20, with_pane=True, **changes):
    """A recording of a robot that stands and faces a pane at a distance."""
    pane_x = 2.5 if with_pane else None
    pose = (2.5 - distance, 0.0, 0.0)
    scans = [scan_at(pose, pane_x=pane_x, seed=k, stamp=T0 + 0.1 * k, **changes) for k in range(count)]
    write_rosbag1(scans, path)
    return path


def driving(path, *, count=60, pane_x=2.5, start=(0.5, -0.5, 0.0), end=(1.3, 0.5, 0.0)):
    """A recording of a robot that drives past the pane, facing it, with odometry from its first pose."""
    records = []
    for k in range(count):
        share = k / (count - 1)
        pose = tuple(a + share * (b - a) for a, b in zip(start, end, strict=True))
        stamp = T0 + 0.1 * k
        records.append(Odometry(stamp, (pose[0] - start[0], pose[1] - start[1], pose[2] - start[2])))
        records.append(scan_at(pose, pane_x=pane_x, seed=k, stamp=stamp))
    write_rosbag1(records, path)
    return path
