"""Which loop closures to believe, beyond robust losses.

Three filters, from early to late: a candidate against what the graph knows already
(`closure_distances`), candidates against each other through the odometry between them
(`consistent_closures`; Mangelson, Dominic, Eustice and Vasudevan, ICRA 2018), and closures against
the optimised graph (`prune_closures`).
"""

from dataclasses import dataclass

import numpy as np

from glassslam.posegraph.covariance import chi_square_limit
from glassslam.posegraph.graph import Loss, OptimizationReport, Solver
from glassslam.posegraph.linearise_kernels import residuals
from glassslam.posegraph.pairwise import (
    OdometryChain,
    agreement,
    consistent_closures,
    largest_clique,
    odometry_chain,
)
from glassslam.posegraph.pose_graph import PoseGraph
from glassslam.posegraph.storage import LOOP
from glassslam.posegraph.structure_kernels import Integers
from glassslam.records import FloatArray

__all__ = [
    "OdometryChain",
    "PruneReport",
    "agreement",
    "chi_square_limit",
    "closure_distances",
    "consistent_closures",
    "largest_clique",
    "odometry_chain",
    "prune_closures",
]


def closure_distances(
    graph: PoseGraph, ends: Integers, measured: FloatArray, sqrt_information: FloatArray
) -> FloatArray:
    """Squared Mahalanobis distance of candidate closures from what the graph says already.

    Compare with `chi_square_limit`. Ask before the candidates are added to the graph.

    Parameters
    ----------
    graph : PoseGraph
        Optimised, without the candidates.
    ends : ndarray of int64, shape (k, 2)
        Vertices a and b.
    measured : ndarray of float64, shape (k, 3)
        Poses a_from_b, m and rad.
    sqrt_information : ndarray of float64, shape (k, 3, 3) or (3, 3)
        W with information = W^T W.

    Returns
    -------
    ndarray of float64, shape (k,)
        0 where the graph does not connect a and b, so that nothing contradicts.

    Raises
    ------
    GraphError
        An unknown vertex, or a graph that leaves a direction open.
    """
    ends = np.asarray(ends, dtype=np.int64).reshape(-1, 2)
    weights = np.array(np.broadcast_to(sqrt_information, (len(ends), 3, 3)), dtype=np.float64)
    known = graph.relative_covariances(ends)
    error = np.empty((len(ends), 3))
    residuals(graph.poses, ends, np.ascontiguousarray(measured, dtype=np.float64), weights, error)
    connected = np.isfinite(known).all(axis=(1, 2))
    out = np.zeros(len(ends))
    w = weights[connected]
    # of W e: the identity of the measurement plus the share of the graph; W may be singular
    covariance = np.eye(3) + w @ known[connected] @ np.swapaxes(w, 1, 2)
    solved = np.linalg.solve(covariance, error[connected][:, :, None])[:, :, 0]
    out[connected] = np.sum(error[connected] * solved, axis=1)
    return out


@dataclass(frozen=True, slots=True)
class PruneReport:
    """What `prune_closures` did.

    Attributes
    ----------
    disabled : ndarray of int64
        Indices of the constraints it disabled, ascending.
    rounds : int
        How often the graph was solved.
    report : OptimizationReport
        Of the last solution.
    """

    disabled: Integers
    rounds: int
    report: OptimizationReport


def prune_closures(
    graph: PoseGraph,
    limit: float,
    *,
    max_rounds: int = 20,
    max_iterations: int = 50,
    solver: Solver = "lm",
    loss: Loss = "huber",
    huber_scale: float = 10.0,
) -> PruneReport:
    """Optimise, disable the closures that do not fit, and solve again until all that remain fit.

    A wrong closure strains good ones nearby, so a round disables only closures that fit at least
    half as badly as the worst; at the end those that fit after all come back.

    Parameters
    ----------
    graph : PoseGraph
        Changed: poses and enabled constraints.
    limit : float
        Largest norm of the weighted residual of a closure.
    max_rounds : int
        Most solutions.
    max_iterations, solver, loss, huber_scale
        As in `PoseGraph.optimize`.

    Raises
    ------
    GraphError
        The graph cannot be solved.
    """
    doubted = np.flatnonzero((graph.edges.kinds == LOOP) & graph.edges.enabled)
    rounds, readmitted = 0, False
    while True:
        report = graph.optimize(max_iterations, solver=solver, loss=loss, huber_scale=huber_scale)
        rounds += 1
        norms, enabled = report.residual_norms[doubted], graph.edges.enabled[doubted]
        bad = enabled & (norms > limit)
        fits_again = ~enabled & (norms <= limit)
        if rounds >= max_rounds or not (bad.any() or (fits_again.any() and not readmitted)):
            return PruneReport(doubted[~enabled], rounds, report)
        if bad.any():
            graph.set_enabled(doubted[bad & (norms >= 0.5 * norms[bad].max())], False)
        else:
            graph.set_enabled(doubted[fits_again], True)
            readmitted = True
