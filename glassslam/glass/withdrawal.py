"""Glass that is there no more: a door opened, a pane moved.

Misses never take glass out of the map: beams are expected to pass. Only beams that pass where glass would
have answered - at normal incidence, from as near as it did answer - speak against it, and only those of
nodes after its last answer.
"""

import math

import numpy as np
from numpy.typing import NDArray

from glassslam.glass.beams import BeamEvidence
from glassslam.glass.evidence_kernels import count_silent_nodes
from glassslam.glass.lines import Line
from glassslam.records import FloatArray

_BEYOND = 0.25
_NORMAL_LIMIT = math.radians(4.0)
_REACH = 1.2
# glass that answers less often proves nothing by its silence
_LEAST_RATE = 0.3
# the rate is that of a whole wall: no single piece answers surer than this
_MOST_RATE = 0.6


def withdrawn_pieces(
    line: Line,
    spans: FloatArray,
    nodes: NDArray[np.int64],
    distances: FloatArray,
    pieces: tuple[float, float, int],
    node_poses: FloatArray,
    beams: BeamEvidence,
    evidence: float,
) -> NDArray[np.bool_]:
    """Pieces of a line that answered once and, by what was seen later, are no longer glass.

    Parameters
    ----------
    line : Line
        The line.
    spans : ndarray of float64, shape (k, 2)
        From where to where each observation reaches along the line, m from its foot.
    nodes : ndarray of int64, shape (k,)
        The nodes of the observations, numbered in the order of time.
    distances : ndarray of float64, shape (k,)
        Distances from which they were made, m.
    pieces : tuple of float, float, int
        Where the first piece begins, m from the foot; length of a piece, m; number of pieces b.
    node_poses : ndarray of float64, shape (n, 3)
        Optimised poses, m and rad.
    beams : BeamEvidence
        Of all nodes.
    evidence : float
        Log odds by which silence must speak against the piece.

    Returns
    -------
    ndarray of bool, shape (b,)
    """
    start, step, count = pieces
    answered, last = _answers(spans, nodes, pieces, len(node_poses))
    before, after = (np.zeros(count, dtype=np.int64) for _ in range(2))
    answers = int(answered.sum())
    for kind in (beams.returns, beams.silent):
        count_silent_nodes(
            node_poses, kind.sensors, kind.ends, kind.first, line.foot, line.direction, start, step, _BEYOND,
            _NORMAL_LIMIT, _REACH * float(np.quantile(distances, 0.9)), last, answered, before, after,
        )  # fmt: skip
    seen = last >= 0
    rate = answers / max(1, answers + int(before[seen].sum()))
    against = -math.log1p(-min(rate, _MOST_RATE)) * after
    return np.asarray(seen & (rate > _LEAST_RATE) & (against > evidence))


def _answers(
    spans: FloatArray, nodes: NDArray[np.int64], pieces: tuple[float, float, int], node_count: int
) -> tuple[NDArray[np.uint8], NDArray[np.int64]]:
    """Which node had an answer of which piece, shape (n, b), and the last node that had, -1 for none."""
    start, step, count = pieces
    answered = np.zeros((node_count, count), dtype=np.uint8)
    last = np.full(count, -1, dtype=np.int64)
    for (low, high), node in zip(spans - start, nodes, strict=True):
        covered = slice(max(0, int(low / step)), int(high / step) + 1)
        answered[node, covered] = 1
        last[covered] = np.maximum(last[covered], node)
    return answered, last
