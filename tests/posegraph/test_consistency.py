"""Which loop closures are believed."""

import networkx as nx
import numpy as np
import pytest
import scipy.linalg
from hypothesis import given
from hypothesis import strategies as st
from pose_worlds import STEP_SIGMA, WEIGHT, naive_error, walk_graph

from glassslam.errors import GraphError
from glassslam.geometry import between, compose, inverse
from glassslam.posegraph import PoseGraph
from glassslam.posegraph.clique_kernels import exact_clique, greedy_clique
from glassslam.posegraph.consistency import (
    agreement,
    chi_square_limit,
    closure_distances,
    consistent_closures,
    largest_clique,
    odometry_chain,
    prune_closures,
)
from glassslam.posegraph.storage import LOOP


def closures_of(graph):
    loops = np.flatnonzero(graph.edges.kinds == LOOP)
    return loops, graph.edges.ends[loops], graph.edges.measured[loops], graph.edges.weights[loops]


def chain_of(graph):
    steps = np.tile(np.diag(STEP_SIGMA**2), (len(graph.poses) - 1, 1, 1))
    return odometry_chain(graph.poses, steps)


def matrix(pose):
    c, s = np.cos(pose[2]), np.sin(pose[2])
    return np.array([[c, -s, pose[0]], [s, c, pose[1]], [0, 0, 1]])


def adjoint(motion):
    out = motion.copy()
    out[:2, 2] = motion[1, 2], -motion[0, 2]
    return out


def twist(motion):
    logarithm = np.real(scipy.linalg.logm(motion))
    return np.array([logarithm[0, 2], logarithm[1, 2], logarithm[1, 0]])


def naive_chain_covariance(poses, i, k, step):
    """Covariance of the way between two stations as a twist in the local frame, summed step by step."""
    total = np.zeros((3, 3))
    for m in range(min(i, k), max(i, k)):
        turn = np.eye(3)
        turn[:2, :2] = matrix(poses[m])[:2, :2]
        lever = np.eye(3)
        lever[:2, 2] = poses[m + 1][1], -poses[m + 1][0]
        total += lever @ turn @ step @ turn.T @ lever.T
    return total


def naive_distance(poses, step, closures, i, k):
    """Squared Mahalanobis length of the cycle by matrices, logarithm and adjoints."""
    correction, spread = [], []
    for (a, b), z, w in (closures[i], closures[k]):
        claimed = matrix(poses[a]) @ matrix(z)
        correction.append(claimed @ np.linalg.inv(matrix(poses[b])))
        turn = np.eye(3)
        turn[:2, :2] = matrix(poses[a])[:2, :2]
        lever = np.eye(3)
        lever[:2, 2] = claimed[1, 2], -claimed[0, 2]
        spread.append(lever @ turn @ np.linalg.inv(w.T @ w) @ turn.T @ lever.T)
    (ai, bi), (ak, bk) = closures[i][0], closures[k][0]
    moved = adjoint(correction[0])
    covariance = spread[0] + spread[1] + naive_chain_covariance(poses, ai, ak, step)
    covariance += moved @ naive_chain_covariance(poses, bi, bk, step) @ moved.T
    error = twist(correction[0] @ np.linalg.inv(correction[1]))
    return error @ np.linalg.solve(covariance, error)


def unpacked(bits):
    return np.unpackbits(bits.view(np.uint8), axis=1, bitorder="little")[:, : len(bits)].astype(bool)


