"""Which scans can be used, and what drivers write into their headers that has to be mended first."""

import math
from dataclasses import replace

import numpy as np

from glassslam.records import LaserScan

_LONGEST_SWEEP = 1.0


def defect(scan: LaserScan) -> str:
    """Why a scan cannot be used, as it is counted in the report; empty when it can."""
    if not math.isfinite(scan.stamp):
        return "stamp not finite"
    if len(scan.ranges) == 0:
        return "no beams"
    angles = (scan.angle_min, scan.angle_increment)
    if not all(map(math.isfinite, angles)) or scan.angle_increment == 0:
        return "angles not usable"
    return ""


def sweep_time(scan: LaserScan) -> float:
    """Time from the first to the last beam, s."""
    return scan.time_increment * (len(scan.ranges) - 1)


def mended(scan: LaserScan) -> LaserScan:
    """The scan with ranges as the kernels read them and without senseless times and limits.

    A time between beams that is not finite, or makes a sweep of more than a second (a header in
    milliseconds), counts as unknown: undoing motion with it would tear the scan apart. A largest range
    that is not positive says nothing.
    """
    ranges = np.ascontiguousarray(scan.ranges, dtype=np.float32)
    sound_time = math.isfinite(scan.time_increment) and abs(sweep_time(scan)) <= _LONGEST_SWEEP
    sound_limit = scan.range_max > 0
    if ranges is scan.ranges and sound_time and sound_limit:
        return scan
    return replace(
        scan,
        ranges=ranges,
        time_increment=scan.time_increment if sound_time else 0.0,
        range_max=scan.range_max if sound_limit else math.inf,
    )
