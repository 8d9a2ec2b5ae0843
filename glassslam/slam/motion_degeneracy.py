"""Where nothing told how the robot moves, or the odometry told it wrongly, in words."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from glassslam.records import FloatArray
from glassslam.slam.contradiction import contradictions
from glassslam.slam.degeneracy import Trace, featureless
from glassslam.slam.motion_watch import MotionReport, Stuck
from glassslam.slam.result import Degeneracy

_BARE, _LEAST_HOLD = 0.05, 0.05
_LEAST_TIME, _LONGEST_STEP, _MANY_STEPS = 5.0, 1.0, 3.0
_MOSTLY, _LEAST_WAY = 0.5, 0.25
_RESTS = 0.3


def motion_degeneracies(trace: Trace) -> Iterator[Degeneracy]:
    """Stretches between bare walls without odometry, and of odometry that the scans contradict.

    Along bare walls a match stays where it is expected. A robot that is believed to stand is therefore no
    sign that it stands: its scans fit the place they were first seen from, wherever it is.

    Parameters
    ----------
    trace : Trace
        The run.
    """
    if trace.motion is None:
        return
    yield from _nothing_tells(trace, trace.motion)
    yield from contradictions(trace, trace.motion)
    for stuck in trace.motion.stuck:
        yield _rest(trace, "odometry stuck", "the odometry stood still", stuck)
    for missed in trace.motion.missed:
        # people around a robot that stands; of odometry that is stuck is told above
        if not _wheels_rest(trace.motion.odometry[missed.first : missed.last + 1]):
            yield _rest(trace, "motion missed", "the robot rests in the map", missed)


def _rest(trace: Trace, kind: str, what: str, rest: Stuck) -> Degeneracy:
    seconds = abs(float(trace.stamps[rest.last] - trace.stamps[rest.first]))
    text = f"{what} for {seconds:.0f} s, and {rest.share:.0%} of what the lidar saw changed"
    return trace.told(kind, rest.first, rest.last, text)


def _wheels_rest(odometry: FloatArray) -> bool:
    """Whether odometry, poses (n, 3), m and rad, tells as well that the robot rests."""
    known = odometry[np.isfinite(odometry).all(axis=1)]
    return 2 * len(known) > len(odometry) and bool((np.ptp(known[:, :2], axis=0) < _RESTS).all())


def _nothing_tells(trace: Trace, motion: MotionReport) -> Iterator[Degeneracy]:
    matches = trace.matches
    is_told = np.zeros(len(matches), dtype=np.bool_)
    for one in featureless(trace):
        is_told[one.first_scan : one.last_scan + 1] = True
    passed, longest = _time_passed(trace.stamps)
    headings = trace.local[:, 2] + motion.wall_heading
    is_bare = (motion.wall_spread < _BARE) & _seems_to_stand(trace.local, headings, passed)
    is_free = is_bare | (matches.hold < _LEAST_HOLD)
    flags = np.isfinite(motion.wall_spread) & (matches.points > 0) & is_free
    for first, last in _close_in_time(trace, flags, passed, longest):
        seconds = float(passed[last] - passed[first])
        found = np.flatnonzero(flags[first : last + 1]) + first
        is_known = is_told[first : last + 1].mean() > _MOSTLY
        if seconds <= _LEAST_TIME or len(found) <= _MOSTLY * (last + 1 - first) or is_known:
            continue
        heading = trace.map_heading(found, headings[found])
        yield trace.told(
            "featureless, no odometry",
            first,
            last,
            f"{seconds:.0f} s between bare walls at {heading:.0f} deg without odometry:"
            " how far the robot drove along them is a guess",
        )


def _time_passed(stamps: FloatArray) -> tuple[FloatArray, float]:
    """Time of the lidar without its silences, s, shape (n,), and the longest step that is none."""
    steps = np.abs(np.diff(stamps, prepend=stamps[:1]))
    longest = max(_LONGEST_STEP, _MANY_STEPS * float(np.median(steps)))
    return np.cumsum(np.where(steps > longest, 0.0, steps)), longest


def _seems_to_stand(poses: FloatArray, headings: FloatArray, passed: FloatArray) -> NDArray[np.bool_]:
    """Whether hardly any way along walls was found around a scan; else `hold` tells what holds the match."""
    before = np.searchsorted(passed, passed - 0.5 * _LEAST_TIME)
    after = np.minimum(np.searchsorted(passed, passed + 0.5 * _LEAST_TIME), len(passed) - 1)
    gap = poses[after, :2] - poses[before, :2]
    return np.asarray(np.abs(gap[:, 0] * np.cos(headings) + gap[:, 1] * np.sin(headings)) < _LEAST_WAY)


def _close_in_time(
    trace: Trace, flags: NDArray[np.bool_], passed: FloatArray, longest: float
) -> Iterator[tuple[int, int]]:
    """First and last of flagged scans that follow each other within some time, s, breaks apart."""
    found = np.flatnonzero(flags)
    if found.size == 0:
        return
    stretch = np.cumsum(trace.is_first)
    apart = (np.diff(passed[found]) > longest) | (np.diff(stretch[found]) > 0)
    for part in np.split(found, np.flatnonzero(apart) + 1):
        yield int(part[0]), int(part[-1])
