"""Time scan matching, correlative searches and grid insertion on a simulated floor; print one table.

python tools/benchmark_matching.py               best of 7 rounds over 24 scans
python tools/benchmark_matching.py --rounds 30   steadier figures on a busy machine

Columns are beams per scan. The number in brackets is the ratio to a reference: hand-written numba for
matching, plain C++ at -O3 for branch and bound, measured once on a machine of two cores. A ratio
below 1 is faster than the reference.
"""

import argparse
import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from glassslam.config import Solver
from glassslam.geometry import transform_points
from glassslam.grid import ProbabilityGrid
from glassslam.matching import BranchAndBoundMatcher, match_scan
from glassslam.matching.exhaustive_kernels import exhaustive_search
from glassslam.records import FloatArray

BEAMS = (180, 360, 1080)
FARTHEST = 10.0
NO_ECHO = np.empty((0, 2))
WALLS = np.array(
    [
        [[-9, -7], [9, -7]], [[9, -7], [9, 7]], [[9, 7], [-9, 7]], [[-9, 7], [-9, -7]],
        [[-9, 1], [-2, 1]], [[-1, 1], [4, 1]], [[5, 1], [9, 1]], [[0, 1], [0, 7]],
        [[-4, -7], [-4, -3]], [[3, -7], [3, -4]], [[5, -2], [6, -2]], [[6, -2], [6, -1]],
    ],
    dtype=np.float64,
)  # fmt: skip
REFERENCE = {
    "match, own loop": (0.020, 0.035, 0.12),
    "match, casadi": (0.13, 0.14, 0.45),
    "branch and bound": (2.6, 8.6, 27.0),
    "exhaustive search": (0.43, 0.74, 2.2),
    "insertion": (0.09, 0.26, 0.98),
}
"""Milliseconds per scan, in the order of `BEAMS`."""


@dataclass(frozen=True)
class Floor:
    """A mapped floor and scans to match against it.

    Attributes
    ----------
    grid : ProbabilityGrid
        Finished.
    poses : ndarray of float64, shape (n, 3)
        Where the scans were taken.
    scans : list of ndarray of float64, shape (k, 2)
        Returns in the frame of the scan, m.
    offsets : ndarray of float64, shape (n, 3)
        Errors of the predictions.
    """

    grid: ProbabilityGrid
    poses: FloatArray
    scans: list[FloatArray]
    offsets: FloatArray


def scan_from(pose: FloatArray, beams: int, rng: np.random.Generator) -> FloatArray:
    """Returns of a sweep over 270 deg in the frame of the scan, with 1 cm of noise."""
    angles = np.linspace(-0.75, 0.75, beams) * math.pi
    directions = np.stack((np.cos(angles + pose[2]), np.sin(angles + pose[2])), axis=1)
    ranges = np.full(beams, np.inf)
    for a, b in WALLS:
        along, to = b - a, a - pose[:2]
        cross = directions[:, 0] * along[1] - directions[:, 1] * along[0]
        with np.errstate(divide="ignore", invalid="ignore"):
            r = (to[0] * along[1] - to[1] * along[0]) / cross
            s = (to[0] * directions[:, 1] - to[1] * directions[:, 0]) / cross
        hit = (r > 0.0) & (s >= 0.0) & (s <= 1.0)
        ranges[hit] = np.minimum(ranges[hit], r[hit])
    ranges = np.minimum(ranges + rng.normal(size=beams) * 0.01, FARTHEST)
    return np.stack((ranges * np.cos(angles), ranges * np.sin(angles)), axis=1)


def floor(beams: int, count: int) -> Floor:
    """The floor mapped from 180 places, and scans of a number of beams."""
    rng = np.random.default_rng(0)
    grid = ProbabilityGrid(0.05)
    way = np.linspace(0.0, 2.0 * math.pi, 180)
    for x, y, heading in np.stack((7.0 * np.cos(way), -3.0 + 2.0 * np.sin(way), way), axis=1):
        pose = np.array([x, y, heading])
        grid.insert(pose[:2], transform_points(pose, scan_from(pose, 720, rng)), NO_ECHO)
    grid.finish()
    at = rng.uniform(0.0, 2.0 * math.pi, count)
    headings = rng.uniform(-math.pi, math.pi, count)
    poses = np.stack((6.5 * np.cos(at), -3.0 + 1.8 * np.sin(at), headings), axis=1)
    offsets = rng.normal(size=(count, 3)) * [0.04, 0.04, 0.015]
    return Floor(grid, poses, [scan_from(pose, beams, rng) for pose in poses], offsets)


