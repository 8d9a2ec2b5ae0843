"""The 3D mapper: scans, ultrasonic points and a trajectory in, a volume out."""

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from glassslam.errors import GridError
from glassslam.geometry import transform_points
from glassslam.records import Float32Array, FloatArray, LaserScan, PointSet, Record, Trajectory
from glassslam.slam.range_data import prepare
from glassslam.slam.scan_check import defect, mended
from glassslam.volume.evidence import Evidence, joined, observe
from glassslam.volume.octree import CENTRE, Octree
from glassslam.volume.options import VolumeOptions
from glassslam.volume.pairing import ApproximateTime
from glassslam.volume.pooling import pooled
from glassslam.volume.sensors import InverseModel
from glassslam.volume.track import Track

UNPLACED = "outside of the trajectory"
TOO_FAR = "too far from the origin of the volume"
NOT_FINITE = "point that is not finite"
OUT_OF_FIELD = "point outside of the field of view"

# points come in single precision and may lie on the very border of what a sensor hears, m
_ROUNDING = 5e-6


@dataclass(frozen=True, slots=True)
class Volume:
    """A finished 3D map.

    Attributes
    ----------
    fused : Octree
        Both sensors, joined measurement by measurement.
    lidar, ultrasonic : Octree
        Each sensor alone; empty where this was not asked for.
    counts : dict
        "scans", "point_sets", "points", "pairs" -> how many were used.
    dropped : dict
        Reason -> number of messages or points that were not used.
    """

    fused: Octree
    lidar: Octree
    ultrasonic: Octree
    counts: Mapping[str, int]
    dropped: Mapping[str, int]


