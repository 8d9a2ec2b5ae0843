"""A lidar with errors in its beams, on its way through a hall."""

import math

import numpy as np

from glassslam.records import LaserScan

STEP = math.radians(1.0)
ANGLES = np.arange(360) * STEP
HALL = ((-4.0, -1.5), (5.0, -1.5), (5.0, 2.0), (-4.0, 2.0))
"""Corners of a hall of 9 x 3.5 m."""


def seen_from(pose, errors, corners=HALL):
    """Ranges that a lidar with errors in its beams measures in a room, one beam at a time."""
    x, y, heading = pose
    bearings = ANGLES + errors[0] * np.cos(ANGLES) + errors[1] * np.sin(ANGLES) + heading
    c, s = np.cos(bearings), np.sin(bearings)
    start_x, start_y = x - errors[2] * s, y + errors[2] * c
    ranges = np.full(len(ANGLES), np.inf)
    for (ax, ay), (bx, by) in zip(corners, (*corners[1:], corners[0]), strict=True):
        across = c * (by - ay) - s * (bx - ax) + 1e-12
        length = ((ax - start_x) * (by - ay) - (ay - start_y) * (bx - ax)) / across
        share = ((ax - start_x) * s - (ay - start_y) * c) / across
        met = (length > 0) & (share >= 0) & (share <= 1)
        ranges = np.where(met, np.minimum(ranges, length), ranges)
    return ranges - errors[3]


def walk(errors, noise=0.0, steps=30, turning=0.35):
    """Scans of a robot that goes along the hall."""
    random = np.random.default_rng(3)
    for k in range(steps):
        pose = (-3.0 + 6.5 * k / steps, 0.4 * math.sin(k), turning * math.sin(0.7 * k))
        ranges = seen_from(pose, errors) + random.normal(0.0, noise, 360)
        yield LaserScan(0.2 * k, ranges.astype(np.float32), 0.0, STEP, 0.1, 12.0)
