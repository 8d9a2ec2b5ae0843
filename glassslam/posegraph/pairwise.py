"""Loop closures against each other: the largest set that agrees pairwise through odometry."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glassslam.errors import GraphError
from glassslam.geometry import compose, inverse
from glassslam.posegraph import clique_kernels, consistency_kernels
from glassslam.posegraph.covariance import chi_square_limit
from glassslam.posegraph.structure_kernels import Integers
from glassslam.records import FloatArray

_GREEDY_STARTS = 64
_EXACT_MEMBERS = 1024
_EXACT_BRANCHES = 20_000


@dataclass(frozen=True, slots=True)
class OdometryChain:
    """Stations along a trajectory and how far odometry may have drifted between them.

    Attributes
    ----------
    poses : ndarray of float64, shape (n, 3)
        Poses in the drifting local frame, in the order driven, m and rad.
    drift : ndarray of float64, shape (n, 3, 3)
        Covariance from the first station to each, as a twist in the local frame: differences of two
        of them belong to the way between, so any pair of stations costs the same.
    """

    poses: FloatArray
    drift: FloatArray


def odometry_chain(poses: FloatArray, step_covariances: FloatArray) -> OdometryChain:
    """Accumulate the covariances of the steps between consecutive stations.

    Parameters
    ----------
    poses : ndarray of float64, shape (n, 3)
        Poses of the stations (nodes, submaps) in the local frame, in the order driven.
    step_covariances : ndarray of float64, shape (n - 1, 3, 3)
        Covariance of the pose of station i + 1 in the frame of station i, (m, m, rad).

    Raises
    ------
    GraphError
        Shapes that do not fit or values that are not finite.
    """
    poses, steps = np.asarray(poses, dtype=np.float64), np.asarray(step_covariances, dtype=np.float64)
    if poses.ndim != 2 or poses.shape[1] != 3 or steps.shape != (max(len(poses) - 1, 0), 3, 3):
        raise GraphError(
            f"{steps.shape} covariances do not fit poses of shape {poses.shape}", "one per step is needed"
        )
    if not (np.isfinite(poses).all() and np.isfinite(steps).all()):
        raise GraphError("odometry that is not finite", "leave out poses the front end lost")
    drift = np.zeros((len(poses), 3, 3))
    np.cumsum(_as_twists(poses[:-1], poses[1:], steps), axis=0, out=drift[1:])
    return OdometryChain(poses, drift)


def agreement(
    chain: OdometryChain,
    ends: Integers,
    measured: FloatArray,
    sqrt_information: FloatArray,
    probability: float = 1.0 - 1e-6,
) -> NDArray[np.uint64]:
    """Which closures agree pairwise, as rows of bits; arguments as in `consistent_closures`."""
    ends = np.asarray(ends, dtype=np.int64).reshape(-1, 2)
    if ends.size and not (ends.min() >= 0 and ends.max() < len(chain.poses)):
        raise GraphError("closure of a station that is not in the chain", "indices count from 0")
    measured = np.asarray(measured, dtype=np.float64).reshape(-1, 3)
    weights = np.broadcast_to(sqrt_information, (len(ends), 3, 3))
    a, b = chain.poses[ends[:, 0]], chain.poses[ends[:, 1]]
    claimed = compose(a, measured)
    moves = compose(claimed, inverse(b))
    corrections = np.column_stack((moves, np.cos(moves[:, 2]), np.sin(moves[:, 2])))
    try:
        covariance = np.asarray(np.linalg.inv(np.swapaxes(weights, 1, 2) @ weights), dtype=np.float64)
    except np.linalg.LinAlgError as error:
        raise GraphError(
            "closure whose information has a zero direction", "pairwise tests need all three"
        ) from error
    spread = _as_twists(a, claimed, covariance)
    return consistency_kernels.consistent_pairs(
        ends, corrections, spread, chain.drift, chi_square_limit(probability)
    )


def consistent_closures(
    chain: OdometryChain,
    ends: Integers,
    measured: FloatArray,
    sqrt_information: FloatArray,
    probability: float = 1.0 - 1e-6,
) -> NDArray[np.bool_]:
    """Largest set of closures that agree pairwise (pairwise consistency maximisation).

    Two closures agree when the cycle through both and through the odometry between their ends
    comes back to where it began, within the uncertainty of all four.

    Parameters
    ----------
    chain : OdometryChain
        Stations the closures join.
    ends : ndarray of int64, shape (k, 2)
        Stations a and b of every closure.
    measured : ndarray of float64, shape (k, 3)
        Poses a_from_b, m and rad.
    sqrt_information : ndarray of float64, shape (k, 3, 3) or (3, 3)
        W with information = W^T W, of full rank.
    probability : float
        That two good closures agree. Near 1: among k closures each has to pass k - 1 tests.

    Returns
    -------
    ndarray of bool, shape (k,)
        Members of the set; of sets of equal size always the same one.

    Raises
    ------
    GraphError
        Unknown stations, singular information, or a probability outside (0, 1).
    """
    bits = agreement(chain, ends, measured, sqrt_information, probability)
    members = largest_clique(bits)
    out = np.zeros(len(bits), dtype=np.bool_)
    out[members] = True
    return out


def largest_clique(bits: NDArray[np.uint64]) -> Integers:
    """Largest set of mutually agreeing members found, ascending.

    Exact when at most 1024 members are in question and the search ends within its budget of
    branches; the best greedy set otherwise. The answer depends on the input alone.

    Parameters
    ----------
    bits : ndarray of uint64, shape (k, ceil(k / 64))
        Symmetric relation; no member with itself.
    """
    if not len(bits):
        return np.zeros(0, dtype=np.int64)
    degree = np.bitwise_count(bits).sum(axis=1, dtype=np.int64)
    order = np.argsort(-degree, kind="stable")
    best = clique_kernels.greedy_clique(bits, order, _GREEDY_STARTS)
    # members with fewer partners cannot be in a larger set, those with all partners are in every one
    universal = np.flatnonzero(degree == len(bits) - 1)
    open_members = order[(degree[order] >= best.size) & (degree[order] < len(bits) - 1)]
    if best.size - universal.size < open_members.size <= _EXACT_MEMBERS:
        reduced = _subset(bits, open_members)
        found, _ = clique_kernels.exact_clique(reduced, best.size - universal.size, _EXACT_BRANCHES)
        if found.size:
            best = np.concatenate((universal, open_members[found]))
    return np.sort(best)


def _as_twists(a: FloatArray, b: FloatArray, covariances: FloatArray) -> FloatArray:
    """Covariances (k, 3, 3) of poses b in the frames of a, as twists about the common origin."""
    moved = np.zeros((len(a), 3, 3))
    moved[:, 0, 0] = moved[:, 1, 1] = np.cos(a[:, 2])
    moved[:, 1, 0] = np.sin(a[:, 2])
    moved[:, 0, 1] = -moved[:, 1, 0]
    moved[:, 0, 2], moved[:, 1, 2], moved[:, 2, 2] = b[:, 1], -b[:, 0], 1.0
    return np.asarray(moved @ covariances @ np.swapaxes(moved, 1, 2))


def _subset(bits: NDArray[np.uint64], members: Integers) -> NDArray[np.uint64]:
    """The relation among `members`, renumbered in their order."""
    full = np.unpackbits(bits.view(np.uint8), axis=1, bitorder="little").astype(np.bool_)
    chosen = full[np.ix_(members, members)]
    padded = np.zeros((members.size, (members.size + 63) // 64 * 64), dtype=np.bool_)
    padded[:, : members.size] = chosen
    return np.packbits(padded, axis=1, bitorder="little").view(np.uint64)
