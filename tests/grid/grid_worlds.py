"""Grids drawn as text, and naive twins of the kernels that fill them."""

import itertools
import math

import numpy as np

from glassslam.grid.kernels import clear_ray


def drawing(cells, prior):
    """Cells as text, the highest row on top: # above even odds, . below, ? never observed."""
    rows = ["".join("?" if v == 0 else "#" if v > prior else "." for v in row) for row in cells]
    return "\n".join(rows[::-1])


def drawn(text):
    """The text as `drawing` returns it."""
    return "\n".join(line.strip() for line in text.strip().splitlines())


def visited(x0, y0, x1, y1, size=34):
    """Cells (column, row) a ray clears, found out with the kernel."""
    cells, marks = np.zeros((size, size), np.uint16), np.zeros((size, size), np.uint16)
    clear_ray(cells, marks, np.uint16(1), x0, y0, x1, y1, -1, 100, 200, 999)
    assert ((cells > 0) == (marks == 1)).all()
    return {(int(c), int(r)) for r, c in np.argwhere(marks == 1)}


def naive_ray(x0, y0, x1, y1):
    """Cells a segment passes through, from the middles of its pieces between all grid lines."""
    cuts = {0.0, 1.0}
    for a, b in ((x0, x1), (y0, y1)):
        for line in range(math.ceil(min(a, b)), math.floor(max(a, b)) + 1):
            if a != b:
                cuts.add(min(max((line - a) / (b - a), 0.0), 1.0))
    middles = [(s + t) / 2 for s, t in itertools.pairwise(sorted(cuts))]
    cells = {(math.floor(x0 + t * (x1 - x0)), math.floor(y0 + t * (y1 - y0))) for t in middles}
    return cells | {(math.floor(x0), math.floor(y0)), (math.floor(x1), math.floor(y1))}


def naive_insert(known, sensor, hits, free_ends, model):
    """Enter a scan in cell units into {(column, row): cell value}, hits before misses, each cell once."""
    hit_cells = {(math.floor(x), math.floor(y)) for x, y in hits}
    crossed = set().union(*(naive_ray(*sensor, *end) for end in (*hits, *free_ends)), set())
    for cell in hit_cells | crossed:
        step = model.hit_step if cell in hit_cells else model.miss_step
        value = known.get(cell, model.prior) + step
        known[cell] = min(max(value, 1), model.top)


def observed(grid):
    """{(column, row) counted from the frame's origin: cell value} of the cells observed."""
    corner = np.rint(grid.origin / grid.resolution).astype(int)
    return {
        (int(c + corner[0]), int(r + corner[1])): int(grid.cells[r, c]) for r, c in np.argwhere(grid.cells)
    }
