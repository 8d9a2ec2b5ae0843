"""Scans of tiny worlds: a wall square to the sensor, a pane as measured, things that shine."""

import math

import numpy as np

from detectors.calibration import Calibration
from detectors.diffuse import DiffuseCurve

STEP = math.radians(0.25)
FLAT = DiffuseCurve((1.0, 5.0), (4000.0, 4000.0))
SENSOR = Calibration("flat", FLAT, beams=721, angle_increment=STEP)


def bearings(half_deg=90.0, step=STEP):
    count = 2 * round(math.radians(half_deg) / step) + 1
    return (np.arange(count) - count // 2) * step


def wall(distance=1.2, half_deg=90.0, normal=0.0, level=1.0):
    """Ranges and intensities of an endless matte wall; nothing beyond 75 deg from its normal."""
    angles = bearings(half_deg) - normal
    seen = np.abs(angles) < math.radians(75.0)
    ranges = np.where(seen, distance / np.cos(np.where(seen, angles, 0.0)), np.inf)
    return ranges, np.where(seen, 4000.0 * level, 0.0)


def pane(distance=1.2, half_deg=90.0, normal=0.0, seed=0, noise=0.01, behind=np.inf, reach_deg=28.0):
    """A pane as in a real corridor: haze that halves every 5.3 deg, a mirror peak, an end to both."""
    angles = bearings(half_deg) - normal
    random = np.random.default_rng(seed)
    answers = np.abs(angles) < math.radians(reach_deg)
    ranges = np.where(answers, distance / np.cos(np.where(answers, angles, 0.0)), behind)
    ranges = ranges + np.where(answers, noise * random.standard_normal(angles.size), 0.0)
    level = 0.8 * np.exp(-7.5 * np.abs(angles)) + 4.0 * np.exp(-((angles / math.radians(0.5)) ** 2))
    level = level * np.exp(0.1 * random.standard_normal(angles.size))
    matte = np.where(np.isfinite(ranges), 4000.0, 0.0)
    return ranges, np.where(answers, 4000.0 * level, matte)


def inside(low_deg, high_deg, half_deg=90.0):
    """Mask of the beams between two bearings, deg."""
    degrees = np.degrees(bearings(half_deg))
    return (degrees >= low_deg) & (degrees <= high_deg)
