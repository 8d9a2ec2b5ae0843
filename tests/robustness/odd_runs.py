"""Short runs through a room, and what a mapper makes of them when they are made odd."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).parents[1] / "slam"))
from slam_worlds import ROOM, drive, odometry, recording

from glassslam.config import Config
from glassslam.records import LaserScan
from glassslam.slam.mapper import Mapper

PATH = drive((1.2, 0.8), (4.5, 0.8))


def plain(world=ROOM, beams=360, wheels=True):
    """Records of a drive of 3 m."""
    return recording(world, PATH, odometry(PATH, scale=1.01) if wheels else None, beams=beams)


def run(records, **sections):
    """The result of mapping records with some parameters."""
    mapper = Mapper(Config.from_mapping(sections))
    try:
        for record in records:
            mapper.add(record)
        return mapper.finish()
    finally:
        mapper.close()


def changed(records, change):
    """The records with every k-th scan replaced by `change(k, scan)`."""
    out, count = [], 0
    for record in records:
        if isinstance(record, LaserScan):
            out.append(change(count, record))
            count += 1
        else:
            out.append(record)
    return out


def with_intensities(scan, values):
    """The scan with an echo strength for every beam."""
    return replace(scan, intensities=np.asarray(values, dtype=np.float32))


def is_whole(result):
    """Whether poses and map are finite numbers, with some wall in the map."""
    known = result.map.probability[np.isfinite(result.map.probability)]
    return bool(np.isfinite(result.trajectory.poses).all() and (known > 0.65).any())


def length(result):
    """Travelled distance, m."""
    steps = np.diff(result.trajectory.poses[:, :2], axis=0)
    return float(np.hypot(*steps.T).sum())
