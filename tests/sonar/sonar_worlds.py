"""Tiny worlds for sonars: rings, drives past a wall, and naive twins of the cone kernels."""

import math

import numpy as np

from glassslam.records import SonarRing
from glassslam.sonar.sweeps import SonarSweeps

LEFT, RIGHT = 0.5 * math.pi, -0.5 * math.pi


def ring(*yaws, fov_deg=30.0, offset=0.0, range_min=0.1, range_max=5.0):
    """Sonars that look along the given yaws, `offset` m from the centre."""
    poses = [(offset * math.cos(yaw), offset * math.sin(yaw), yaw) for yaw in yaws]
    return SonarRing(np.array(poses), math.radians(fov_deg), range_min, range_max, "test")


def sweeps(ranges, sonars, poses=None, stamps=None):
    ranges = np.atleast_2d(np.array(ranges, dtype=np.float64))
    poses = np.zeros((len(ranges), 3)) if poses is None else np.array(poses, dtype=np.float64)
    stamps = 0.1 * np.arange(len(ranges)) if stamps is None else np.array(stamps, dtype=np.float64)
    return SonarSweeps(stamps, ranges, sonars, poses)


def naive_belief(x, y, reading, half_width):
    """What a reading (x, y, yaw, free, obstacle, thickness) says of a point, by its definition."""
    sx, sy, yaw, free, obstacle, thickness = reading
    distance = math.hypot(x - sx, y - sy)
    angle = math.remainder(math.atan2(y - sy, x - sx) - yaw, 2.0 * math.pi)
    if abs(angle) >= half_width:
        return 0.0
    lobe = 1.0 - (angle / half_width) ** 2
    if obstacle >= 0 and abs(distance - obstacle) < thickness:
        return lobe * (1.0 - ((distance - obstacle) / thickness) ** 2)
    return -lobe * (1.0 - (distance / free) ** 2) if distance < free else 0.0


def naive_beliefs(readings, half_width, shape):
    """Beliefs of all readings in all cells, shape (k, rows, columns)."""
    rows, columns = shape
    return np.array(
        [
            [
                [naive_belief(c + 0.5, r + 0.5, reading, half_width) for c in range(columns)]
                for r in range(rows)
            ]
            for reading in readings
        ]
    )
