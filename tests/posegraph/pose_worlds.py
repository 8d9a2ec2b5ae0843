"""Tiny pose graphs and the naive forms of what the kernels compute."""

import numpy as np

from glassslam.geometry import between, compose
from glassslam.posegraph import PoseGraph

STEP_SIGMA = np.array([0.02, 0.02, 0.005])
WEIGHT = np.diag(1.0 / STEP_SIGMA)


def wrap(angle):
    return (angle + np.pi) % (2 * np.pi) - np.pi


def naive_error(a, b, z):
    """Measured minus (R_a^T (t_b - t_a), theta_b - theta_a) (Hess et al. 2016, section V-A)."""
    rotation = np.array([[np.cos(a[2]), -np.sin(a[2])], [np.sin(a[2]), np.cos(a[2])]])
    return np.append(z[:2] - rotation.T @ (b[:2] - a[:2]), wrap(z[2] - (b[2] - a[2])))


def naive_loss(s, kind, loss, k):
    if kind != "loop" or loss == "none" or (loss == "huber" and s <= k * k):
        return s
    return 2 * k * np.sqrt(s) - k * k if loss == "huber" else s * k * k / (s + k * k)


def naive_cost(poses, constraints, loss, k):
    total = 0.0
    for c in constraints:
        r = c.sqrt_information @ naive_error(poses[c.a], poses[c.b], c.a_from_b)
        total += 0.5 * naive_loss(r @ r, c.kind, loss, k)
    return total


def square_walk(count, side=5):
    """True poses of a robot that drives round and round a square of `side` steps."""
    poses = [np.zeros(3)]
    for i in range(1, count):
        turn = np.pi / 2 if i % side == 0 else 0.0
        poses.append(compose(poses[-1], np.array([1.0, 0.0, turn])))
    return np.array(poses)


def walk_graph(count=40, loops=20, outliers=0, seed=0, side=5):
    """Graph of a noisy square walk, its true poses and the indices of the wrong closures."""
    rng = np.random.default_rng(seed)
    true = square_walk(count, side)
    odometry = between(true[:-1], true[1:]) + rng.normal(size=(count - 1, 3)) * STEP_SIGMA
    poses = [np.zeros(3)]
    for step in odometry:
        poses.append(compose(poses[-1], step))
    graph = PoseGraph()
    graph.add_poses(np.array(poses))
    nodes = np.arange(count)
    graph.add_constraints(nodes[:-1], nodes[1:], odometry, WEIGHT, "odometry")
    a = rng.integers(0, count - 4 * side, loops)
    b = a + 4 * side * rng.integers(1, 1 + (count - 1 - a) // (4 * side))
    b = np.minimum(b + rng.integers(0, 2, loops), count - 1)
    measured = between(true[a], true[b]) + rng.normal(size=(loops, 3)) * STEP_SIGMA
    wrong = np.sort(rng.permutation(loops)[:outliers])
    measured[wrong] += rng.choice([-1, 1], (outliers, 3)) * rng.uniform(
        [1, 1, 0.3], [3, 3, 0.8], (outliers, 3)
    )
    first = graph.add_constraints(a, b, measured, WEIGHT, "loop")
    return graph, true, first + wrong


def copy_of(graph):
    """The same graph, built again constraint by constraint."""
    other = PoseGraph()
    for pose in graph.poses:
        other.add_pose(pose)
    for constraint in graph.constraints:
        other.add_constraint(constraint)
    return other
