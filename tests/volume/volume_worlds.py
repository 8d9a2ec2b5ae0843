"""Slow and obvious twins of the volume's kernels, and tiny worlds."""

import math

import numpy as np

from glassslam.volume.octree import CENTRE, Octree, encode
from glassslam.volume.octree_kernels import DEPTH


def naive_code(key):
    """Bits of three keys taken in turn."""
    return sum((int(key[axis]) >> bit & 1) << (3 * bit + axis) for bit in range(DEPTH) for axis in range(3))


class NaiveVolume:
    """A dictionary of voxels."""

    def __init__(self, clamp):
        self.low, self.high = np.float32(clamp.low), np.float32(clamp.high)
        self.voxels = {}

    def add(self, codes, changes):
        # in the order of the codes, as a tree takes them; equal ones keep the order in which they came
        for code, change in sorted(zip(codes.tolist(), changes, strict=True), key=lambda pair: pair[0]):
            value = self.voxels.get(code, np.float32(0.0)) + np.float32(change)
            self.voxels[code] = min(max(value, self.low), self.high)

    def leaves(self):
        """(code, depth, value) of the smallest set of cubes: eight equal, stable ones are one."""
        level = {code: (DEPTH, value) for code, value in self.voxels.items()}
        for depth in range(DEPTH - 1, -1, -1):
            size = 8 ** (DEPTH - depth)
            for corner in {code // size * size for code in level}:
                children = [level.get(corner + k * size // 8) for k in range(8)]
                first = children[0]
                if first is None or first[1] not in {self.low, self.high} or first[0] != depth + 1:
                    continue
                if all(child == first for child in children):
                    for k in range(8):
                        del level[corner + k * size // 8]
                    level[corner] = (depth, first[1])
        return sorted((code, depth, value) for code, (depth, value) in level.items())


def listed(leaves):
    """(code, depth, value) of leaves."""
    return list(zip(leaves.codes.tolist(), leaves.depths.tolist(), leaves.log_odds, strict=True))


def crossed(start, end, key, margin):
    """Length of the parameter interval in which a segment is inside of a voxel widened by a margin."""
    low, high = 0.0, 1.0
    for a, b, k in zip(start, end, key, strict=True):
        if abs(b - a) < 1e-12:
            if not k - margin <= a <= k + 1 + margin:
                return -1.0
            continue
        near, far = sorted(((k - margin - a) / (b - a), (k + 1 + margin - a) / (b - a)))
        low, high = max(low, near), min(high, far)
    return high - low


def voxel(*place):
    """Code of the voxel `place` steps from the origin."""
    return int(encode(np.array([place]) + CENTRE)[0])


def drawn_tree(layers, resolution=0.5, clamp=None):
    """A tree drawn layer by layer from below, highest y on top: # occupied, . free, ? unknown."""
    tree = Octree(resolution, clamp)
    keys, values = [], []
    for z, layer in enumerate(layers):
        for y, line in enumerate(reversed(layer.split())):
            for x, cell in enumerate(line):
                if cell != "?":
                    keys.append((x + CENTRE, y + CENTRE, z + CENTRE))
                    values.append(9.0 if cell == "#" else -9.0)
    tree.add(encode(np.array(keys, dtype=np.int64).reshape(-1, 3)), np.array(values, dtype=np.float32))
    return tree


def drawing_of(grid):
    """A projected map drawn with the highest y on top."""

    def cell(p):
        return "?" if math.isnan(p) else "#" if p > 0.65 else "." if p < 0.196 else "+"

    return ["".join(cell(p) for p in row) for row in grid.probability[::-1].tolist()]


def occupied_share(grid, points):
    """Share of points (n, 2) whose cell or a neighbour is occupied in a map."""
    filled = grid.probability > 0.65
    padded = np.pad(filled, 1)
    grown = np.any([np.roll(padded, (dy, dx), (0, 1)) for dy in (-1, 0, 1) for dx in (-1, 0, 1)], axis=0)[
        1:-1, 1:-1
    ]
    column, row = np.floor((np.asarray(points) - grid.origin) / grid.resolution).astype(int).T
    inside = (row >= 0) & (row < filled.shape[0]) & (column >= 0) & (column < filled.shape[1])
    return (grown[row.clip(0, filled.shape[0] - 1), column.clip(0, filled.shape[1] - 1)] & inside).mean()


def line(start, end):
    """Points (60, 2) from one end to the other."""
    return np.linspace(start, end, 60)


STOREROOM_EDGES = {
    "table top": line((3.05, 3.95), (3.95, 3.95)),
    "shelf": line((0.5, 2.0), (0.5, 3.0)),
    "lamp": np.array([2.2, 1.3])
    + 0.2 * np.stack([f(np.linspace(0, 6.28, 40)) for f in (np.cos, np.sin)], axis=1),
    "pallet": np.concatenate((line((5.45, 2.9), (5.75, 2.9)), line((5.4, 2.95), (5.4, 3.45)))),
}
"""Edges of what the lidar passes over or under in the shipped storeroom, world frame, m."""
