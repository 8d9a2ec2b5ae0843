"""Levenberg-Marquardt on the sparse normal equations."""

from dataclasses import dataclass

import numpy as np

from glassslam.posegraph.system import System
from glassslam.records import FloatArray

_NEGLIGIBLE = 1e-12
"""A cost that means nothing: residuals are in standard deviations."""
_LEAST_CURVATURE = 1e-9
"""Damping of directions no edge speaks of, relative to the largest curvature of the graph."""
_GIVE_UP = 1e12


@dataclass(frozen=True, slots=True)
class Solution:
    """Where a solver stopped."""

    poses: FloatArray
    iterations: int
    initial_cost: float
    final_cost: float
    converged: bool


def minimise(system: System, poses: FloatArray, max_iterations: int, tolerance: float) -> Solution:
    """Move the variables to the least cost.

    Parameters
    ----------
    system : System
        The graph.
    poses : ndarray of float64, shape (v, 3)
        Where to start; not changed.
    max_iterations : int
        Most linear systems solved.
    tolerance : float
        Stop when the next step promises less than this share of the cost.
    """
    cost = initial = system.linearise(poses)
    damping, growth, converged, iterations = 1e-6, 2.0, system.size == 0, 0
    while not converged and iterations < max_iterations and damping < _GIVE_UP:
        iterations += 1
        scaled = damping * _curvature(system)
        if not system.factorise(scaled):
            damping, growth = damping * growth, 2.0 * growth
            continue
        step = -system.solve(system.gradient)
        promised = 0.5 * float(np.sum(step * (scaled * step - system.gradient)))
        candidate = system.moved(poses, step)
        new_cost = system.cost(candidate)
        small = promised <= tolerance * cost + _NEGLIGIBLE
        if new_cost < cost:
            ratio = (cost - new_cost) / promised
            damping, growth = damping * max(0.1, 1.0 - (2.0 * ratio - 1.0) ** 3), 2.0
            poses, cost = candidate, new_cost
            converged = small
            if not converged:
                system.linearise(poses)
        else:
            # a promise this small is kept or broken by rounding alone
            converged = small
            damping, growth = damping * growth, 2.0 * growth
    return Solution(poses, iterations, initial, cost, converged)


def _curvature(system: System) -> FloatArray:
    diagonal = system.diagonal[:, ::4]
    floor = _LEAST_CURVATURE * float(diagonal.max(initial=0.0)) + np.finfo(np.float64).tiny
    return np.asarray(np.maximum(diagonal, floor))
