"""Which readings of a sonar ring are new, and which say that nothing answered."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from glassslam.records import Float32Array, FloatArray, SonarRing
from glassslam.sources.noecho import NoEcho, detect_no_echo

Series: TypeAlias = tuple[FloatArray, Float32Array]
"""Times (m,) in s and ranges (m, n) in m of consecutive messages."""

# A driver that cuts ranges below the limit of the sonars does so by more than this share.
_CLEARLY_LESS = 0.99
# Intervals between changes this far above the shortest usual one span several cycles.
_ONE_CYCLE = 1.5
_SHORTEST_PERCENTILE = 10.0
_MIN_INTERVALS = 20
# A cycle shorter than this many messages: every message brings new readings.
_MESSAGES_PER_CYCLE = 1.5
# An unchanged range counts as measured again after this many cycles: firing and logging do not run in step.
_AGAIN = 1.2
# In 70 minutes of driving and standing no ring that heard anything held still for more than 1.1 s (four
# cycles); what does so for longer than this is a driver repeating itself. Silence may last.
_FROZEN_S = 3.0
_FROZEN_CYCLES = 10.0
_FROZEN_ECHOES = 2
# A ring of so many sonars of which none has heard anything yet has not been switched on.
_SILENT_RING = 4


@dataclass(frozen=True, slots=True)
class SweepRule:
    """How the ranges of a ring are read.

    Attributes
    ----------
    range_min : float
        Shorter ranges are no readings, m.
    limit : float
        Ranges from here on mean that nothing answered, m.
    cycle : float
        Time within which a sonar repeats its last range instead of measuring, s; 0: it never does.
    waits_for_first_echo : bool
        Whether sweeps before the first echo of any sonar say nothing.
    """

    range_min: float
    limit: float
    cycle: float = 0.0
    waits_for_first_echo: bool = False


def sweep_rule(ring: SonarRing, series: Sequence[Series], *, whole_sweeps: bool = True) -> SweepRule:
    """Read off consecutive messages how the ranges of a ring are to be read.

    Parameters
    ----------
    ring : SonarRing
        Its limits.
    series : sequence of (times, ranges)
        Stretches of consecutive messages from all over the recording.
    whole_sweeps : bool
        Whether a message holds all sonars; otherwise each series holds the messages of one sonar.
    """
    return SweepRule(
        range_min=ring.range_min,
        limit=_limit(ring.range_max, no_echo_of(series)),
        cycle=repeat_cycle(series),
        waits_for_first_echo=whole_sweeps and len(ring.poses) >= _SILENT_RING,
    )


def _limit(range_max: float, no_echo: NoEcho) -> float:
    """The limit of the ring, or what silent sonars say where that is clearly less."""
    cut_earlier = no_echo.value is not None and no_echo.value < _CLEARLY_LESS * range_max
    return no_echo.ceiling if cut_earlier else range_max


def no_echo_of(series: Iterable[Series]) -> NoEcho:
    """What a silent sonar looks like."""
    return detect_no_echo(sweep for _, ranges in series for sweep in ranges)


def repeat_cycle(series: Sequence[Series]) -> float:
    """The time after which a sonar delivers a new range, where messages come faster than that, s.

    Drivers send the last range of every sonar in every message, while the sonars fire one after the other.
    A range that is exactly the one before is no evidence in itself: the intervals between changes show the
    firing cycle.

    Parameters
    ----------
    series : sequence of (times, ranges)
        Stretches of consecutive messages.

    Returns
    -------
    float
        The cycle; 0 where every message brings new ranges, or where nothing can be told.
    """
    steps = np.concatenate([np.empty(0), *(np.diff(times) for times, _ in series)])
    intervals = np.concatenate([np.empty(0), *(_intervals(times, ranges) for times, ranges in series)])
    intervals = intervals[intervals > 0.0]
    if intervals.size < _MIN_INTERVALS or not np.any(steps > 0.0):
        return 0.0
    shortest = np.percentile(intervals, _SHORTEST_PERCENTILE)
    cycle = float(np.mean(intervals[intervals <= _ONE_CYCLE * shortest]))
    return cycle if cycle > _MESSAGES_PER_CYCLE * float(np.median(steps[steps > 0.0])) else 0.0


def _intervals(times: FloatArray, ranges: Float32Array) -> FloatArray:
    """Times between one change of a sonar and its next, of all sonars together."""
    known = ~np.isnan(ranges)
    changes = (ranges[1:] != ranges[:-1]) & known[1:] & known[:-1]
    columns = [np.diff(times[1:][changed]) for changed in changes.T if changed.sum() > 1]
    return np.concatenate([np.empty(0), *columns])


class SweepFilter:
    """Turns the ranges of messages into readings: +inf where nothing answered, NaN where nothing is new.

    A range that differs from the last one of its sonar is new. An equal one is new only when the sonar has
    had time to fire again. When the whole ring holds still for longer than sonars do in front of a standing
    robot, the driver repeats itself, and nothing is new until something changes; should the robot have stood
    still after all, it has lost nothing but evidence it had given before.

    Parameters
    ----------
    rule : SweepRule
        How ranges are read.
    sonars : int
        Size of the ring.
    """

    def __init__(self, rule: SweepRule, sonars: int) -> None:
        self._rule = rule
        self._last = np.full(sonars, np.nan, dtype=np.float32)
        self._taken = np.full(sonars, -np.inf)
        self._stamps = np.full(sonars, np.nan)
        self._changed = -np.inf
        self._heard = not rule.waits_for_first_echo

    def read(self, stamp: float, ranges: Float32Array) -> Float32Array:
        """Readings of the next message, shape (n,); sonars the message does not tell of are NaN in it.

        Parameters
        ----------
        stamp : float
            Time of the message, s.
        ranges : ndarray of float32, shape (n,)
            As recorded, m.
        """
        told = ~np.isnan(ranges)
        equal = told & (ranges == self._last)
        if np.any(told & ~equal):
            self._changed = stamp
        waited = np.abs(stamp - self._taken)
        too_soon = (waited < _AGAIN * self._rule.cycle) | (stamp == self._stamps)
        old = equal & (too_soon | self._is_frozen(stamp))
        self._last[told], self._stamps[told] = ranges[told], stamp
        self._taken[told & ~old] = stamp
        readings = self._judged(ranges)
        readings[old] = np.nan
        self._heard = self._heard or bool(np.isfinite(readings).any())
        return readings if self._heard else np.full_like(readings, np.nan)

    def _judged(self, ranges: Float32Array) -> Float32Array:
        readings = ranges.astype(np.float32, copy=True)
        readings[readings >= self._rule.limit] = np.inf
        readings[(readings < self._rule.range_min) | (readings <= 0.0)] = np.nan
        return readings

    def _is_frozen(self, stamp: float) -> bool:
        limit = max(_FROZEN_S, _FROZEN_CYCLES * self._rule.cycle)
        echoes = np.count_nonzero(np.isfinite(self._judged(self._last)))
        return bool(stamp - self._changed > limit and echoes >= _FROZEN_ECHOES)