def packed(relation):
    padded = np.zeros((len(relation), (len(relation) + 63) // 64 * 64), dtype=bool)
    padded[:, : len(relation)] = relation
    return np.packbits(padded, axis=1, bitorder="little").view(np.uint64)


@pytest.mark.parametrize("seed", range(3))
def test_pairs_agree_when_their_cycle_closes(seed):
    graph, _, _ = walk_graph(60, 10, outliers=3, seed=seed)
    _, ends, measured, weights = closures_of(graph)
    closures = list(zip(ends, measured, weights, strict=True))
    step = np.diag(STEP_SIGMA**2)
    relation = unpacked(agreement(chain_of(graph), ends, measured, weights, 0.99))
    for i in range(len(ends)):
        assert not relation[i, i]
        for k in range(i + 1, len(ends)):
            distance = naive_distance(graph.poses, step, closures, i, k)
            expected = distance <= chi_square_limit(0.99)
            assert relation[i, k] == relation[k, i]
            assert relation[i, k] == expected or abs(distance - chi_square_limit(0.99)) < 1e-6


def test_drift_is_the_covariance_of_many_drives():
    rng = np.random.default_rng(0)
    _, true, _ = walk_graph(21, 0)
    steps = between(true[:-1], true[1:])
    poses = np.zeros((4000, 3))
    for step in steps:
        poses = compose(poses, step + rng.normal(size=poses.shape) * STEP_SIGMA)
    # a motion this small is its own logarithm to first order
    back = compose(poses, inverse(true[-1]))
    chain = odometry_chain(true, np.tile(np.diag(STEP_SIGMA**2), (20, 1, 1)))
    sampled = np.cov(back.T)
    np.testing.assert_allclose(chain.drift[-1], sampled, atol=0.1 * np.abs(sampled).max())


@pytest.mark.parametrize("seed", range(5))
def test_the_largest_consistent_set_holds_the_right_closures_only(seed):
    graph, _, wrong = walk_graph(200, 80, outliers=30, seed=seed)
    loops, ends, measured, weights = closures_of(graph)
    kept = consistent_closures(chain_of(graph), ends, measured, weights)
    assert not kept[np.isin(loops, wrong)].any()
    assert kept[~np.isin(loops, wrong)].all()


def test_one_weight_serves_all_closures():
    graph, _, _ = walk_graph(60, 10, outliers=2)
    _, ends, measured, weights = closures_of(graph)
    chain = chain_of(graph)
    np.testing.assert_array_equal(
        consistent_closures(chain, ends, measured, WEIGHT),
        consistent_closures(chain, ends, measured, weights),
    )


def test_no_closures_are_a_consistent_set():
    graph, _, _ = walk_graph(30, 0)
    kept = consistent_closures(chain_of(graph), np.zeros((0, 2)), np.zeros((0, 3)), WEIGHT)
    assert kept.shape == (0,)


relations = st.integers(1, 14).flatmap(
    lambda n: st.tuples(
        st.just(n), st.lists(st.booleans(), min_size=n * (n - 1) // 2, max_size=n * (n - 1) // 2)
    )
)


def relation_of(drawn):
    n, values = drawn
    relation = np.zeros((n, n), dtype=bool)
    relation[np.triu_indices(n, 1)] = values
    return relation | relation.T


def largest_size(relation):
    return max(len(clique) for clique in nx.find_cliques(nx.from_numpy_array(relation)))


@given(relations)
def test_a_small_relation_gives_its_largest_clique(drawn):
    relation = relation_of(drawn)
    members = largest_clique(packed(relation))
    assert (np.diff(members) > 0).all()
    assert relation[np.ix_(members, members)].sum() == members.size * (members.size - 1)
    assert members.size == largest_size(relation)


@given(relations, st.integers(0, 14))
def test_the_exact_search_finds_only_what_is_larger_than_asked(drawn, at_least):
    relation = relation_of(drawn)
    members, proven = exact_clique(packed(relation), at_least, 10**6)
    assert proven
    assert members.size == (largest_size(relation) if largest_size(relation) > at_least else 0)


@given(relations)
def test_the_greedy_search_finds_a_clique_nobody_can_join(drawn):
    relation = relation_of(drawn)
    members = greedy_clique(packed(relation), np.arange(len(relation)), 3)
    assert relation[np.ix_(members, members)].sum() == members.size * (members.size - 1)
    assert not relation[:, members].all(axis=1).any()


@pytest.mark.parametrize("size", [63, 64, 65, 130, 200])
def test_the_exact_search_beats_the_greedy_one_across_words(size):
    rng = np.random.default_rng(size)
    relation = np.triu(rng.random((size, size)) < 0.4, 1)
    relation |= relation.T
    members = largest_clique(packed(relation))
    assert relation[np.ix_(members, members)].sum() == members.size * (members.size - 1)
    assert members.size == largest_size(relation)


def test_a_spent_budget_is_told():
    relation = ~np.eye(20, dtype=bool)
    assert exact_clique(packed(relation), 0, 3)[1] is False


def test_a_candidate_is_measured_by_what_the_graph_knows():
    graph, true, _ = walk_graph(41, 0)
    z = between(true[0], true[40])
    error = WEIGHT @ naive_error(graph.poses[0], graph.poses[40], z)
    covariance = np.eye(3) + WEIGHT @ graph.relative_covariance(0, 40) @ WEIGHT.T
    expected = error @ np.linalg.solve(covariance, error)
    distance = closure_distances(graph, np.array([[0, 40]]), z[None], WEIGHT)
    np.testing.assert_allclose(distance, [expected], rtol=1e-9)


def test_the_gate_stops_wrong_candidates_and_passes_good_ones():
    graph, _, wrong = walk_graph(100, 60, outliers=20, seed=2)
    loops, ends, measured, weights = closures_of(graph)
    graph.set_enabled(loops, False)
    # trust the odometry: the walk is short, so that a metre off is far off
    passed = closure_distances(graph, ends[:40], measured[:40], weights[:40]) < chi_square_limit(0.999)
    is_wrong = np.isin(loops[:40], wrong)
    assert passed[~is_wrong].mean() > 0.95
    assert passed[is_wrong].mean() < 0.35


def test_nothing_contradicts_a_candidate_between_separate_parts():
    graph, _, _ = walk_graph(30, 0)
    alone = graph.add_pose((0, 0, 0))
    assert closure_distances(graph, np.array([[3, alone]]), np.array([[99.0, 0, 0]]), WEIGHT) == [0.0]


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


def test_the_filters_give_the_same_every_time():
    outcomes = set()
    for _ in range(2):
        graph, _, _ = walk_graph(200, 80, outliers=30)
        _, ends, measured, weights = closures_of(graph)
        kept = consistent_closures(chain_of(graph), ends, measured, weights)
        result = prune_closures(graph, 6.0)
        outcomes.add((kept.tobytes(), result.disabled.tobytes(), graph.poses.tobytes()))
    assert len(outcomes) == 1


def raises(message):
    return pytest.raises(GraphError, match=f"^{message}$")


def test_what_makes_no_sense_is_refused_in_one_line():
    graph, _, _ = walk_graph(30, 0)
    chain = chain_of(graph)
    with raises("closure of a station that is not in the chain"):
        consistent_closures(chain, np.array([[0, 30]]), np.zeros((1, 3)), WEIGHT)
    with raises("closure whose information has a zero direction"):
        consistent_closures(chain, np.array([[0, 9]]), np.zeros((1, 3)), np.diag([1.0, 0.0, 1.0]))
    with raises(r"\(3, 3, 3\) covariances do not fit poses of shape \(3, 3\)"):
        odometry_chain(np.zeros((3, 3)), np.zeros((3, 3, 3)))
    with raises("odometry that is not finite"):
        odometry_chain(np.array([[0, 0, 0], [np.nan, 0, 0]]), np.zeros((1, 3, 3)))
    empty = PoseGraph()
    with raises("no vertex 0: the graph has 0"):
        closure_distances(empty, np.array([[0, 1]]), np.zeros((1, 3)), WEIGHT)
