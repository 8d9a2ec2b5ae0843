"""Global SLAM: the pose graph, loop closures found beside local SLAM, and their optimisation."""

import threading
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager

import numpy as np

from glassslam.config import Config
from glassslam.errors import GraphError
from glassslam.geometry import between, compose, inverse
from glassslam.grid.submap import Submap
from glassslam.posegraph import PoseGraph
from glassslam.posegraph.consistency import prune_closures
from glassslam.posegraph.storage import LOOP
from glassslam.records import FloatArray
from glassslam.slam.closure import Candidate, Closure
from glassslam.slam.journal import Journal, NoJournal
from glassslam.slam.loop_closing import LoopSearcher, select
from glassslam.slam.node import Node
from glassslam.slam.rejoin import WEAK_STEP, Rejoining, move_stretches
from glassslam.slam.search_outcome import SearchOutcome
from glassslam.slam.stopwatch import Stages

_LOOK_AHEAD = 45
_DOUBT = 5.0
_BREAK_WEIGHT = np.diag(1.0 / np.array(WEAK_STEP))


class GlobalSlam:
    """Poses of all nodes, held together by local SLAM and loop closures.

    Every `optimize_every_n_nodes` nodes one round is made: the closures found since the last round
    enter the graph, the graph is optimised, and the next searches start in a background thread.
    What a round uses depends on the nodes alone, never on how fast the thread was.

    Attributes
    ----------
    graph : PoseGraph
        Vertex i is node i.
    searches : int
        Searches made.
    rejected : Counter
        Reason -> searches that gave no closure.
    outcomes : list of SearchOutcome
        What became of every search, in their order.
    ambiguous : int
        Closures accepted that say nothing along one direction.
    solver_failures : int
        Optimisations that failed and left the poses as they were.
    """

    def __init__(self, config: Config, stages: Stages, journal: Journal | None = None) -> None:
        self._config = config
        self._stages = stages
        self._journal = journal or NoJournal()
        self.graph = PoseGraph()
        self.nodes: list[Node] = []
        self.submaps: list[Submap] = []
        self.searches = self.ambiguous = self.solver_failures = 0
        self.outcomes: list[SearchOutcome] = []
        self.rejected: Counter[str] = Counter()
        self._travel: list[float] = []
        self._searched = 0
        self._hurried = threading.Event()
        self._searcher = LoopSearcher(config.loop_closure, self._hurried.is_set)
        self._rejoining = Rejoining(config.loop_closure)
        self._pool = ThreadPoolExecutor(max_workers=1, thread_name_prefix="loop-closing")
        self._pending: Future[list[Closure]] | list[Closure] | None = None
        noise = config.optimization
        self._step_weight = np.diag(
            1.0
            / np.array(
                [
                    noise.odometry_translation_noise,
                    noise.odometry_translation_noise,
                    noise.odometry_rotation_noise,
                ]
            )
        )

    def add_node(self, node: Node) -> None:
        """Take a node, and make a round when it is due."""
        if not self.nodes:
            self.graph.add_pose(node.pose_in_local)
            self._travel.append(0.0)
        else:
            last = self.nodes[-1]
            step = between(last.pose_in_local, node.pose_in_local)
            self.graph.add_pose(compose(self.graph.poses[-1], step))
            weight = self._step_weight / (_DOUBT if node.doubtful else 1.0)
            apart = 0.0
            if node.begins:
                # scans on either side of a break are never matched together
                weight, apart = _BREAK_WEIGHT, 2.0 * self._config.loop_closure.neighbourhood + 1.0
            self.graph.add_constraints([last.index], [node.index], step[None], weight, "odometry")
            self._travel.append(self._travel[-1] + float(np.hypot(step[0], step[1])) + apart)
        self.nodes.append(node)
        if len(self.nodes) % self._config.optimization.optimize_every_n_nodes == 0:
            self._round(len(self.nodes) - _LOOK_AHEAD)

    def add_submap(self, submap: Submap) -> None:
        """Take a finished submap."""
        self.submaps.append(submap)

    def finish(self) -> None:
        """Make the last searches, optimise, and take out the closures that do not fit."""
        self._round(len(self.nodes))
        self._collect()
        self._enter(self._rejoining.settle([], self.graph, self.nodes, np.array(self._travel), self.submaps))
        self._enter(self._rejoining.give_up())
        limits = self._config.optimization
        with self._stages.measure("optimisation"), self._keeping_poses():
            prune_closures(
                self.graph,
                limits.max_closure_residual,
                max_iterations=limits.max_num_iterations,
                solver=limits.solver,
                huber_scale=limits.huber_scale,
            )
        self._pool.shutdown()

    def hurry(self) -> None:
        """Make no further searches; what they have found so far is used, and not written down."""
        self._hurried.set()

    @property
    def is_hurried(self) -> bool:
        """Whether searches are left out."""
        return self._hurried.is_set()

    @contextmanager
    def _keeping_poses(self) -> Iterator[None]:
        """Count a failure of the solver, which leaves the poses as they are: they are worth a map."""
        try:
            yield
        except (GraphError, np.linalg.LinAlgError):
            self.solver_failures += 1

    def abandon(self) -> None:
        """Stop the background thread without finishing."""
        self._pool.shutdown(wait=False, cancel_futures=True)

    @property
    def poses(self) -> FloatArray:
        """Poses of all nodes in the map frame, shape (n, 3)."""
        return self.graph.poses

    @property
    def map_from_local(self) -> FloatArray:
        """Where the local frame lies in the map by the last node, shape (3,), m and rad."""
        if not self.nodes:
            return np.zeros(3)
        return compose(self.graph.poses[-1], inverse(self.nodes[-1].pose_in_local))

    def residuals(self) -> dict[str, float]:
        """Root mean square residuals of the closures in use, m and rad."""
        edges = self.graph.edges
        used = np.flatnonzero((edges.kinds == LOOP) & edges.enabled)
        if used.size == 0:
            return {}
        ends = edges.ends[used]
        poses = self.graph.poses
        gap = between(edges.measured[used], between(poses[ends[:, 0]], poses[ends[:, 1]]))
        return {
            "loop_translation_rms": float(np.sqrt(np.mean(gap[:, 0] ** 2 + gap[:, 1] ** 2))),
            "loop_rotation_rms": float(np.sqrt(np.mean(gap[:, 2] ** 2))),
        }

    def closures(self) -> tuple[int, int]:
        """Numbers of closures in use and of closures taken out as inconsistent."""
        loops = self.graph.edges.enabled[self.graph.edges.kinds == LOOP]
        return int(loops.sum()), int((~loops).sum())

    def _round(self, last: int) -> None:
        """Collect, optimise, and start the searches for the nodes not searched yet before `last`."""
        self._collect()
        if not self._config.loop_closure.enabled or last <= self._searched:
            return
        self._pending = self._journal.recall_round()
        if self._pending is None:
            with self._stages.measure("loop closing"):
                candidates = select(
                    self.graph, self.nodes, self.submaps, self._searched, last, self._config.loop_closure
                )
            self._pending = self._pool.submit(
                self._search, candidates, list(self.nodes), np.array(self._travel), list(self.submaps)
            )
        elif not self.is_hurried:
            self._journal.confirm_round(range(self._searched, last))
        self._searched = last

    def _search(
        self, candidates: Sequence[Candidate], nodes: list[Node], travel: FloatArray, submaps: list[Submap]
    ) -> list[Closure]:
        with self._stages.measure("loop closing"):
            return self._searcher.search(candidates, nodes, travel, submaps)

    def _found(self, search: "Future[list[Closure]]") -> list[Closure]:
        """What a search in the background has found, written down if it came to its end."""
        closures = search.result()
        if not self.is_hurried:
            self._journal.keep_round(closures)
        return closures

    def _collect(self) -> None:
        """Enter what the last searches found, in their order, and optimise."""
        if self._pending is None:
            return
        closures = self._pending if isinstance(self._pending, list) else self._found(self._pending)
        self._pending = None
        self.searches += len(closures)
        self._enter(
            self._rejoining.settle(closures, self.graph, self.nodes, np.array(self._travel), self.submaps)
        )

    def _enter(self, closures: Sequence[Closure]) -> None:
        """Note what became of searches, enter the closures found and optimise."""
        self.outcomes += [SearchOutcome.of(closure) for closure in closures]
        self.rejected.update(closure.rejected for closure in closures if closure.rejected)
        weighed = [(closure, _root(closure.covariance)) for closure in closures if not closure.rejected]
        found = [closure for closure, root in weighed if root is not None]
        roots = [root for _, root in weighed if root is not None]
        if len(found) < len(weighed):
            self.rejected["not definite"] += len(weighed) - len(found)
        if not found:
            return
        self.ambiguous += sum(closure.ambiguous for closure in found)
        limits = self._config.optimization
        with self._stages.measure("optimisation"), self._keeping_poses():
            move_stretches(self.graph, found, self.nodes, self._config.loop_closure)
            self.graph.add_constraints(
                [closure.candidate.anchor for closure in found],
                [closure.candidate.node for closure in found],
                np.array([closure.anchor_from_node for closure in found]),
                np.array(roots),
                "loop",
            )
            self.graph.optimize(
                limits.max_num_iterations,
                solver=limits.solver,
                huber_scale=limits.huber_scale,
                tolerance=1e-5,
            )


def _root(covariance: FloatArray) -> FloatArray | None:
    """Root W of the information of a closure, W^T W; None where the covariance has none."""
    try:
        root = np.asarray(np.linalg.cholesky(np.linalg.inv(covariance)).T)
    except np.linalg.LinAlgError:
        return None
    return root if np.isfinite(root).all() else None
