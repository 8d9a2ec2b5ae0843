"""Where a run went on though the scans did not say enough: stretches that a reader of the map should know of.

The limits were chosen on recordings of offices, corridors and halls: well-built places give few or none.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from glassslam.records import FloatArray
from glassslam.slam.degeneracy_words import scans_of, times
from glassslam.slam.motion_watch import MotionReport
from glassslam.slam.result import Degeneracy
from glassslam.slam.search_outcome import SearchOutcome
from glassslam.slam.tracking import Event, How, MatchArrays

_LEAST_HOLD, _LEAST_SLIDE, _SMALL_GAP = 0.05, 2.0, 0.5
_LOW_OVERLAP, _POOR_RESIDUAL, _LASTING_SCANS = 0.4, 0.55, 5
_SAME_PLACE = 3.0


@dataclass(frozen=True)
class Trace:
    """What is known of every scan of a run.

    Attributes
    ----------
    stamps : ndarray of float64, shape (n,)
        Times, s.
    local, final : ndarray of float64, shape (n, 3)
        Poses by local SLAM, and after the last optimisation, m and rad.
    matches : MatchArrays
        What their matches found.
    node_scans : ndarray of int64, shape (k,)
        Scan of every node.
    begins : list of int
        First nodes of the stretches after the first one.
    searches : sequence of SearchOutcome
        Searches for loop closures.
    used, taken_out : ndarray of int64, shape (m, 2), (l, 2)
        Nodes of the closures in use, and of those that did not fit.
    with_odometry : bool
        Whether the recording has odometry.
    motion : MotionReport
        What told how the robot moved; None: odometry did, all the way.
    """

    stamps: FloatArray
    local: FloatArray
    final: FloatArray
    matches: MatchArrays
    node_scans: NDArray[np.int64]
    begins: list[int]
    searches: Sequence[SearchOutcome]
    used: NDArray[np.int64]
    taken_out: NDArray[np.int64]
    with_odometry: bool = True
    motion: MotionReport | None = None

    @cached_property
    def travelled(self) -> FloatArray:
        """Way to every scan, m, shape (n,); the step over a break is none."""
        return _travel(self.final, self.is_first)

    @cached_property
    def is_first(self) -> NDArray[np.bool_]:
        """Which scans begin a stretch, shape (n,)."""
        return np.asarray(self.matches.how == How.FIRST)

    def told(self, kind: str, first: int, last: int, text: str) -> Degeneracy:
        """A stretch from scan to scan, in words."""
        return Degeneracy(
            kind=kind,
            first_scan=first,
            last_scan=last,
            start=float(self.stamps[first]),
            end=float(self.stamps[last]),
            start_place=(float(self.final[first, 0]), float(self.final[first, 1])),
            end_place=(float(self.final[last, 0]), float(self.final[last, 1])),
            length=float(self.travelled[last] - self.travelled[first]),
            text=text,
        )

    def map_heading(self, scans: NDArray[np.int64], headings: FloatArray) -> float:
        """Mean of directions (k,) in the local frame, in the map, deg in [0, 180): back and forth are one."""
        doubled = 2.0 * (headings + self.final[scans, 2] - self.local[scans, 2])
        mean = 0.5 * math.atan2(float(np.sin(doubled).sum()), float(np.cos(doubled).sum()))
        return round(math.degrees(mean) % 180.0) % 180

    def runs(self, flags: NDArray[np.bool_], gap: float) -> Iterator[tuple[int, int]]:
        """First and last of flagged scans that follow each other within `gap` m of travel, breaks apart."""
        stretch = np.cumsum(self.is_first)
        found = np.flatnonzero(flags)
        if found.size == 0:
            return
        apart = (np.diff(self.travelled[found]) > gap) | (np.diff(stretch[found]) > 0)
        cuts = np.flatnonzero(apart) + 1
        for part in np.split(found, cuts):
            yield int(part[0]), int(part[-1])


def scan_degeneracies(trace: Trace) -> list[Degeneracy]:
    """What the matches of the scans tell, in the order of the recording.

    Parameters
    ----------
    trace : Trace
        The run.
    """
    found = [
        *featureless(trace),
        *_unmatched(trace),
        *_low_overlap(trace),
        *_poor_fit(trace),
        *_lost(trace),
        *_odometry_jumps(trace),
    ]
    return in_order(found)


def in_order(found: Iterable[Degeneracy]) -> list[Degeneracy]:
    """Stretches in the order in which they begin."""
    return sorted(found, key=lambda one: (one.first_scan, one.last_scan, one.kind))


def featureless(trace: Trace) -> Iterator[Degeneracy]:
    """Bare corridors: the direction that walls do not hold is that in which the robot drives.

    Parameters
    ----------
    trace : Trace
        The run.
    """
    matches = trace.matches
    flags = (matches.points > 0) & (matches.hold < _LEAST_HOLD)
    along = _travel(trace.local, trace.is_first, matches.free_heading)
    decides = "the odometry" if trace.with_odometry else "constant velocity"
    for first, last in trace.runs(flags, _SMALL_GAP):
        length = along[last] - along[first]
        if length < _LEAST_SLIDE:
            continue
        found = np.flatnonzero(flags[first : last + 1]) + first
        heading = trace.map_heading(found, matches.free_heading[found])
        yield trace.told(
            "featureless",
            first,
            last,
            f"{length:.1f} m along bare walls at {heading:.0f} deg: there {decides} alone tells how far",
        )


def _unmatched(trace: Trace) -> Iterator[Degeneracy]:
    flags = trace.matches.how == How.UNMATCHED
    for first, last in trace.runs(flags, _SMALL_GAP):
        count = int(flags[first : last + 1].sum())
        yield trace.told(
            "unmatched", first, last, f"{scans_of(count)} with too few returns: poses are predictions"
        )


def _low_overlap(trace: Trace) -> Iterator[Degeneracy]:
    matches = trace.matches
    flags = (matches.points > 0) & (matches.overlap < _LOW_OVERLAP)
    for first, last in trace.runs(flags, _SMALL_GAP):
        count, least = int(flags[first : last + 1].sum()), float(matches.overlap[first : last + 1].min())
        if count >= _LASTING_SCANS:
            yield trace.told(
                "low overlap",
                first,
                last,
                f"{scans_of(count)} saw little of the map, at least {least:.0%} of it",
            )


def _poor_fit(trace: Trace) -> Iterator[Degeneracy]:
    matches = trace.matches
    flags = (matches.points > 0) & (matches.residual > _POOR_RESIDUAL)
    usual = float(np.median(matches.residual[matches.points > 0])) if (matches.points > 0).any() else 0.0
    for first, last in trace.runs(flags, _SMALL_GAP):
        count, worst = int(flags[first : last + 1].sum()), float(matches.residual[first : last + 1].max())
        if count >= _LASTING_SCANS:
            text = f"{scans_of(count)} fit the map badly: residual up to {worst:.2f}, usual is {usual:.2f}"
            yield trace.told("poor fit", first, last, text)


def _lost(trace: Trace) -> Iterator[Degeneracy]:
    flags = trace.matches.how == How.RELOCALISED
    for first, last in trace.runs(flags, _SAME_PLACE):
        count = int(flags[first : last + 1].sum())
        yield trace.told(
            "lost", first, last, f"tracking was lost and found again {times(count)} by search in the submap"
        )


def _odometry_jumps(trace: Trace) -> Iterator[Degeneracy]:
    flags = trace.matches.event & Event.ODOMETRY_JUMP != 0
    for first, last in trace.runs(flags, _SAME_PLACE):
        count = int(flags[first : last + 1].sum())
        yield trace.told(
            "odometry jump", first, last, f"the odometry jumped {times(count)}: the step is not used"
        )


def _travel(poses: FloatArray, is_first: NDArray[np.bool_], heading: FloatArray | None = None) -> FloatArray:
    """Way up to every pose, m; along directions (n,), rad, where they are given."""
    steps = np.diff(poses[:, :2], axis=0, prepend=poses[:1, :2])
    if heading is None:
        lengths = np.hypot(steps[:, 0], steps[:, 1])
    else:
        lengths = np.abs(steps[:, 0] * np.cos(heading) + steps[:, 1] * np.sin(heading))
    return np.cumsum(np.where(is_first, 0.0, lengths))
