"""Text logs of the pi-map data: sonar sweeps, and the poses they were mapped with (Zhang et al., pi-map).

A line holds a running index, two counters, ticks (100 ns since the beginning of the year 1), and either the
ranges of sixteen sonars or x, y and heading. Lines were written every 0.1 s, and their ticks are the stamp of
the last lidar scan the mapper had taken in: that of the scan's header (plus 0.16 ms), not the time at which
it was recorded, and several lines share one. A straight line through the ticks therefore tells when a sweep
was heard far better than its own tick does.
"""

from array import array
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from glassslam.errors import RecordingError
from glassslam.records import Damage, FloatArray
from glassslam.sources.failures import reading
from glassslam.sources.formats import Piece
from glassslam.sources.textlines import TextLog, text_damage

_TICKS_AT_1970 = 621_355_968_000_000_000
_TICKS_PER_S = 10_000_000
_HEADER = 4
POSE_VALUES = 3
# Ticks of one scan cover up to this time, s; where they stray further from the line, lines were left out.
_STRAY = 0.25
# A tick this far from those of the two lines before and behind it was not written by the mapper, s.
_WILD = 10.0
_NEIGHBOURS = 2
# Ticks of the years 1902 to 2218.
_TICKS = range(6 * 10**17, 7 * 10**17)
# Sixty hours of sweeps: what claims to be more would fill the memory.
MOST_LINES = 2_000_000


@dataclass(frozen=True, slots=True)
class PimapLog:
    """A log, read.

    Attributes
    ----------
    times : ndarray of float64, shape (m,)
        Ticks in seconds since 1970.
    places : ndarray of int64, shape (m,)
        How many lines stand before each in the file.
    values : ndarray of float64, shape (m, n)
        What follows them: ranges in m, or x and y in m and the heading in rad.
    dropped : int
        Lines that cannot be read.
    damage : tuple of Damage
        What of the file could not be read.
    """

    times: FloatArray
    places: NDArray[np.int64]
    values: FloatArray
    dropped: int
    damage: tuple[Damage, ...]

    @property
    def sweep_times(self) -> FloatArray:
        """When the sweeps were heard, shape (m,), s since 1970 on the clock of the scan headers."""
        return _straightened(self.times, self.places)


def read_pimap(path: str | Path, *, strict: bool = False) -> PimapLog:
    """Read a log; lines that do not fit the rest are left out.

    Parameters
    ----------
    path : str or Path
        The log, packed with gzip or not.
    strict : bool
        Refuse a file that cannot be read to its end.

    Raises
    ------
    RecordingError
        The file cannot be read, is no such log, or most of its lines cannot be read.
    """
    with reading(Path(path)):
        log = TextLog(Piece(Path(path), "pimap"), strict=strict)
        rows = _Rows()
        for line in log.lines():
            rows.add(line)
            if rows.seen > MOST_LINES:
                raise RecordingError(f"{path} holds more than {MOST_LINES} lines", "cut it into parts")
        times, places, values = rows.usual()
    if not len(times) or 2 * len(times) < rows.seen:
        what = f"{rows.seen - len(times)} of {rows.seen} lines cannot be read"
        raise RecordingError(f"{path} is no pi-map log: {what}", "".join(gap.reason for gap in log.gaps[:1]))
    sound = ~_wild(times)
    times, places, values = times[sound], places[sound], values[sound]
    damage = text_damage([log], len(times), float(times[0]), float(times[-1]))
    return PimapLog(times, places, values, rows.seen - len(times), damage)


@dataclass(slots=True)
class _Rows:
    """Lines sorted by how many values they hold: damage changes few of them, and most tell the layout."""

    seen: int = 0
    places: dict[int, "array[int]"] = field(default_factory=dict)
    ticks: dict[int, "array[int]"] = field(default_factory=dict)
    values: dict[int, "array[float]"] = field(default_factory=dict)

    def add(self, line: bytes) -> None:
        words = line.split()
        if not words:
            return
        self.seen += 1
        width = len(words) - _HEADER
        if width < POSE_VALUES or b"_" in line:  # digits of numbers in Python may be grouped, no others
            return
        try:
            # Ticks have more digits than a float holds.
            ticks, row = int(words[_HEADER - 1]), [float(word) for word in words[_HEADER:]]
        except ValueError:
            return
        if ticks in _TICKS:
            self.places.setdefault(width, array("q")).append(self.seen - 1)
            self.ticks.setdefault(width, array("q")).append(ticks)
            self.values.setdefault(width, array("d")).extend(row)

    def usual(self) -> tuple[FloatArray, NDArray[np.int64], FloatArray]:
        """Times in s since 1970, places and values of the lines of the most frequent width."""
        width = max(self.ticks, key=lambda width: len(self.ticks[width]), default=POSE_VALUES)
        ticks = np.array(self.ticks.get(width, ()), dtype=np.int64)
        values = np.array(self.values.get(width, ()), dtype=np.float64)
        places = np.array(self.places.get(width, ()), dtype=np.int64)
        return (ticks - _TICKS_AT_1970) / _TICKS_PER_S, places, values.reshape(-1, width)


def _wild(seconds: FloatArray) -> NDArray[np.bool_]:
    """Which times are far from those around them, on both sides of a pause as well."""
    if seconds.size <= 2 * _NEIGHBOURS:
        return np.zeros(seconds.size, dtype=bool)
    around = np.pad(seconds, _NEIGHBOURS, mode="reflect")
    windows = np.lib.stride_tricks.sliding_window_view(around, 2 * _NEIGHBOURS + 1)
    return np.asarray(np.abs(seconds - np.median(windows, axis=1)) > _WILD)


def _straightened(seconds: FloatArray, places: NDArray[np.int64]) -> FloatArray:
    """Times of lines written at a steady rate; as they are where the rate was not steady."""
    if seconds.size < 2:
        return seconds
    index = (places - places[0]).astype(np.float64)
    # Centred on the first: the numbers are large and the fit is not.
    slope, offset = np.polyfit(index, seconds - seconds[0], 1)
    line = seconds[0] + offset + slope * index
    return line if np.abs(line - seconds).max() < _STRAY else seconds
