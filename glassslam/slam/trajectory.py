"""The pose of every scan, from the poses of the nodes before and after it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glassslam.geometry import between, compose, interpolate
from glassslam.records import FloatArray, Trajectory

_METRES_PER_RADIAN = 0.3


@dataclass(frozen=True, slots=True)
class PoseTracks:
    """The trajectory of one run as it was known at different times.

    Attributes
    ----------
    local : Trajectory
        Every scan, by local SLAM alone.
    partial : Trajectory
        Every scan, corrected by the last optimisation before it.
    nodes : Trajectory
        The nodes after the last optimisation.
    final : Trajectory
        Every scan after the last optimisation, carried along with the nodes around it.
    """

    local: Trajectory
    partial: Trajectory
    nodes: Trajectory
    final: Trajectory


def corrected_poses(
    local_poses: FloatArray,
    node_scans: np.ndarray,
    node_local_poses: FloatArray,
    node_poses: FloatArray,
    node_begins: NDArray[np.bool_] | None = None,
) -> FloatArray:
    """Poses of all scans in the map frame, shape (n, 3).

    Each scan is carried along with the node before it and with the node after it; between the two
    the share of each goes over in proportion to the local motion.

    Parameters
    ----------
    local_poses : ndarray of float64, shape (n, 3)
        Poses of the scans by local SLAM, m and rad.
    node_scans : ndarray of int64, shape (k,)
        Ascending numbers of the scans that are nodes.
    node_local_poses, node_poses : ndarray of float64, shape (k, 3)
        Poses of the nodes by local SLAM and after optimisation.
    node_begins : ndarray of bool, shape (k,), optional
        Nodes that no scan before them goes along with: the first of a stretch.
    """
    if len(node_scans) == 0:
        return local_poses.copy()
    scans = np.arange(len(local_poses))
    before = np.clip(np.searchsorted(node_scans, scans, side="right") - 1, 0, len(node_scans) - 1)
    after = np.minimum(before + 1, len(node_scans) - 1)
    if node_begins is not None:
        after = np.where(node_begins[after], before, after)
    by_before = compose(node_poses[before], between(node_local_poses[before], local_poses))
    by_after = compose(node_poses[after], between(node_local_poses[after], local_poses))
    return interpolate(by_before, by_after, _progress(local_poses, node_scans[before], node_scans[after]))


def _progress(local_poses: FloatArray, start: np.ndarray, end: np.ndarray) -> FloatArray:
    """Share of the local motion from scan `start` to scan `end` done at each scan, in [0, 1]."""
    steps = between(local_poses[:-1], local_poses[1:])
    lengths = np.hypot(steps[:, 0], steps[:, 1]) + _METRES_PER_RADIAN * np.abs(steps[:, 2]) + 1e-9
    travelled = np.concatenate(([0.0], np.cumsum(lengths)))
    whole = travelled[end] - travelled[start]
    done = travelled[np.arange(len(local_poses))] - travelled[start]
    return np.clip(np.where(whole > 0, done / np.where(whole > 0, whole, 1.0), 0.0), 0.0, 1.0)
