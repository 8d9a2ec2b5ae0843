"""Text logs of the pi-map data: sonar sweeps, and the poses they were mapped with (Zhang et al., pi-map).

A line holds a running index, two counters, ticks (100 ns since the beginning of the year 1), and either the
ranges of sixteen sonars or x, y and heading. Lines were written every 0.1 s, and their ticks are the stamp of
the last lidar scan the mapper had taken in: that of the scan's header (plus 0.16 ms), not the time at which
it was recorded, and several lines share one. A straight line through the ticks therefore tells when a sweep
was heard far better than its own tick does.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from glassslam.errors import RecordingError
from glassslam.records import FloatArray, Trajectory
from glassslam.sources.failures import reading
from glassslam.sources.textlines import single

_TICKS_AT_1970 = 621_355_968_000_000_000
_TICKS_PER_S = 10_000_000
_HEADER = 4
POSE_VALUES = 3
# Ticks of one scan cover up to this time, s; where they stray further from the line, lines were left out.
_STRAY = 0.25


def read_pimap_sonar(path: str | Path) -> tuple[FloatArray, NDArray[np.float32]]:
    """Times and sweeps of a sonar log.

    Parameters
    ----------
    path : str or Path
        The log.

    Returns
    -------
    times : ndarray of float64, shape (m,)
        Seconds since 1970, on the clock of the scan headers.
    ranges : ndarray of float32, shape (m, n)
        As recorded, m.

    Raises
    ------
    RecordingError
        The file cannot be read or is no such log.
    """
    seconds, values = _read(Path(path))
    return _straightened(seconds), single(values)


def read_pimap_poses(path: str | Path) -> Trajectory:
    """Poses of a pose log, one for every lidar scan; lines that repeat a pose are left out.

    Parameters
    ----------
    path : str or Path
        The log.

    Raises
    ------
    RecordingError
        The file cannot be read or is no such log.
    """
    seconds, values = _read(Path(path))
    if values.shape[1] != POSE_VALUES:
        raise RecordingError(f"{path} holds {values.shape[1]} values a line, not x, y and heading")
    first = np.append(True, np.diff(seconds) != 0.0)
    return Trajectory(seconds[first], values[first])


def _read(path: Path) -> tuple[FloatArray, FloatArray]:
    """Ticks in s since 1970 and the values after them; a cut-off last line is left out."""
    with reading(path):
        rows = [line.split() for line in path.read_text(encoding="ascii").splitlines()]
    rows = [row for row in rows if row]
    width = len(rows[0]) if rows else 0
    if len(rows) > 1 and len(rows[-1]) != width:
        rows.pop()
    if width < _HEADER + POSE_VALUES or any(len(row) != width for row in rows):
        raise RecordingError(f"{path} is no pi-map log: its lines are of different lengths")
    try:
        # Ticks have more digits than a float holds.
        ticks = np.array([int(row[_HEADER - 1]) for row in rows], dtype=np.int64)
        values = np.array([row[_HEADER:] for row in rows], dtype=np.float64)
    except (ValueError, OverflowError) as error:
        raise RecordingError(f"{path} is no pi-map log: {error!s:.80}") from error
    return (ticks - _TICKS_AT_1970) / _TICKS_PER_S, values


def _straightened(seconds: FloatArray) -> FloatArray:
    """Times of lines written at a steady rate; as they are where the rate was not steady."""
    if seconds.size < 2:
        return seconds
    index = np.arange(seconds.size, dtype=np.float64)
    # Centred on the first: the numbers are large and the fit is not.
    slope, offset = np.polyfit(index, seconds - seconds[0], 1)
    line = seconds[0] + offset + slope * index
    return line if np.abs(line - seconds).max() < _STRAY else seconds
