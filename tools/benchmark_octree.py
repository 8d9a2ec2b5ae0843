"""Time and memory of the octree, beside those of OctoMap where pyoctomap is installed.

    python tools/benchmark_octree.py [--scans 100] [--points 4000] [--resolution 0.05]

Every scan looks in all directions from inside a closed room of 10 m x 8 m x 2.5 m.
"""

import argparse
import time
from importlib import import_module
from typing import Any

import numpy as np

from glassslam.volume.evidence import observe
from glassslam.volume.octree import Octree
from glassslam.volume.sensors import InverseModel

_LOW, _HIGH = np.zeros(3), np.array([10.0, 8.0, 2.5])


def make_scans(count: int, points: int) -> list[tuple[Any, Any]]:
    """Sensor positions (3,) and what each sees of the walls, (n, 3), m."""
    random = np.random.default_rng(1)
    scans = []
    for k in range(count):
        origin = np.array([2.0 + 5.0 * k / count, 3.0, 0.5])
        rays = random.normal(size=(points, 3))
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        reach = np.where(rays > 0, (_HIGH - origin) / rays, (_LOW - origin) / rays).min(axis=1)
        scans.append((origin, origin + rays * reach[:, None]))
    return scans


def run_own(scans: list[tuple[Any, Any]], resolution: float) -> tuple[Octree, int]:
    """The volume, and how many voxels were entered."""
    tree, entered = Octree(resolution), 0
    model, nothing = InverseModel(max_range=30.0), np.empty((0, 3))
    for origin, points in scans:
        said = observe(origin, points, nothing, model, resolution)
        tree.add_sorted(said.codes, said.log_odds)
        entered += said.codes.size
    return tree, entered


def run_octomap(library: Any, scans: list[tuple[Any, Any]], resolution: float, *, lazy: bool) -> Any:
    """The same in OctoMap; `lazy` updates the inner nodes once, at the end."""
    tree = library.OcTree(resolution)
    tree.setProbHit(0.7)
    tree.setProbMiss(0.4)
    for origin, points in scans:
        tree.insertPointCloud(points, origin, -1.0, lazy)
    if lazy:
        tree.updateInnerOccupancy()
    return tree


def main() -> None:
    """Print one line for each way."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scans", type=int, default=100)
    parser.add_argument("--points", type=int, default=4000)
    parser.add_argument("--resolution", type=float, default=0.05)
    options = parser.parse_args()
    scans = make_scans(options.scans, options.points)
    run_own(scans[:2], options.resolution)  # compiles
    start = time.perf_counter()
    tree, entered = run_own(scans, options.resolution)
    seconds, memory = time.perf_counter() - start, tree.memory()
    print(
        f"glassslam: {seconds:.2f} s, {entered / seconds / 1e6:.1f} million voxels a second, "
        f"{memory.leaves} leaves, {memory.used_bytes / 1e6:.1f} MB"
    )
    try:
        library = import_module("pyoctomap")
    except ImportError:
        print("pyoctomap is not installed")
        return
    for lazy in (False, True):
        start = time.perf_counter()
        other = run_octomap(library, scans, options.resolution, lazy=lazy)
        seconds = time.perf_counter() - start
        name = "OctoMap, inner nodes last" if lazy else "OctoMap"
        print(
            f"{name}: {seconds:.2f} s, {other.getNumLeafNodes()} leaves, {other.memoryUsage() / 1e6:.1f} MB"
        )


if __name__ == "__main__":
    main()
