"""Loop closures against the optimised graph: those that do not fit are taken out.

Candidates are tested against the covariance of the graph before they enter it (`slam/closure.py`);
this is the test after the fact, beyond what a robust loss can do.
"""

from dataclasses import dataclass

import numpy as np

from glassslam.posegraph.graph import Loss, OptimizationReport, Solver
from glassslam.posegraph.pose_graph import PoseGraph
from glassslam.posegraph.storage import LOOP
from glassslam.posegraph.structure_kernels import Integers


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
