"""Which searches to make for loop closures, and making them beside local SLAM."""

import math
from collections import Counter, OrderedDict
from collections.abc import Callable, Sequence
from itertools import takewhile

import numpy as np

from glassslam.config import LoopClosureConfig
from glassslam.geometry import between
from glassslam.grid.submap import Submap
from glassslam.matching.branch_and_bound import BranchAndBoundMatcher
from glassslam.posegraph import PoseGraph
from glassslam.records import FloatArray
from glassslam.slam.closure import Candidate, Closure, close, is_wide, needs_search
from glassslam.slam.neighbourhood import neighbourhood, neighbours
from glassslam.slam.node import Node
from glassslam.slam.rejoin import beginnings

_NEAR = 4.0
_FARTHEST_CANDIDATE = 25.0
_LINEAR_MARGIN, _ANGULAR_MARGIN = 0.1, 0.03
_MOST_WIDE = 24
_CACHED_BYTES = 16_000_000
CHI_SQUARE_LIMIT = 20.0


def select(
    graph: PoseGraph,
    nodes: Sequence[Node],
    submaps: Sequence[Submap],
    first: int,
    last: int,
    config: LoopClosureConfig,
) -> list[Candidate]:
    """Searches for the nodes `first` .. `last` - 1 in finished submaps.

    A search is made where the graph, within three standard deviations and a few metres, allows that
    the node sees the submap; its window follows from the covariance of the node in the submap. Across a
    break of the recording it may reach all around, and no number of nodes lies between.
    """
    poses, begins = graph.poses, beginnings(nodes)
    pairs: list[tuple[int, int, int, float]] = []
    for submap in submaps:
        end = submap.nodes[-1]
        nearest = min([end + config.min_node_gap + 1, *(begin for begin in begins if begin > end)])
        queries = np.arange(max(first, nearest), last)
        pairs += _nearest_pairs(poses, queries, submap, config)
    if not pairs:
        return []
    covariances = graph.relative_covariances([(anchor, node) for node, anchor, _, _ in pairs])
    chosen, widest = [], math.radians(config.max_angular_window_deg)
    for (node, anchor, submap_index, distance), covariance in zip(pairs, covariances, strict=True):
        spread = 3.0 * math.sqrt(max(covariance[0, 0], covariance[1, 1]))
        if distance > _NEAR + spread:
            continue
        turn = 3.0 * math.sqrt(covariance[2, 2]) + _ANGULAR_MARGIN
        is_wide_open = turn > widest and any(anchor < begin <= node for begin in begins)
        chosen.append(
            Candidate(
                node,
                anchor,
                submap_index,
                nodes[anchor].pose_in_local,
                between(poses[anchor], poses[node]),
                config.max_linear_window
                if is_wide_open
                else min(config.max_linear_window, spread + _LINEAR_MARGIN),
                math.pi if is_wide_open else min(widest, turn),
                covariance,
            )
        )
    return _few_wide(chosen, config)


def _few_wide(candidates: Sequence[Candidate], config: LoopClosureConfig) -> list[Candidate]:
    """The candidates, of the wide ones those nearest to their submaps: each costs as much as many others."""
    seen: Counter[int] = Counter()
    ranks = {}
    for k, candidate in enumerate(candidates):
        if is_wide(candidate, config):
            distance = math.hypot(*candidate.anchor_from_node[:2].tolist())
            ranks[k] = (seen[candidate.submap], distance)
            seen[candidate.submap] += 1
    dropped = set(sorted(ranks, key=ranks.__getitem__)[_MOST_WIDE:])
    return [candidate for k, candidate in enumerate(candidates) if k not in dropped]


def _nearest_pairs(
    poses: FloatArray, queries: np.ndarray, submap: Submap, config: LoopClosureConfig
) -> list[tuple[int, int, int, float]]:
    """Nodes near a submap, nearest first, not closer together than the sampling stride."""
    members = np.asarray(submap.nodes)
    if queries.size == 0 or not _may_be_near(poses[queries, :2], poses[members, :2]):
        return []
    gaps = np.hypot(
        poses[queries, 0][:, None] - poses[members, 0][None],
        poses[queries, 1][:, None] - poses[members, 1][None],
    )
    nearest = gaps.argmin(axis=1)
    distances = gaps[np.arange(len(queries)), nearest]
    taken: list[tuple[int, int, int, float]] = []
    for k in np.argsort(distances, kind="stable"):
        node = int(queries[k])
        if distances[k] >= _FARTHEST_CANDIDATE or len(taken) == config.max_searches_per_submap:
            break
        if all(abs(node - other[0]) >= config.sampling_stride for other in taken):
            taken.append((node, int(members[nearest[k]]), submap.index, float(distances[k])))
    return taken


def _may_be_near(a: FloatArray, b: FloatArray) -> bool:
    """Whether the bounding boxes of two point sets come within the farthest candidate distance."""
    gap = np.maximum(a.min(axis=0) - b.max(axis=0), b.min(axis=0) - a.max(axis=0))
    return bool((gap < _FARTHEST_CANDIDATE).all())


class LoopSearcher:
    """Makes searches one after another; runs in one background thread.

    Parameters
    ----------
    config : LoopClosureConfig
        Gates and windows.
    is_hurried : callable
        Asked before every search whether to leave out this one and all that follow.
    """

    def __init__(self, config: LoopClosureConfig, is_hurried: Callable[[], bool] = lambda: False) -> None:
        self._config = config
        self._is_hurried = is_hurried
        self._matchers: OrderedDict[int, BranchAndBoundMatcher] = OrderedDict()

    def search(
        self,
        candidates: Sequence[Candidate],
        nodes: list[Node],
        travel: FloatArray,
        submaps: Sequence[Submap],
    ) -> list[Closure]:
        """Results of all candidates, in their order; of the first ones where it is told to hurry."""
        return [
            self._close(candidate, nodes, travel, submaps)
            for candidate in takewhile(lambda _: not self._is_hurried(), candidates)
        ]

    def _close(
        self, candidate: Candidate, nodes: list[Node], travel: FloatArray, submaps: Sequence[Submap]
    ) -> Closure:
        chosen = neighbours(travel, candidate.node, self._config.neighbourhood)
        scene = neighbourhood(nodes, chosen, candidate.node)
        submap = submaps[candidate.submap]
        matcher = None
        if needs_search(candidate.linear_window, candidate.angular_window):
            matcher = self._matcher(submap, candidate.linear_window)
        return close(candidate, scene, submap.grid, matcher, self._config, CHI_SQUARE_LIMIT)

    def _matcher(self, submap: Submap, window: float) -> BranchAndBoundMatcher:
        """Max grids of a submap, built when first needed and dropped when long unused."""
        matcher = self._matchers.pop(submap.index, None)
        if matcher is None or matcher.max_linear_window < window:
            matcher = BranchAndBoundMatcher(submap.grid, min(2.0 * window, self._config.max_linear_window))
        self._matchers[submap.index] = matcher
        while sum(m.nbytes for m in self._matchers.values()) > _CACHED_BYTES and len(self._matchers) > 1:
            self._matchers.popitem(last=False)
        return matcher
