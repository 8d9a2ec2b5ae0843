"""Tiny worlds of panes and posts, and what a lidar that drives past them reports."""

import math

import numpy as np

from glassslam.config import GlassWallConfig
from glassslam.geometry import compose, inverse, transform_points
from glassslam.glass.observations import GlassObservations
from glassslam.glass.walls import BeamEvidence, Beams, fit_walls

CONFIG = GlassWallConfig(min_nodes=2)


class World:
    """Nodes, observations and beams, entered in the map frame and kept in that of their nodes."""

    def __init__(self, poses):
        self.poses = np.array(poses, dtype=np.float64)
        self._seen = []
        self._returns = [[] for _ in self.poses]
        self._silent = [[] for _ in self.poses]

    def see(
        self, node, point, normal, *, probability=0.8, extent=0.05, sigma=0.02, normal_sigma=0.02, kind=0
    ):
        """A node observes a piece of glass."""
        pose = inverse(self.poses[node])
        x, y, turned = compose(pose, np.array([*point, normal]))
        self._seen.append((node, x, y, turned, probability, sigma, normal_sigma, extent, kind))

    def hit(self, node, *points):
        """Beams of a node end on a surface."""
        self._returns[node] += [self._local(node, point) for point in points]

    def look(self, node, *points):
        """Beams of a node end in free space."""
        self._silent[node] += [self._local(node, point) for point in points]

    def _local(self, node, point):
        return transform_points(inverse(self.poses[node]), np.array([point], dtype=np.float64))[0]

    @property
    def observations(self):
        rows = np.array(self._seen).reshape(-1, 9)
        return GlassObservations(
            rows[:, 0].astype(np.int64),
            rows[:, 1:3].copy(),
            rows[:, 3].copy(),
            np.zeros((len(rows), 2)),
            np.ones(len(rows)),
            rows[:, 4].copy(),
            rows[:, 5].copy(),
            rows[:, 6].copy(),
            rows[:, 7].copy(),
            rows[:, 8].astype(np.uint8),
        )

    @property
    def beams(self):
        sensors = [np.zeros(2) for _ in self.poses]
        packed = [
            Beams.pack(sensors, [np.array(ends, dtype=np.float32).reshape(-1, 2) for ends in kind])
            for kind in (self._returns, self._silent)
        ]
        return BeamEvidence(*packed)

    def walls(self, poses=None, config=CONFIG):
        return fit_walls(self.observations, self.poses if poses is None else poses, self.beams, config)


def drive(start=0.0, end=10.0, step=0.5, y=0.0):
    """Nodes along x, heading east."""
    xs = np.arange(start, end + 0.5 * step, step)
    return [(x, y, 0.0) for x in xs]


def pass_through(world, y, low, high, *, slope=1.0, depth=2.0, step=0.05):
    """Oblique beams of every node that cross the line at height y between low and high and go on."""
    for node, (x, own, _) in enumerate(world.poses):
        for target in np.arange(low + 0.5 * step, high, step):
            if abs(target - x) >= slope * abs(y - own) * 0.5:
                share = (y - own + math.copysign(depth, y - own)) / (y - own)
                world.look(node, (x + share * (target - x), own + share * (y - own)))


def pane(low, high, *, y=1.5, at=(), nodes=None):
    """A world with one pane above the path, answered at the places `at`, seen through obliquely."""
    world = World(drive(low - 2.0, high + 2.0) if nodes is None else nodes)
    pass_through(world, y, low, high)
    answer(world, y, at)
    return world


def answer(world, y, at):
    """Glass at height y answers at normal incidence, to the node that is nearest each time."""
    for x in at:
        nearest = int(np.argmin(np.abs(world.poses[:, 0] - x)))
        world.see(nearest, (x, y), 0.5 * math.pi if y > world.poses[nearest, 1] else -0.5 * math.pi)


def opaque(world, y, low, high, *, step=0.02):
    """Every node sees an opaque piece at height y."""
    for node in range(len(world.poses)):
        world.hit(node, *[(x, y) for x in np.arange(low, high, step)])


def spans(walls):
    """Extents of the walls along x, in order."""
    return sorted(
        (float(min(wall.start[0], wall.end[0])), float(max(wall.start[0], wall.end[0]))) for wall in walls
    )


def naive_counts(
    poses, sensors, points, first, foot, direction, start, step, bins, *, tolerance, beyond, limit, before
):
    """What `count_along_line` counts, one beam after the other with `transform_points`."""
    solid, passed, normal, blocked = (np.zeros(bins, dtype=np.int64) for _ in range(4))
    across = np.array([-direction[1], direction[0]])
    for n, pose in enumerate(poses):
        sensor = transform_points(pose, sensors[n : n + 1])[0] - foot
        for local in points[first[n] : first[n + 1]].astype(np.float64):
            end = transform_points(pose, local[None])[0] - foot
            if abs(end @ across) <= tolerance:
                place, tables = end @ direction, [solid]
            elif (end @ across) * (sensor @ across) < 0 and abs(end @ across) >= beyond:
                share = (sensor @ across) / (sensor @ across - end @ across)
                place, tables = (sensor + share * (end - sensor)) @ direction, [passed]
                beam = end - sensor
                if math.atan2(abs(beam @ direction), abs(beam @ across)) < limit:
                    tables.append(normal)
            elif (end @ across) * (sensor @ across) >= 0 and abs(end @ across) <= min(
                before, abs(sensor @ across)
            ):
                share = (sensor @ across) / (sensor @ across - end @ across)
                place, tables = (sensor + share * (end - sensor)) @ direction, [blocked]
            else:
                continue
            piece = math.floor((place - start) / step)
            if 0 <= piece < bins:
                for table in tables:
                    table[piece] += 1
    return solid, passed, normal, blocked
