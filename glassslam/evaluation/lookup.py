"""Poses of a trajectory at given times."""

import numpy as np
from numpy.typing import NDArray

from glassslam.geometry import interpolate
from glassslam.records import FloatArray, Trajectory

STAMP_TOLERANCE = 0.005
LARGEST_GAP = 1.0


def poses_at(
    trajectory: Trajectory,
    stamps: FloatArray,
    *,
    tolerance: float = STAMP_TOLERANCE,
    largest_gap: float = LARGEST_GAP,
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Poses at given times: of the scan with that stamp, otherwise interpolated between its neighbours.

    A time takes the pose of the nearest stamp when that lies within `tolerance`; failing that, it is
    interpolated between the stamps before and after it when these are at most `largest_gap` apart;
    failing that, it is not found. Stamps need not increase: neighbours are neighbours in time.

    Parameters
    ----------
    trajectory : Trajectory
        Stamped poses in any order, not empty.
    stamps : ndarray of float64, shape (n,)
        Times asked for, s.
    tolerance : float
        Largest difference at which a stamp counts as equal, s.
    largest_gap : float
        Largest distance of two stamps to interpolate between, s.

    Returns
    -------
    poses : ndarray of float64, shape (n, 3)
        (x, y, theta); NaN where not found.
    found : ndarray of bool, shape (n,)
        Whether there is a pose.
    """
    order = np.argsort(trajectory.stamps, kind="stable")
    known, poses = trajectory.stamps[order], trajectory.poses[order]
    after = np.searchsorted(known, stamps, side="left").clip(0, known.size - 1)
    before = np.where((known[after] > stamps) & (after > 0), after - 1, after)
    nearest = np.where(stamps - known[before] <= np.abs(known[after] - stamps), before, after)
    same = np.abs(known[nearest] - stamps) <= tolerance
    gap = known[after] - known[before]
    bracketed = (known[before] <= stamps) & (stamps <= known[after]) & (gap <= largest_gap)
    fraction = np.where(same | (gap <= 0.0), 0.0, (stamps - known[before]) / np.where(gap > 0.0, gap, 1.0))
    between = interpolate(poses[before], poses[after], fraction.clip(0.0, 1.0))
    found = same | bracketed
    answer = np.where(same[:, None], poses[nearest], between)
    return np.where(found[:, None], answer, np.nan), found
