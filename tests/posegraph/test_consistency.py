"""Which loop closures are taken out after optimisation."""

import numpy as np
import pytest
from pose_worlds import walk_graph

from glassslam.posegraph.consistency import prune_closures
from glassslam.posegraph.storage import LOOP


@pytest.mark.parametrize("seed", range(3))
def test_pruning_disables_the_wrong_closures_and_only_those(seed):
    graph, true, wrong = walk_graph(200, 80, outliers=16, seed=seed)
    result = prune_closures(graph, 6.0, huber_scale=2.0)
    np.testing.assert_array_equal(result.disabled, wrong)
    assert not graph.edges.enabled[wrong].any()
    assert result.rounds > 1
    assert result.report.converged
    clean, _, _ = walk_graph(200, 80, outliers=16, seed=seed)
    clean.set_enabled(wrong, False)
    clean.optimize(huber_scale=2.0)
    np.testing.assert_allclose(graph.poses[:, :2], clean.poses[:, :2], atol=2e-3)
    assert np.hypot(*(graph.poses - true)[:, :2].T).max() < 0.3


def test_pruning_a_clean_graph_changes_nothing_but_the_poses():
    graph, _, _ = walk_graph(100, 40)
    result = prune_closures(graph, 8.0)
    assert (result.disabled.size, result.rounds) == (0, 1)
    assert graph.edges.enabled.all()


def test_pruning_stops_after_the_rounds_allowed():
    graph, _, _ = walk_graph(100, 40, outliers=8)
    result = prune_closures(graph, 1.0, max_rounds=2)
    assert result.rounds == 2
    assert result.disabled.size


def test_a_closure_disabled_by_the_caller_stays_so():
    graph, _, _ = walk_graph(100, 40)
    closure = np.flatnonzero(graph.edges.kinds == LOOP)[3]
    graph.set_enabled([closure], False)
    assert prune_closures(graph, 100.0).disabled.size == 0
    assert not graph.edges.enabled[closure]


def test_pruning_gives_the_same_every_time():
    outcomes = set()
    for _ in range(2):
        graph, _, _ = walk_graph(200, 80, outliers=30)
        result = prune_closures(graph, 6.0)
        outcomes.add((result.disabled.tobytes(), graph.poses.tobytes()))
    assert len(outcomes) == 1
