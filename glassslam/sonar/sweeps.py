"""Sonar sweeps with the poses at which they were made."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from glassslam.errors import GridError
from glassslam.geometry import compose
from glassslam.records import FloatArray, RangeRing, SonarRing
from glassslam.slam.trajectory import PoseTracks
from glassslam.sonar.poses import PoseKind, sweep_poses


@dataclass(frozen=True, slots=True)
class SonarSweeps:
    """The sweeps of one ring, each with the pose of the base.

    Attributes
    ----------
    stamps : ndarray of float64, shape (m,)
        Times, s.
    ranges : ndarray of float64, shape (m, n)
        One range per sonar, m; +inf: no echo; NaN: no new reading.
    ring : SonarRing
        Where the sonars sit in the base frame.
    poses : ndarray of float64, shape (m, 3)
        Pose (x, y, theta) of the base in the map frame, m and rad.

    Raises
    ------
    GridError
        Arrays that do not fit each other, or a pose that is not finite.
    """

    stamps: FloatArray
    ranges: FloatArray
    ring: SonarRing
    poses: FloatArray

    def __post_init__(self) -> None:
        count, sonars = len(self.stamps), len(self.ring.poses)
        if self.ranges.shape != (count, sonars) or self.poses.shape != (count, 3):
            raise GridError(
                f"{count} sweeps of {sonars} sonars: ranges {self.ranges.shape}, poses {self.poses.shape}",
                "give one row of ranges and one pose per sweep, one column per sonar",
            )
        if not np.isfinite(self.poses).all():
            raise GridError("sweep at a pose that is not finite", "leave out sweeps without a pose")

    @property
    def sensors(self) -> FloatArray:
        """Poses of all sonars at all sweeps in the map frame, shape (m, n, 3)."""
        return compose(self.poses[:, None, :], np.asarray(self.ring.poses, dtype=np.float64)[None])

    def only(self, sonars: NDArray[np.int64]) -> "SonarSweeps":
        """The sweeps of some sonars of the ring, by their numbers, shape (k,)."""
        ring = replace(self.ring, poses=np.asarray(self.ring.poses)[sonars])
        return SonarSweeps(self.stamps, self.ranges[:, sonars], ring, self.poses)


def placed_sweeps(
    records: Iterable[RangeRing], ring: SonarRing, tracks: PoseTracks, kind: PoseKind = "FGfit"
) -> SonarSweeps:
    """Sweeps of a recording with their poses; those before the first and after the last pose are left out.

    Parameters
    ----------
    records : iterable of RangeRing
        Sweeps in the order of the recording.
    ring : SonarRing
        Where the sonars sit.
    tracks : PoseTracks
        Poses of the run.
    kind : {"Loc", "PG", "FG", "FGfit"}
        Kind of pose.

    Raises
    ------
    GridError
        A sweep with another number of ranges than the ring has sonars.
    """
    sweeps = list(records)
    count = len(ring.poses)
    for sweep in sweeps:
        if len(sweep.ranges) != count:
            raise GridError(
                f"sweep at {sweep.stamp:.3f} s has {len(sweep.ranges)} ranges",
                f"the ring {ring.name or 'of the recording'} has {count} sonars",
            )
    stamps = np.array([sweep.stamp for sweep in sweeps], dtype=np.float64)
    ranges = np.array([sweep.ranges for sweep in sweeps], dtype=np.float64).reshape(-1, count)
    poses, inside = sweep_poses(tracks, stamps, kind)
    return SonarSweeps(stamps[inside], ranges[inside], ring, poses[inside])
