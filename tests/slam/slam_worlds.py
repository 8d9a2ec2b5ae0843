"""Tiny worlds a simulated lidar looks at, and runs through them."""

import itertools
from dataclasses import replace

import numpy as np

from glassslam.config import Config
from glassslam.geometry import between, compose
from glassslam.records import LaserScan, Odometry
from glassslam.simulation.raycast import SegmentGrid
from glassslam.slam.extrapolator import Prediction
from glassslam.slam.range_data import prepare


def polygon(*corners):
    """Segments (n, 4) of a closed line."""
    ends = np.array(corners, dtype=np.float64)
    return np.hstack((ends, np.roll(ends, -1, axis=0)))


def box(x, y, width, height):
    """Segments of a rectangle by its lower left corner and size."""
    return polygon((x, y), (x + width, y), (x + width, y + height), (x, y + height))


ROOM = np.vstack((box(0, 0, 8, 5), box(3, 2.2, 1, 0.6), box(6.2, 0.8, 0.5, 0.5), box(0, 3.6, 0.6, 0.8)))
"""8 x 5 m with a table, a pillar and a cupboard: looks the same from nowhere else."""

CORRIDOR = np.array([[-30.0, 0, 30, 0], [-30, 2, 30, 2]])
"""60 m of two bare walls, 2 m apart: looks the same all along."""

RING = np.vstack(
    (
        box(0, 0, 16, 12),
        box(2.5, 2.5, 11, 7),
        box(5, 2.2, 0.8, 0.3),
        box(15.6, 4, 0.4, 1.2),
        box(9, 11.5, 1.5, 0.5),
        box(2.5, 6, -0.4, 0.7),
    )
)
"""A corridor 2.5 m wide around a core of 11 x 7 m, with a niche or two on every side."""


class Lidar:
    """A lidar that sees a world of segments all around."""

    def __init__(self, world, *, beams=360, noise=0.01, seed=0, reach=30.0):
        self._grid = SegmentGrid.build(world)
        self._random = np.random.default_rng(seed)
        self.beams, self._noise, self._reach = beams, noise, reach
        self._bearings = -np.pi + np.arange(beams) * 2 * np.pi / beams

    def look(self, stamp, pose, *, twist=None, sweep=0.0):
        """A scan from a base pose; during the sweep, s, the base moves on with a twist."""
        share = np.arange(self.beams) / (self.beams - 1) * sweep
        moved = np.zeros((self.beams, 3)) if twist is None else share[:, None] * np.asarray(twist)
        origins = compose(np.asarray(pose, dtype=np.float64), moved)
        hits = self._grid.cast(origins[:, :2], origins[:, 2] + self._bearings)
        ranges = hits.distance + self._random.normal(0.0, self._noise, self.beams)
        return LaserScan(
            stamp=stamp,
            ranges=ranges.astype(np.float32),
            angle_min=-np.pi,
            angle_increment=2 * np.pi / self.beams,
            range_min=0.05,
            range_max=self._reach,
            time_increment=sweep / (self.beams - 1),
        )


def drive(*corners, step=0.05):
    """Poses along straight lines between corners, turning on the spot by at most 6 deg per scan."""
    points = np.array(corners, dtype=np.float64)
    poses, heading = [], None
    for a, b in itertools.pairwise(points):
        along = b - a
        goal = np.arctan2(along[1], along[0])
        if heading is not None:
            turn = (goal - heading + np.pi) % (2 * np.pi) - np.pi
            count = int(np.ceil(abs(turn) / 0.1))
            poses += [[*a, heading + turn * k / count] for k in range(1, count)]
        count = int(np.ceil(np.hypot(*along) / step))
        poses += [[*(a + along * k / count), goal] for k in range(count)]
        heading = goal
    return np.array(poses)


def round_trip(turns=1.15):
    """Poses along the middle of the corridor of RING."""
    corners = [(1.25, 1.25), (14.75, 1.25), (14.75, 10.75), (1.25, 10.75)]
    poses = drive(*corners, corners[0], corners[1])
    once = len(drive(*corners, corners[0]))
    return poses[: int(turns * once)]


def odometry(poses, *, scale=1.0, drift=0.0):
    """What wheels make of true poses: lengths off by a factor, headings off by rad per metre."""
    steps = between(poses[:-1], poses[1:])
    length = np.hypot(steps[:, 0], steps[:, 1])
    out = [np.zeros(3)]
    for step, metres in zip(steps, length, strict=True):
        wrong = np.array([step[0] * scale, step[1] * scale, step[2] + drift * metres])
        out.append(compose(out[-1], wrong))
    return np.array(out)


def recording(world, poses, wheels=None, *, period=0.1, seed=0, beams=360, start=100.0):
    """Records of a run: for every pose odometry, if there is any, and then the scan."""
    lidar = Lidar(world, seed=seed, beams=beams)
    records = []
    for k, pose in enumerate(poses):
        stamp = start + k * period
        if wheels is not None:
            records.append(Odometry(stamp, tuple(float(v) for v in wheels[k])))
        records.append(lidar.look(stamp, pose))
    return records


def range_data(scan, twist=(0.0, 0.0, 0.0)):
    """A scan made ready with the laser at the base."""
    return prepare(scan, np.zeros(3), np.array(twist, dtype=np.float64), Config().sensor)


def prediction(pose, **changes):
    """What the extrapolator says of a robot that stands."""
    plain = Prediction(np.array(pose, dtype=np.float64), 0.0, 0.0, np.zeros(3), None, True, False)
    return replace(plain, **changes)


def in_first_frame(poses):
    """Poses seen from the first one, as a mapper that starts at zero estimates them."""
    return between(poses[0], poses)
