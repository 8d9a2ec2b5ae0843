"""What the tests of fusion share: rings and sweeps at given poses."""

import math

import numpy as np

from glassslam.records import SonarRing
from glassslam.sonar.sweeps import SonarSweeps

LEFT, RIGHT = 0.5 * math.pi, -0.5 * math.pi


def ring(*yaws, range_min=0.02, range_max=5.0):
    """Sonars in the centre of the base that look along the given yaws."""
    poses = np.array([(0.0, 0.0, yaw) for yaw in yaws])
    return SonarRing(poses, math.radians(20.0), range_min, range_max, "test")


def sweeps(poses, sonars, ranges=None):
    poses = np.array(poses, dtype=np.float64).reshape(-1, 3)
    shape = (len(poses), len(sonars.poses))
    ranges = np.full(shape, np.nan) if ranges is None else np.array(ranges, dtype=np.float64).reshape(shape)
    return SonarSweeps(np.arange(len(poses), dtype=np.float64), ranges, sonars, poses)


def drawn(probability, values):
    """A map as text, the highest y on top, by the sign of the value nearest to each cell."""
    signs, levels = list(values), np.array(list(values.values()))
    return [
        "".join("?" if np.isnan(p) else signs[int(np.abs(levels - p).argmin())] for p in row)
        for row in probability[::-1]
    ]
