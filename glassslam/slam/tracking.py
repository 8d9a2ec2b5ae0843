"""What the match of a scan found, what it leaves behind for the next, and the log of a whole run."""

from array import array
from dataclasses import dataclass
from enum import IntEnum, IntFlag

import numpy as np
from numpy.typing import NDArray

from glassslam.records import FloatArray


class How(IntEnum):
    """How the pose of a scan was found."""

    MATCHED = 0
    """By the match around its prediction."""
    UNMATCHED = 1
    """Too few returns: the pose is the prediction."""
    COASTED = 2
    """By the match around constant velocity, which overruled the odometry."""
    SEARCHED = 3
    """By a correlative search around a doubtful match."""
    RELOCALISED = 4
    """By branch and bound, after tracking was lost."""
    FIRST = 5
    """Nothing to match against: the first scan of a stretch, at its prediction."""


class Event(IntFlag):
    """What the recording did between a scan and the one before."""

    NONE = 0
    GAP = 1
    """It was silent for long."""
    CLOCK_BACK = 2
    """Its clock stepped back by more than a second."""
    ODOMETRY_JUMP = 4
    """Its odometry went farther than a robot drives; the step is not used."""


@dataclass(frozen=True, slots=True)
class Match:
    """What the match of a scan found: all that `LocalSlam.enter` must know of it.

    Attributes
    ----------
    pose : ndarray of float64, shape (3,)
        Pose of the base in the local frame, m and rad.
    residual : float
        Root mean square of 1 - P(occupied) over the points.
    points : int
        Points that were matched; 0 where none were.
    hold : float
        What the fit loses when the scan slides half a metre along the direction that the walls hold least, as
        a share of what it loses across it: about 0 along bare walls, 1 where it is held in all directions;
        0 where nothing was matched.
    free_heading : float
        That direction in the local frame, rad, in (-pi/2, pi/2].
    overlap : float
        Share of the points on observed cells of the submap, in [0, 1].
    how : How
        How the pose was found.
    event : Event
        What the recording did before the scan.
    doubtful : bool
        Whether the step from the last node is bridged rather than tracked.
    """

    pose: FloatArray
    residual: float
    points: int = 0
    hold: float = 0.0
    free_heading: float = 0.0
    overlap: float = 0.0
    how: How = How.MATCHED
    event: Event = Event.NONE
    doubtful: bool = False


@dataclass(slots=True)
class Tracking:
    """All that matching carries from scan to scan beside the submaps.

    Attributes
    ----------
    usual_residual : float
        Running mean of the residuals.
    since_gap : int
        Scans matched since the last gap in the recording.
    since_start : int
        Scans since the stretch began; after a break, below zero while its map is too fresh to lead.
    doubtful : bool
        Whether tracking was bridged since the last node.
    searches, searches_taken : int
        Correlative searches made and believed.
    relocalisations, relocalised : int
        Searches of a lost robot made and believed.
    coasted : int
        Jumps of the odometry overruled by constant velocity.
    unmatched : int
        Scans with too few returns to match.
    """

    usual_residual: float = 0.5
    since_gap: int = 0
    since_start: int = 0
    doubtful: bool = False
    searches: int = 0
    searches_taken: int = 0
    relocalisations: int = 0
    relocalised: int = 0
    coasted: int = 0
    unmatched: int = 0


@dataclass(frozen=True, slots=True)
class MatchArrays:
    """The matches of a run, one element per scan; see `Match`.

    Attributes
    ----------
    residual, hold, free_heading, overlap : ndarray of float64, shape (n,)
    points : ndarray of int64, shape (n,)
    how, event : ndarray of int64, shape (n,)
        Values of `How` and `Event`.
    """

    residual: FloatArray
    hold: FloatArray
    free_heading: FloatArray
    overlap: FloatArray
    points: NDArray[np.int64]
    how: NDArray[np.int64]
    event: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.residual)


class MatchLog:
    """Collects the matches of a run without an object for each."""

    def __init__(self) -> None:
        self._numbers = array("d")
        self._counts = array("q")

    def __len__(self) -> int:
        return len(self._counts) // 3

    def add(self, match: Match) -> None:
        """Take the match of the next scan."""
        self._numbers.extend((match.residual, match.hold, match.free_heading, match.overlap))
        self._counts.extend((match.points, match.how, match.event))

    def arrays(self) -> MatchArrays:
        """Everything collected so far."""
        numbers = np.array(self._numbers).reshape(-1, 4).T
        counts = np.array(self._counts).reshape(-1, 3).T
        return MatchArrays(*numbers, *counts)
