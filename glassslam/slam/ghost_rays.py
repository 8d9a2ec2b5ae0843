"""What the rays of nodes clear and hit in a map that leaves out ghosts."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from glassslam.records import Float32Array
from glassslam.slam.node import Node

if TYPE_CHECKING:  # runs that do not look for glass need not load what finds it
    from glassslam.glass.ghosts import Ghosts, Kept


def visible_rays(
    nodes: Sequence[Node], ghosts: "Ghosts | None", kept: "Kept"
) -> Iterator[tuple[Float32Array, Float32Array]]:
    """Returns (h, 2) and ends of free space (f, 2) of every node, frame of its base, m.

    The ray of a return that is left out ends as free space at the first wall it crosses. Where nothing seen
    through glass is kept, silent rays end there as well. Ends of free space begin with those of silent rays.

    Parameters
    ----------
    nodes : sequence of Node
        All nodes.
    ghosts : Ghosts or None
        Of these nodes.
    kept : {"all", "seen_through", "none"}
        Ghosts that the map shows.
    """
    if ghosts is None or kept == "all":
        yield from ((node.ends, node.free_ends) for node in nodes)
        return
    hidden = ghosts.hidden(kept)
    returns = silent = 0
    for node in nodes:
        ends = slice(returns, returns + len(node.ends))
        quiet = slice(silent, silent + len(node.free_ends))
        returns, silent = ends.stop, quiet.stop
        free = node.free_ends if kept != "none" else _cut(node, node.free_ends, ghosts.silent_share[quiet])
        away: NDArray[np.bool_] = hidden[ends]
        stopped = _cut(node, node.ends[away], ghosts.share[ends][away])
        yield node.ends[~away], np.concatenate((free, stopped))


def _cut(node: Node, ends: Float32Array, share: Float32Array) -> Float32Array:
    """Ends of rays after a share of their way."""
    sensor = node.sensor.astype(np.float32)
    return np.asarray(sensor + share[:, None] * (ends - sensor), dtype=np.float32)
