"""The beams of a whole run, which see where glass cannot answer."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glassslam.records import Float32Array, FloatArray


@dataclass(frozen=True, slots=True)
class Beams:
    """End points of the beams of all nodes, packed.

    Attributes
    ----------
    sensors : ndarray of float64, shape (n, 2)
        Position of the laser in the frame of the base at each node, m.
    ends : ndarray of float32, shape (m, 2)
        End points in the frames of the bases of their nodes, m.
    first : ndarray of int64, shape (n + 1,)
        Row of `ends` where each node begins.
    """

    sensors: FloatArray
    ends: Float32Array
    first: NDArray[np.int64]

    @classmethod
    def pack(cls, sensors: Sequence[FloatArray], ends: Sequence[Float32Array]) -> "Beams":
        """Pack the end points (m_i, 2) of every node."""
        lengths = [len(points) for points in ends]
        joined = np.concatenate(ends) if ends else np.empty((0, 2), np.float32)
        return cls(
            np.array(sensors).reshape(-1, 2),
            joined,
            np.concatenate(([0], np.cumsum(lengths))).astype(np.int64),
        )


@dataclass(frozen=True, slots=True)
class BeamEvidence:
    """What all beams of a run tell about free space and surfaces.

    Attributes
    ----------
    returns, silent : Beams
        Beams that came back, ending on a surface, and beams without echo, ending in free space.
    """

    returns: Beams
    silent: Beams