def best_ms(work: Callable[[int], object], count: int, rounds: int) -> float:
    """Milliseconds per call of the best round of `count` calls."""
    work(0)
    best = math.inf
    for _ in range(rounds):
        begin = time.perf_counter()
        for k in range(count):
            work(k)
        best = min(best, time.perf_counter() - begin)
    return 1e3 * best / count


def works(world: Floor) -> dict[str, Callable[[int], object]]:
    """What is timed, by name; every work takes the number of a scan."""
    grid, predictions = world.grid, world.poses + world.offsets
    matcher = BranchAndBoundMatcher(grid, 7.0)
    scratch, pose = ProbabilityGrid(0.05), np.empty(3)
    window, turn = math.radians(30.0), 0.015

    def search(k: int) -> object:
        far = world.poses[k] + [3.0, -2.0, 0.2]
        return matcher.match(world.scans[k], far, 7.0, window, 0.5)

    def exhaustive(k: int) -> object:
        half = math.ceil(math.radians(20.0) / turn)
        place = (grid.cells, grid.table, grid.origin, 1.0 / grid.resolution)
        return exhaustive_search(*place, world.scans[k], predictions[k], 2, half, turn, 0.1, 0.1, pose)

    def insert(k: int) -> None:
        points = transform_points(world.poses[k], world.scans[k])
        scratch.insert(world.poses[k, :2], points, NO_ECHO)

    def match(k: int, solver: Solver) -> object:
        scan = world.scans[k]
        return match_scan(
            grid, scan, predictions[k], translation_weight=0.5, rotation_weight=0.33, solver=solver
        )

    return {
        "match, own loop": lambda k: match(k, "lm"),
        "match, casadi": lambda k: match(k, "casadi"),
        "branch and bound": search,
        "exhaustive search": exhaustive,
        "insertion": insert,
    }


def accuracy(world: Floor) -> str:
    """Mean distance from the truth, mm, and evaluations of both solvers."""
    texts = []
    solvers: tuple[Solver, ...] = ("lm", "casadi")
    for solver in solvers:
        results = [
            match_scan(world.grid, scan, pose + offset, solver=solver)
            for scan, pose, offset in zip(world.scans, world.poses, world.offsets, strict=True)
        ]
        errors = np.array([result.pose for result in results]) - world.poses
        steps = np.mean([result.iterations for result in results])
        texts.append(f"{solver}: {1e3 * np.hypot(*errors[:, :2].T).mean():.1f} mm, {steps:.1f} steps")
    return "; ".join(texts)


def main() -> None:
    """Measure every scan size and print one table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--rounds", type=int, default=7, help="rounds of which the best counts")
    parser.add_argument("--scans", type=int, default=24, help="scans in a round")
    options = parser.parse_args()
    worlds = [floor(beams, options.scans) for beams in BEAMS]
    columns = [works(world) for world in worlds]
    print(f"{'ms per scan (ratio)':20}" + "".join(f"{beams:>10} beams  " for beams in BEAMS))
    for name, references in REFERENCE.items():
        cells = [
            (best_ms(column[name], options.scans, options.rounds), reference)
            for column, reference in zip(columns, references, strict=True)
        ]
        print(f"{name:20}" + "".join(f"{ms:10.3f} ({ms / r:4.2f})" for ms, r in cells), flush=True)
    pyramid = best_ms(lambda _: BranchAndBoundMatcher(worlds[0].grid, 7.0), 4, options.rounds)
    print(f"{'max grids, once':20}{pyramid:10.3f}")
    for beams, world in zip(BEAMS, worlds, strict=True):
        print(f"{beams} beams: {accuracy(world)}")


if __name__ == "__main__":
    main()
