"""Where odometry and scans tell different ways, in words."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glassslam.geometry import between
from glassslam.records import FloatArray
from glassslam.slam.degeneracy import Trace
from glassslam.slam.motion_watch import MotionReport
from glassslam.slam.result import Degeneracy

_WAY, _LONGEST_STEP = 0.5, 20.0
_DISAGREES, _LASTING = 0.3, 6


@dataclass(frozen=True, slots=True)
class Steps:
    """A run cut into steps of half a metre, as odometry or scans have it.

    Attributes
    ----------
    first, last : ndarray of int64, shape (k,)
        Scans between which they lie.
    gap : ndarray of float64, shape (k,)
        How far apart the two have the end of a step, as a share of the longer one: up to 2.
    """

    first: NDArray[np.int64]
    last: NDArray[np.int64]
    gap: FloatArray


def contradictions(trace: Trace, motion: MotionReport) -> Iterator[Degeneracy]:
    """Stretches on which odometry and scans disagree step after step.

    On real robots a wheel that slips costs a step or two; odometry whose axes, units or signs are wrong
    disagrees all the way.

    Parameters
    ----------
    trace : Trace
        The run.
    motion : MotionReport
        What told how the robot moved.
    """
    steps = steps_of(trace, motion)
    flags = np.concatenate(([0], (steps.gap > _DISAGREES).astype(np.int64), [0]))
    for begin, end in np.flatnonzero(np.diff(flags)).reshape(-1, 2).tolist():
        if end - begin >= _LASTING:
            share = float(np.median(steps.gap[begin:end]))
            text = f"odometry and scans disagree by {share:.0%} of the way, {end - begin} steps in a row"
            first, last = int(steps.first[begin]), int(steps.last[end - 1])
            yield trace.told("odometry contradicted", first, last, text)


def steps_of(trace: Trace, motion: MotionReport) -> Steps:
    """Steps of half a metre of a run, without those over breaks, and of odometry that is missing or stuck.

    Parameters
    ----------
    trace : Trace
        The run.
    motion : MotionReport
        What told how the robot moved.
    """
    is_usable: NDArray[np.bool_] = np.isfinite(motion.odometry.sum(axis=1))
    for stuck in motion.stuck:
        is_usable[stuck.first : stuck.last + 1] = False
    usable, begins, stamps = is_usable.tolist(), trace.is_first.tolist(), trace.stamps.tolist()
    wheels, found = motion.odometry[:, :2].tolist(), trace.local[:, :2].tolist()
    pairs, first = [], 0
    for k in range(1, len(usable)):
        if begins[k] or not (usable[k] and usable[first]) or abs(stamps[k] - stamps[first]) > _LONGEST_STEP:
            first = k
        elif math.dist(wheels[k], wheels[first]) >= _WAY or math.dist(found[k], found[first]) >= _WAY:
            pairs.append((first, k))
            first = k
    firsts, lasts = np.array(pairs, dtype=np.int64).reshape(-1, 2).T
    by_wheels = between(motion.odometry[firsts], motion.odometry[lasts])
    by_scans = between(trace.local[firsts], trace.local[lasts])
    longer = np.maximum(_length(by_wheels), _length(by_scans))
    return Steps(firsts, lasts, _length(by_wheels - by_scans) / np.maximum(longer, _WAY))


def _length(steps: FloatArray) -> FloatArray:
    return np.asarray(np.hypot(steps[:, 0], steps[:, 1]))