class VolumeMapper:
    """Builds a volume from records, one at a time, along a trajectory that is known.

    Parameters
    ----------
    trajectory : Trajectory
        Poses of the base in the map frame; a single pose is a robot that stands.
    options : VolumeOptions, optional
        Resolution, sensors and fusion.
    base_from_laser : array_like, shape (3,)
        Pose (x, y, yaw) of the lidar on the base, m and rad.

    Raises
    ------
    GridError
        The trajectory has no pose.

    Examples
    --------
    >>> import numpy as np
    >>> from glassslam.records import PointSet, Trajectory
    >>> mapper = VolumeMapper(Trajectory(np.zeros(1), np.zeros((1, 3))))
    >>> mapper.add(PointSet(0.0, np.array([[1.02, 0.02, 0.52]], np.float32), np.zeros(3)))
    >>> volume = mapper.finish()
    >>> volume.fused.centres(volume.fused.occupied()).round(3).tolist()
    [[1.025, 0.025, 0.525]]
    """

    def __init__(
        self,
        trajectory: Trajectory,
        options: VolumeOptions | None = None,
        base_from_laser: object = (0.0, 0.0, 0.0),
    ) -> None:
        if trajectory.stamps.size == 0:
            raise GridError("the trajectory has no pose", "a robot that stands has one")
        self._options = options or VolumeOptions()
        self._base_from_laser = np.array(base_from_laser, dtype=np.float64)
        self._track = Track(trajectory)
        self._pairs: ApproximateTime[Evidence, Evidence] = ApproximateTime(self._options.slop)
        trees = (Octree(self._options.resolution, self._options.clamp) for _ in range(3))
        self._fused, self._lidar, self._ultrasonic = trees
        self._counts = Counter({"scans": 0, "point_sets": 0, "points": 0, "pairs": 0})
        self._dropped: Counter[str] = Counter()

    def add(self, record: Record) -> None:
        """Take one record; others than scans and ultrasonic points are ignored."""
        if isinstance(record, LaserScan):
            self._add_scan(record)
        elif isinstance(record, PointSet):
            self._add_points(record)

    def add_rays(
        self,
        stamp: float,
        pose: FloatArray,
        sensor: FloatArray,
        returns: Float32Array | FloatArray,
        free_ends: Float32Array | FloatArray,
    ) -> None:
        """Take a scan whose rays and pose are known already.

        Parameters
        ----------
        stamp : float
            Time of the scan, s.
        pose : ndarray of float64, shape (3,)
            Pose of the base in the map frame, m and rad.
        sensor : ndarray of float64, shape (2,)
            Position of the lidar in the frame of the base, m.
        returns, free_ends : ndarray, shape (n, 2), (m, 2)
            What the beams hit, and ends of free space without echo, frame of the base, m.
        """
        height = self._options.lidar_height
        origin, echoes, silent = (
            lifted(transform_points(pose, points.astype(np.float64)), height)
            for points in (sensor[None], returns, free_ends)
        )
        said = self._observed(origin[0], echoes, silent, self._options.lidar)
        if said is None:
            self._dropped[f"scan {TOO_FAR}"] += 1
            return
        if self._options.separate:
            self._lidar.add_sorted(said.codes, said.log_odds)
        self._counts["scans"] += 1
        self._enter(self._pairs.add_first(stamp, said))

    def finish(self) -> Volume:
        """Enter what waits for a partner and give out the volume."""
        self._enter(self._pairs.finish())
        return Volume(self._fused, self._lidar, self._ultrasonic, dict(self._counts), dict(self._dropped))

    def _add_scan(self, scan: LaserScan) -> None:
        reason = defect(scan)
        pose = None if reason else self._track.at(scan.stamp)
        if pose is None:
            self._dropped[reason or f"scan {UNPLACED}"] += 1
            return
        data = prepare(
            mended(scan), self._base_from_laser, self._track.twist_at(scan.stamp), self._options.ranges
        )
        self.add_rays(scan.stamp, pose, data.sensor, data.returns, data.free_ends)

    def _add_points(self, record: PointSet) -> None:
        pose = self._track.at(record.stamp)
        if pose is None:
            self._dropped[f"point set {UNPLACED}"] += 1
            return
        if not self._is_inside(record.origin, self._options.ultrasonic):
            self._dropped[f"point set {TOO_FAR}"] += 1
            return
        points = self._believed(record)
        origin = placed(pose, record.origin[None].astype(np.float64))[0]
        said = self._observed(origin, placed(pose, points), np.empty((0, 3)), self._options.ultrasonic)
        if said is None:
            self._dropped[f"point set {TOO_FAR}"] += 1
            return
        if self._options.separate:
            self._ultrasonic.add_sorted(said.codes, said.log_odds)
        self._counts["point_sets"] += 1
        self._counts["points"] += len(points)
        self._enter(self._pairs.add_second(record.stamp, said))

    def _observed(
        self, origin: FloatArray, echoes: FloatArray, silent: FloatArray, model: InverseModel
    ) -> Evidence | None:
        """What a measurement says; None where it may reach beyond the bounds of the tree."""
        if not self._is_inside(origin, model):
            return None
        return observe(origin, echoes, silent, model, self._options.resolution)

    def _is_inside(self, origin: FloatArray, model: InverseModel) -> bool:
        """Whether all that a sensor sees from a place lies within the tree; no if that is not a number."""
        return bool(np.abs(origin).max() + model.max_range < (CENTRE - 1) * self._options.resolution)

    def _believed(self, record: PointSet) -> FloatArray:
        """Points that are numbers and within the field of view of the sensor."""
        points = record.points.astype(np.float64)
        finite = np.isfinite(points).all(axis=1)
        points, total = points[finite], len(points)
        ahead = points - record.origin
        least = np.cos(self._options.ultrasonic.half_angle)
        seen = ahead @ np.array(record.axis) >= least * np.linalg.norm(ahead, axis=1) - _ROUNDING
        for reason, count in ((NOT_FINITE, total - len(points)), (OUT_OF_FIELD, int((~seen).sum()))):
            if count:
                self._dropped[reason] += count
        return np.asarray(points[seen])

    def _enter(self, pairs: Iterable[tuple[Evidence | None, Evidence | None]]) -> None:
        """Join what two sensors said of the same moment, the missing one padded with zeros."""
        for scan, points in pairs:
            self._counts["pairs"] += scan is not None and points is not None
            nothing = Evidence.nothing()
            codes, first, second = joined(scan or nothing, points or nothing)
            change = pooled(first, second, self._options.pool, self._options.weights)
            self._fused.add_sorted(codes, change)


def build_volume(
    records: Iterable[Record],
    trajectory: Trajectory,
    options: VolumeOptions | None = None,
    base_from_laser: object = (0.0, 0.0, 0.0),
) -> Volume:
    """Make a volume from a whole recording; see `VolumeMapper`."""
    mapper = VolumeMapper(trajectory, options, base_from_laser)
    for record in records:
        mapper.add(record)
    return mapper.finish()


def placed(pose: FloatArray, points: FloatArray) -> FloatArray:
    """Points (n, 3) of the base frame in the map frame, m."""
    return np.column_stack((transform_points(pose, points[:, :2]), points[:, 2]))


def lifted(points: FloatArray, height: float) -> FloatArray:
    """Points (n, 2) at a height, as (n, 3), m."""
    return np.column_stack((points, np.full(len(points), height)))
