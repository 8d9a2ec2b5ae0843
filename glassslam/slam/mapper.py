"""The mapper: records in, a map out."""

from collections import Counter, deque

import numpy as np

from glassslam.config import Config
from glassslam.errors import NoScansError
from glassslam.records import FloatArray, Imu, LaserScan, Odometry, Record, RecordingInfo, Trajectory
from glassslam.slam.extrapolator import PoseExtrapolator
from glassslam.slam.global_slam import GlobalSlam
from glassslam.slam.local import LocalResult, LocalSlam, prepared
from glassslam.slam.odometry_track import mend_late_stamps
from glassslam.slam.range_data import prepare
from glassslam.slam.render import render
from glassslam.slam.result import MapResult, OccupancyMap, RunStatistics
from glassslam.slam.scan_check import defect, mended, sweep_time
from glassslam.slam.stopwatch import Stages
from glassslam.slam.trajectory import corrected_poses

_LONGEST_WAIT = 1.0
_MOST_WAITING = 200
_LOOK_AHEAD = 3
_BATCH = 16


class Mapper:
    """Builds a map from records, one at a time.

    Parameters
    ----------
    config : Config
        All parameters.
    base_from_laser : array_like, shape (3,)
        Pose (x, y, yaw) of the laser in the frame of the base, m and rad.

    Examples
    --------
    >>> import glassslam as gs
    >>> import numpy as np
    >>> mapper = gs.Mapper(gs.Config())
    >>> for k in range(3):
    ...     ranges = np.full(180, 2.0, dtype=np.float32)
    ...     mapper.add(gs.LaserScan(0.1 * k, ranges, -np.pi / 2, np.pi / 180, 0.1, 30.0))
    >>> mapper.finish().trajectory.poses.shape
    (3, 3)
    """

    def __init__(self, config: Config | None = None, base_from_laser: object = (0.0, 0.0, 0.0)) -> None:
        self._config = config or Config()
        self._base_from_laser = np.asarray(base_from_laser, dtype=np.float64)
        self._stages = Stages()
        self._extrapolator = PoseExtrapolator()
        self._local = LocalSlam(self._config)
        self._global = GlobalSlam(self._config, self._stages)
        self._waiting: deque[tuple[LaserScan, FloatArray | None]] = deque()
        self._times: list[float] = []
        self._stamps: list[float] = []
        self._poses: list[FloatArray] = []
        self._read = 0
        self._dropped: Counter[str] = Counter()

    def add(self, record: Record) -> None:
        """Take one record, in the order of the recording.

        A scan waits for the next few and until odometry reaches its stamp, at most a second of recorded
        time.
        """
        if isinstance(record, LaserScan):
            self._add_scan(record)
        elif isinstance(record, Odometry):
            self._extrapolator.add_odometry(record)
        elif isinstance(record, Imu):
            self._extrapolator.add_imu(record)
        if len(self._waiting) > _BATCH:
            self._process_waiting(_LOOK_AHEAD)

    def finish(self, info: RecordingInfo | None = None) -> MapResult:
        """Process what waits, close the last loops, optimise and render.

        Raises
        ------
        NoScansError
            Not one usable scan came in.
        """
        self._process_waiting(0)
        for submap in self._local.finish():
            self._global.add_submap(submap)
        if not self._global.nodes:
            self._global.abandon()
            raise NoScansError(
                "no usable laser scan in the recording",
                f"{self._read} scans read; dropped: {dict(self._dropped) or 'none'}",
            )
        self._global.finish()
        with self._stages.measure("rendering"):
            grid = render(self._global.nodes, self._global.poses, self._config.map)
        return self._result(grid, info)

    def close(self) -> None:
        """Give up: stop background work without a result."""
        self._global.abandon()

    def _add_scan(self, scan: LaserScan) -> None:
        self._read += 1
        reason = defect(scan)
        if reason:
            self._dropped[reason] += 1
            return
        scan = mended(scan)
        track = self._extrapolator.odometry
        mend_late_stamps(self._times, scan.stamp)
        self._waiting.append((scan, track.latest_pose if track.latest == scan.stamp else None))
        self._times.append(scan.stamp)

    def _is_ready(self, time: float) -> bool:
        """Whether odometry has reached a time, or is not coming."""
        if self._extrapolator.odometry.latest >= time or len(self._waiting) > _MOST_WAITING:
            return True
        return abs(self._times[-1] - time) > _LONGEST_WAIT

    def _process_waiting(self, left: int) -> None:
        """Place the waiting scans that are ready, all but the last `left`."""
        placed = []
        with self._stages.measure("local SLAM"):
            while len(self._waiting) > left and (left == 0 or self._is_ready(self._times[0])):
                placed.append(self._place(*self._waiting.popleft()))
        for result in placed:
            if result.finished is not None:
                self._global.add_submap(result.finished)
            if result.node is not None:
                self._global.add_node(result.node)

    def _place(self, scan: LaserScan, paired: FloatArray | None) -> LocalResult:
        """Match one scan; `paired` is the odometry recorded together with it, if any."""
        time = self._times.pop(0)
        odometry = self._extrapolator.odometry.pose_at(time) if paired is None else paired
        prediction = self._extrapolator.predict(time, odometry)
        data = prepare(scan, self._base_from_laser, prediction.twist, self._config.sensor)
        result = self._local.add(prepared(data, self._config.filter.voxel_filter_size), prediction)
        self._extrapolator.add_pose(
            time, result.pose_in_local, odometry, 0.5 * sweep_time(scan), prediction.twist
        )
        self._stamps.append(scan.stamp)
        self._poses.append(result.pose_in_local)
        return result

    def _result(self, grid: OccupancyMap, info: RecordingInfo | None) -> MapResult:
        nodes = self._global.nodes
        poses = np.array(self._global.poses)
        every = corrected_poses(
            np.array(self._poses),
            np.array([node.scan for node in nodes]),
            np.array([node.pose_in_local for node in nodes]),
            poses,
        )
        return MapResult(
            map=grid,
            trajectory=Trajectory(np.array(self._stamps), every),
            node_stamps=np.array([node.stamp for node in nodes]),
            node_poses=poses,
            submap_nodes=tuple(submap.nodes[0] for submap in self._global.submaps),
            constraints=self._global.graph.constraints,
            config=self._config,
            statistics=self._statistics(),
            info=info,
        )

    def _statistics(self) -> RunStatistics:
        used, taken_out = self._global.closures()
        rejected = dict(sorted(self._global.rejected.items()))
        if taken_out:
            rejected["taken out after optimisation"] = taken_out
        return RunStatistics(
            scans_read=self._read,
            scans_used=len(self._stamps),
            scans_dropped=dict(sorted(self._dropped.items())),
            recording_seconds=float(max(self._stamps) - min(self._stamps)),
            stages=dict(sorted(self._stages.times.items())),
            nodes=len(self._global.nodes),
            submaps=len(self._global.submaps),
            closures_tried=self._global.searches,
            closures_accepted=used,
            closures_rejected=rejected,
            residuals=self._global.residuals(),
        )
