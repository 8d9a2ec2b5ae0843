"""Nodes: the scans that are kept (trajectory nodes of Cartographer)."""

from dataclasses import dataclass, field

import numpy as np

from glassslam.records import Float32Array, FloatArray


def _no_points() -> Float32Array:
    return np.empty((0, 2), dtype=np.float32)


@dataclass(frozen=True, slots=True)
class Node:
    """A scan that went into the map.

    Attributes
    ----------
    index : int
        Number of the node.
    scan : int
        Number of the scan in the trajectory.
    stamp : float
        Time of the scan, s.
    pose_in_local : ndarray of float64, shape (3,)
        Pose of the base in the local frame, m and rad.
    sensor : ndarray of float64, shape (2,)
        Position of the laser in the frame of the base, m.
    returns, free_ends : ndarray of float32, shape (n, 2), (m, 2)
        Returns, and ends of the free space of silent beams, in the frame of the base, m.
    residual : float
        Root mean square of 1 - P(occupied) of the local match.
    doubtful : bool
        Whether the step from the node before was bridged rather than tracked: a gap in the recording, a
        relocalisation, or odometry overruled.
    ghosts : ndarray of float32, shape (g, 2)
        Returns from behind glass that are kept out of matching, in the frame of the base, m.
    begins : bool
        Whether a new stretch of the run begins here: where it lies to the nodes before is hardly known.
    """

    index: int
    scan: int
    stamp: float
    pose_in_local: FloatArray
    sensor: FloatArray
    returns: Float32Array
    free_ends: Float32Array
    residual: float
    doubtful: bool = False
    ghosts: Float32Array = field(default_factory=_no_points)
    begins: bool = False

    @property
    def ends(self) -> Float32Array:
        """Everything that came back, returns before ghosts, shape (n + g, 2), m."""
        return np.concatenate((self.returns, self.ghosts)) if len(self.ghosts) else self.returns
