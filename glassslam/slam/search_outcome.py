"""What became of one search for a loop closure, without what was matched for it."""

import math
from dataclasses import dataclass

from glassslam.slam.closure import Closure


@dataclass(frozen=True, slots=True)
class SearchOutcome:
    """What the report needs of a search.

    Attributes
    ----------
    node, anchor : int
        The node, and the node of the submap nearest to it.
    rejected : str
        As in `Closure`.
    ambiguous : bool
        As in `Closure`.
    distance : float
        How far from the anchor the node was expected, m.
    """

    node: int
    anchor: int
    rejected: str
    ambiguous: bool
    distance: float

    @classmethod
    def of(cls, closure: Closure) -> "SearchOutcome":
        """Of a closure found or rejected."""
        candidate = closure.candidate
        distance = math.hypot(*candidate.anchor_from_node[:2].tolist())
        return cls(candidate.node, candidate.anchor, closure.rejected, closure.ambiguous, distance)
