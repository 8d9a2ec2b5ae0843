"""Time both pose-graph solvers on synthetic graphs beside the figures measured while choosing them.

    python tools/benchmark_posegraph.py              # all graphs, both solvers
    python tools/benchmark_posegraph.py --small      # the graphs of 5,000 nodes only

Columns: cold (analysis and optimisation from odometry), warm (once more from the optimum moved by
noise, analysis kept), casadi (IPOPT, cold), the largest distance between the two optima, and 300
relative covariances. A ratio below 1 is faster
than the reference.
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from glassslam.geometry import between, compose
from glassslam.posegraph import PoseGraph
from glassslam.records import FloatArray

SIGMA = np.array([0.02, 0.02, 0.005])
WEIGHT = np.diag(1.0 / SIGMA)
HUBER_SCALE = 3.0
WRONG = 0.02


@dataclass(frozen=True)
class Case:
    """A graph and the reference seconds of its solvers; None where there are none."""

    name: str
    nodes: int
    loops: int
    cold: float | None
    warm: float | None
    casadi: float | None


CASES = (
    Case("manhattan 5,000", 5000, 2701, 0.058, 0.034, 0.26),
    Case("dense 5,000", 5000, 27001, 0.088, 0.059, 0.44),
    Case("manhattan 20,000", 20000, 11001, 0.70, 0.32, 2.3),
    Case("dense 20,000", 20000, 111001, 0.69, 0.38, 1.9),
    Case("submaps 15,000", 15000, 5000, None, None, None),
)


def streets(count: int, rng: np.random.Generator) -> FloatArray:
    """A drive through a city of square blocks, one metre a step, turns every few steps."""
    side = int(np.sqrt(count))
    moves = np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
    position, heading = np.array([side // 2, side // 2]), 0
    poses = np.empty((count, 3))
    for i in range(count):
        poses[i] = *position, heading * np.pi / 2
        if i % 4 == 3 and rng.random() < 0.5:
            heading = (heading + rng.choice([1, 3])) % 4
        while not ((position + moves[heading] >= 0) & (position + moves[heading] < side)).all():
            heading = (heading + 1) % 4
        position = position + moves[heading]
    return poses


def noisy(measured: FloatArray, rng: np.random.Generator, wrong: float = 0.0) -> FloatArray:
    """Measurements with noise, and a share of them plainly wrong."""
    out = measured + rng.normal(size=measured.shape) * SIGMA
    bad = rng.random(len(out)) < wrong
    out[bad] += rng.normal(size=(int(bad.sum()), 3)) * [2.0, 2.0, 0.5]
    return out


def integrated(steps: FloatArray) -> FloatArray:
    """Poses from chained steps."""
    poses = np.zeros((len(steps) + 1, 3))
    for i, step in enumerate(steps):
        poses[i + 1] = compose(poses[i], step)
    return poses


def near_pairs(true: FloatArray, count: int, rng: np.random.Generator) -> np.ndarray:
    """Pairs of nodes at nearly the same place, driven at different times."""
    radius = 1.5
    while True:
        pairs = cKDTree(true[:, :2]).query_pairs(radius, output_type="ndarray")
        pairs = pairs[np.abs(pairs[:, 0] - pairs[:, 1]) > 10]
        if len(pairs) >= count:
            pairs = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
            return pairs[np.sort(rng.permutation(len(pairs))[:count])]
        radius += 1.0


def city_graph(case: Case) -> PoseGraph:
    """Nodes with odometry and loop closures between nodes."""
    rng = np.random.default_rng(0)
    true = streets(case.nodes, rng)
    steps = noisy(between(true[:-1], true[1:]), rng)
    pairs = near_pairs(true, case.loops, rng)
    graph, nodes = PoseGraph(), np.arange(case.nodes)
    graph.add_poses(integrated(steps))
    graph.add_constraints(nodes[:-1], nodes[1:], steps, WEIGHT, "odometry")
    closures = noisy(between(true[pairs[:, 0]], true[pairs[:, 1]]), rng, WRONG)
    graph.add_constraints(pairs[:, 0], pairs[:, 1], closures, WEIGHT, "loop")
    return graph


def submap_graph(case: Case, per_submap: int = 90) -> PoseGraph:
    """The shape the mapper makes: every node in two submaps, odometry, closures to other submaps."""
    rng = np.random.default_rng(0)
    true = streets(case.nodes, rng)
    steps = noisy(between(true[:-1], true[1:]), rng)
    local = integrated(steps)
    start = np.arange(0, case.nodes, per_submap)
    graph, nodes, count = PoseGraph(), np.arange(case.nodes), len(start)
    graph.add_poses(local[start])
    graph.add_poses(local)
    graph.add_constraints(count + nodes[:-1], count + nodes[1:], steps, WEIGHT, "odometry")
    for back in (0, 1):
        submap = nodes // per_submap - back
        member = nodes[submap >= 0]
        submap = submap[submap >= 0]
        measured = noisy(between(local[start[submap]], local[member]), rng)
        graph.add_constraints(submap, count + member, measured, WEIGHT, "odometry")
    pairs = near_pairs(true, case.loops, rng)
    submap = pairs[:, 0] // per_submap
    measured = noisy(between(true[start[submap]], true[pairs[:, 1]]), rng, WRONG)
    graph.add_constraints(submap, count + pairs[:, 1], measured, WEIGHT, "loop")
    return graph


def timed(work: Callable[[], object]) -> float:
    """Seconds one call takes."""
    begin = time.perf_counter()
    work()
    return time.perf_counter() - begin


def measure(case: Case, repeat: int) -> tuple[dict[str, float], int]:
    """Best seconds of `repeat` runs by column, and the iterations of the cold run."""
    graph = submap_graph(case) if case.name.startswith("submaps") else city_graph(case)
    start = graph.poses
    seconds: dict[str, list[float]] = {"cold": [], "warm": [], "casadi": []}
    rng = np.random.default_rng(1)
    for _ in range(repeat):
        graph.set_poses(0, start)
        graph.set_enabled([], enabled=True)
        seconds["cold"].append(timed(lambda: graph.optimize(huber_scale=HUBER_SCALE)))
        optimum = graph.poses
        graph.set_poses(0, optimum + rng.normal(size=optimum.shape) * 0.2 * SIGMA)
        seconds["warm"].append(timed(lambda: graph.optimize(huber_scale=HUBER_SCALE)))
    covariances = timed(lambda: graph.relative_covariances(rng.integers(0, len(start), (300, 2))))
    graph.set_poses(0, start)
    iterations = graph.optimize(huber_scale=HUBER_SCALE, tolerance=1e-10).iterations
    reference = graph.poses
    graph.set_poses(0, start)
    seconds["casadi"].append(
        timed(lambda: graph.optimize(huber_scale=HUBER_SCALE, solver="casadi", tolerance=1e-10))
    )
    apart = np.hypot(*(graph.poses - reference)[:, :2].T).max()
    best = {name: min(values) for name, values in seconds.items()}
    best |= {"apart": float(apart), "covariances": covariances}
    return best, iterations


def cell(value: float, reference: float | None) -> str:
    """Seconds, and their ratio to the reference."""
    return f"{value:7.3f} " + (f"({value / reference:4.1f}x)" if reference else "       ")


def main() -> None:
    """Measure every graph and print one table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--small", action="store_true", help="graphs of 5,000 nodes only")
    parser.add_argument("--repeat", type=int, default=3, help="runs of which the best counts")
    options = parser.parse_args()
    measure(Case("warm up", 200, 100, None, None, None), 1)
    measure(Case("submaps warm up", 500, 100, None, None, None), 1)
    print(f"{'seconds (ratio)':18} {'cold':15} {'warm':15} {'casadi':15} its  apart m   300 cov")
    for case in CASES:
        if options.small and case.nodes > 5000:
            continue
        best, iterations = measure(case, options.repeat)
        columns = (cell(best[name], getattr(case, name)) for name in ("cold", "warm", "casadi"))
        print(
            f"{case.name:18} {' '.join(columns)} {iterations:3d} {best['apart']:9.1e} "
            f"{best['covariances']:8.3f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
