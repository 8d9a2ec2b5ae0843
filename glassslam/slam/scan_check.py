"""Which scans can be used, and what drivers write into their headers that has to be mended first."""

import math
from dataclasses import replace

import numpy as np

from glassslam.errors import RecordingError
from glassslam.records import Float32Array, FloatArray, LaserScan

_LONGEST_SWEEP = 1.0
_FARTHEST_MOUNT = 100.0


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


def checked_mount(base_from_laser: object) -> FloatArray:
    """Pose of the laser on the robot, shape (3,), m and rad.

    Raises
    ------
    RecordingError
        It is no pose, or lies off every robot.
    """
    pose = np.array(base_from_laser, dtype=np.float64)
    if pose.shape != (3,) or not np.isfinite(pose).all() or np.abs(pose[:2]).max() > _FARTHEST_MOUNT:
        raise RecordingError(
            f"the laser cannot sit at {', '.join(f'{value:.3g}' for value in pose.ravel()[:3])}",
            f"say where it is, within {_FARTHEST_MOUNT:g} m of the robot's centre: --laser-pose x,y,yaw",
        )
    return pose


def sweep_time(scan: LaserScan) -> float:
    """Time from the first to the last beam, s."""
    return scan.time_increment * (len(scan.ranges) - 1)


def mended(scan: LaserScan) -> LaserScan:
    """The scan with ranges as the kernels read them and without senseless times and limits.

    A time between beams that is not finite, or makes a sweep of more than a second (a header in
    milliseconds), counts as unknown: undoing motion with it would tear the scan apart. A largest range
    that is not positive says nothing, and neither do intensities that are not one for each beam. Single
    intensities that are not finite count as none at all: as peaks they would be glass.
    """
    ranges = np.ascontiguousarray(scan.ranges, dtype=np.float32)
    sound_time = math.isfinite(scan.time_increment) and abs(sweep_time(scan)) <= _LONGEST_SWEEP
    sound_limit = scan.range_max > 0
    intensities = _mended_intensities(scan)
    sound_intensities = intensities is scan.intensities
    if ranges is scan.ranges and sound_time and sound_limit and sound_intensities:
        return scan
    return replace(
        scan,
        ranges=ranges,
        time_increment=scan.time_increment if sound_time else 0.0,
        range_max=scan.range_max if sound_limit else math.inf,
        intensities=intensities,
    )


def _mended_intensities(scan: LaserScan) -> Float32Array:
    if len(scan.intensities) != len(scan.ranges):
        return scan.intensities if len(scan.intensities) == 0 else scan.intensities[:0]
    finite = np.isfinite(scan.intensities)
    return scan.intensities if finite.all() else np.where(finite, scan.intensities, np.float32(0.0))
