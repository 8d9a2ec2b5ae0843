"""A room to match scans in, and naive twins of what the matching kernels compute."""

import math
from functools import cache

import numpy as np

from glassslam.geometry import transform_points
from glassslam.grid import OddsModel, ProbabilityGrid

NOTHING = np.empty((0, 2))
# a room of 6 m x 4 m with a pillar, so that every direction and turn is held
WALLS = [
    ((-3.0, -2.0), (3.0, -2.0)), ((3.0, -2.0), (3.0, 2.0)), ((3.0, 2.0), (-3.0, 2.0)),
    ((-3.0, 2.0), (-3.0, -2.0)), ((1.0, 0.5), (1.4, 0.5)), ((1.4, 0.5), (1.4, 0.9)),
    ((1.4, 0.9), (1.0, 0.9)), ((1.0, 0.9), (1.0, 0.5)),
]  # fmt: skip
CORRIDOR = [((-20.0, -1.0), (20.0, -1.0)), ((-20.0, 1.0), (20.0, 1.0))]


def scan_from(pose, beams=180, walls=WALLS, noise=0.0, seed=0):
    """Returns in the frame of the scan."""
    angles = np.linspace(-np.pi, np.pi, beams, endpoint=False) + 0.003
    directions = np.stack((np.cos(angles + pose[2]), np.sin(angles + pose[2])), axis=1)
    ranges = np.full(beams, np.inf)
    for a, b in np.array(walls):
        along, to = b - a, a - pose[:2]
        cross = directions[:, 0] * along[1] - directions[:, 1] * along[0]
        with np.errstate(divide="ignore", invalid="ignore"):
            r = (to[0] * along[1] - to[1] * along[0]) / cross
            s = (to[0] * directions[:, 1] - to[1] * directions[:, 0]) / cross
        hit = (r > 0) & (s >= 0) & (s <= 1)
        ranges[hit] = np.minimum(ranges[hit], r[hit])
    ranges += np.random.default_rng(seed).normal(size=beams) * noise
    return (ranges[:, None] * np.stack((np.cos(angles), np.sin(angles)), axis=1))[np.isfinite(ranges)]


@cache
def mapped(corridor=False, noise=0.01):
    """A grid of the room, scanned from a few places."""
    grid, walls = ProbabilityGrid(0.05, OddsModel()), CORRIDOR if corridor else WALLS
    for k in range(30):
        pose = np.array([-1.5 + 0.1 * k, -0.6 + 0.02 * k, 0.2 * k])
        points = transform_points(pose, scan_from(pose, 360, walls, noise, seed=k))
        grid.insert(pose[:2], points[np.abs(points[:, 0]) < 8], NOTHING)
    grid.finish()
    return grid


def random_grid(rng, shape=(14, 17)):
    """A grid of arbitrary cells, some unknown; cells of 0.25 m, corner at (-1, 0.5)."""
    grid = ProbabilityGrid(0.25)
    grid.cells = rng.integers(0, grid.odds.top + 1, shape).astype(np.uint16)
    grid.cells[rng.random(shape) < 0.3] = 0
    grid.origin = np.array([-1.0, 0.5])
    return grid


def cubic(t):
    """The cardinal cubic B-spline."""
    t = abs(t)
    if t < 1:
        return 2 / 3 - t * t + t**3 / 2
    return (2 - t) ** 3 / 6 if t < 2 else 0.0


def smooth(grid, x, y):
    """The smooth surface at a point of the frame: all cells weighted by distance."""
    u, v = (np.array([x, y]) - grid.origin) / grid.resolution - 0.5
    rows, columns = grid.cells.shape
    along_x = np.array([cubic(u - i) for i in range(columns)])
    along_y = np.array([cubic(v - j) for j in range(rows)])
    return float(along_y @ grid.table[grid.cells].astype(float) @ along_x)


def inside(grid, x, y):
    """Whether the neighbourhood of a point lies in the grid."""
    u, v = (np.array([x, y]) - grid.origin) / grid.resolution - 0.5
    rows, columns = grid.cells.shape
    return 1 <= u < columns - 2 and 1 <= v < rows - 2


def naive_residuals(grid, points, pose):
    """1 - M(T h) of every point; that of unknown where T h is outside."""
    out = []
    for x, y in transform_points(np.asarray(pose, float), points):
        out.append(1 - smooth(grid, x, y) if inside(grid, x, y) else 1 - float(grid.table[0]))
    return np.array(out)


def slopes(function, at, h=1e-6):
    """Central differences of a vector function, shape (values, 3)."""
    at = np.asarray(at, float)
    moves = np.eye(3) * h
    return np.stack([(function(at + d) - function(at - d)) / (2 * h) for d in moves], axis=-1)


def cost_of(grid, points, pose, prediction, prior, weight):
    """What is minimised, spelled out."""
    away = np.asarray(pose) - prediction
    return weight * float((naive_residuals(grid, points, pose) ** 2).sum()) + float(prior @ away**2)


def apart(a, b):
    """Distance in m and turn in rad between two poses."""
    return math.hypot(a[0] - b[0], a[1] - b[1]), abs(math.remainder(a[2] - b[2], 2 * math.pi))
