"""Scans of matte walls and panes with intensities."""

import math

import numpy as np

from glassslam.records import LaserScan

FINE, COARSE = math.radians(0.25), math.radians(1.0)


def scan(ranges, intensities, step, stamp=0.0, **changes):
    """One scan of the half plane ahead, or as much of it as there are ranges."""
    return LaserScan(
        stamp, np.asarray(ranges, dtype=np.float32), -0.5 * step * (len(ranges) - 1), step, 0.05, 30.0,
        intensities=np.asarray(intensities, dtype=np.float32), **changes,
    )  # fmt: skip


def walls(step, *, count):
    """Scans from the middle of a square room with matte walls of level 4000."""
    random = np.random.default_rng(0)
    half_beams = round(math.radians(100.0) / step)
    bearings = np.arange(-half_beams, half_beams + 1) * step
    out = []
    for k in range(count):
        half = 2.0 + 0.02 * k
        ranges = half / np.maximum(np.abs(np.cos(bearings)), np.abs(np.sin(bearings)))
        ranges = ranges + random.normal(0.0, 0.003, ranges.size)
        echoes = 4000.0 * (1.0 + random.normal(0.0, 0.02, ranges.size))
        out.append(scan(ranges, echoes, step, stamp=0.1 * k))
    return out


def before_a_pane(step, *, count):
    """The same room, with a pane that fills 60 degrees of the view ahead, 1.5 m away."""
    out = []
    for one in walls(step, count=count):
        bearings = one.angle_min + step * np.arange(len(one.ranges))
        on_pane = np.abs(bearings) < math.radians(30.0)
        away = np.abs(bearings)
        echoes = 4000.0 * (0.8 * np.exp(-6.5 * away) + 4.0 * (away < 0.6 * step))
        out.append(
            scan(
                np.where(on_pane, 1.5 / np.cos(bearings), one.ranges),
                np.where(on_pane, echoes, one.intensities),
                step,
                stamp=one.stamp,
            )
        )
    return out
