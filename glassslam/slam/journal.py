"""What a run writes down on its way, so that it can be taken up where it ended.

Two steps of a run are costly: matching a scan, and searching for loop closures. Their outcomes are written
down in the order they come. A run that is taken up again reads the recording from the start and does
everything else once more, with these outcomes instead of the two steps; so it arrives at the very state of
before, bit by bit, whatever that state consists of, and goes on from there. An outcome belongs to one scan: a
recording that has lost some in the meantime, or holds others, would get the poses of others. So whatever is
recalled is confirmed by what the recording holds now.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from glassslam.slam.closure import Closure
from glassslam.slam.node import Node
from glassslam.slam.tracking import Match, Tracking


@dataclass(frozen=True, slots=True)
class ScanOutcome:
    """What became of one scan.

    Attributes
    ----------
    match : Match
        Where it fits.
    tracking : Tracking
        What matching carries on to the next scan.
    returns : int
        Its returns after thinning.
    is_node : bool
        Whether it became a node.
    """

    match: Match
    tracking: Tracking
    returns: int
    is_node: bool


class Journal(Protocol):
    """Outcomes of the costly steps of a run, in their order."""

    def recall_scan(self) -> ScanOutcome | None:
        """What became of the next scan; None past the end of what is known."""

    def keep_scan(self, stamp: float, outcome: ScanOutcome, node: Node | None) -> None:
        """Write down what became of a scan, and the node it became."""

    def confirm_scan(self, stamp: float, returns: int, node: Node | None) -> None:
        """Make sure that the scan recalled last is this one, and became this node.

        Parameters
        ----------
        stamp : float
            Stamp of the scan, s.
        returns : int
            Its returns after thinning.
        node : Node or None
            The node it became.

        Raises
        ------
        SessionError
            It is another scan.
        """

    def confirm_end(self) -> None:
        """Make sure, at the end of the records, that all scans that are known have come.

        Raises
        ------
        SessionError
            Some have not.
        """

    def recall_round(self) -> list[Closure] | None:
        """What the next round of searches found; None past the end of what is known."""

    def keep_round(self, closures: Sequence[Closure]) -> None:
        """Write down what a round of searches found."""

    def confirm_round(self, nodes: range) -> None:
        """Make sure that the round recalled last is one for these nodes.

        Raises
        ------
        SessionError
            It has searched for others.
        """


class NoJournal:
    """Knows nothing and writes nothing down."""

    def recall_scan(self) -> ScanOutcome | None:
        """Nothing."""
        return None

    def keep_scan(self, stamp: float, outcome: ScanOutcome, node: Node | None) -> None:
        """Do nothing."""

    def confirm_scan(self, stamp: float, returns: int, node: Node | None) -> None:
        """Do nothing."""

    def confirm_end(self) -> None:
        """Do nothing."""

    def recall_round(self) -> list[Closure] | None:
        """Nothing."""
        return None

    def keep_round(self, closures: Sequence[Closure]) -> None:
        """Do nothing."""

    def confirm_round(self, nodes: range) -> None:
        """Do nothing."""
