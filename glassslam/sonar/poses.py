"""Where the robot was at every sweep: the four kinds of poses of the pi-map paper."""

from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import isotonic_regression

from glassslam.geometry import interpolate
from glassslam.records import FloatArray
from glassslam.slam.trajectory import PoseTracks

PoseKind: TypeAlias = Literal["Loc", "PG", "FG", "FGfit"]


def sweep_poses(
    tracks: PoseTracks, stamps: FloatArray, kind: PoseKind = "FGfit"
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Poses of the base at the stamps of sonar sweeps (pi-map, sections III-A and III-C).

    `Loc` and `PG` take the pose of the last scan before the sweep, which is what a sonar mapper that
    runs along is sent; `FG` takes the nearest node; `FGfit` interpolates the final poses, heading along
    the shorter arc (equations 9 and 10; between scans rather than nodes, as they are at hand).

    Parameters
    ----------
    tracks : PoseTracks
        Poses of the run. Stamps that step back are moved to the nearest clock that does not.
    stamps : ndarray of float64, shape (m,)
        Times of the sweeps, s, in any order.
    kind : {"Loc", "PG", "FG", "FGfit"}
        Kind of pose.

    Returns
    -------
    poses : ndarray of float64, shape (m, 3)
        x, y, theta in the map frame, m and rad; those outside the time of the track hold its end.
    inside : ndarray of bool, shape (m,)
        Sweeps within the time of the track.
    """
    track = {"Loc": tracks.local, "PG": tracks.partial, "FG": tracks.nodes, "FGfit": tracks.final}[kind]
    stamps = np.asarray(stamps, dtype=np.float64)
    if track.stamps.size == 0:
        return np.zeros((stamps.size, 3)), np.zeros(stamps.size, dtype=bool)
    clock = _never_back(track.stamps)
    inside = (stamps >= clock[0]) & (stamps <= clock[-1])
    before, fraction = _place(clock, stamps)
    after = np.minimum(before + 1, clock.size - 1)
    if kind == "FGfit":
        return interpolate(track.poses[before], track.poses[after], fraction), inside
    chosen = np.where(fraction > 0.5, after, before) if kind == "FG" else before
    return track.poses[chosen].copy(), inside


def _never_back(stamps: FloatArray) -> FloatArray:
    """The nearest clock that never steps back: the order of the recording is that of the motion."""
    if np.all(np.diff(stamps) >= 0):
        return stamps
    return np.asarray(isotonic_regression(stamps).x)


def _place(clock: FloatArray, stamps: FloatArray) -> tuple[NDArray[np.int64], FloatArray]:
    """Entry of the clock at or before each stamp, and the share of the step to the next one."""
    before = np.clip(np.searchsorted(clock, stamps, side="right") - 1, 0, clock.size - 1)
    after = np.minimum(before + 1, clock.size - 1)
    step = clock[after] - clock[before]
    done = np.divide(stamps - clock[before], step, out=np.zeros(stamps.size), where=step > 0)
    return before.astype(np.int64), np.clip(done, 0.0, 1.0)
