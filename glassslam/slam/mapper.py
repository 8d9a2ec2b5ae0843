"""The mapper: records in, a map out."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from glassslam.config import Config
from glassslam.errors import NoScansError
from glassslam.geometry import compose
from glassslam.records import FloatArray, Imu, LaserScan, Odometry, Record, RecordingInfo, Trajectory
from glassslam.slam.extrapolator import PoseExtrapolator, Prediction
from glassslam.slam.glass_watch import GlassWatch, Look
from glassslam.slam.global_slam import GlobalSlam
from glassslam.slam.journal import Journal, NoJournal, ScanOutcome
from glassslam.slam.local import LocalResult, LocalSlam, prepared
from glassslam.slam.motion_watch import MotionWatch
from glassslam.slam.range_data import RangeData, prepare
from glassslam.slam.result import MapResult
from glassslam.slam.scan_check import checked_mount, defect, mended, sweep_time
from glassslam.slam.scan_queue import ScanQueue, TimedScan
from glassslam.slam.settled import SettledRun, draw
from glassslam.slam.stopwatch import Stages
from glassslam.slam.tally import Tally, run_statistics
from glassslam.slam.trajectory import PoseTracks, corrected_poses

if TYPE_CHECKING:
    from glassslam.slam.settled import GlassSource


class Mapper:
    """Builds a map from records, one at a time.

    Parameters
    ----------
    config : Config
        All parameters.
    base_from_laser : array_like, shape (3,)
        Pose (x, y, yaw) of the laser in the frame of the base, m and rad.
    journal : Journal, optional
        Outcomes of an earlier run of the same records, and where those of this one are written down.

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

    def __init__(
        self,
        config: Config | None = None,
        base_from_laser: object = (0.0, 0.0, 0.0),
        journal: Journal | None = None,
    ) -> None:
        self._config = config or Config()
        self._base_from_laser = checked_mount(base_from_laser)
        self._stages = Stages()
        self._extrapolator = PoseExtrapolator()
        self._waiting = ScanQueue(self._extrapolator.odometry)
        self._local = LocalSlam(self._config)
        self._journal = journal or NoJournal()
        self._global = GlobalSlam(self._config, self._stages, self._journal)
        self._poses: list[FloatArray] = []
        self._corrections: list[FloatArray] = []
        self._tally = Tally(motion=MotionWatch(float(self._base_from_laser[2])))
        self._glass = GlassWatch(self._config.glass, self._base_from_laser, self._config.sensor)

    @property
    def config(self) -> Config:
        """All parameters."""
        return self._config

    def add(self, record: Record) -> None:
        """Take one record, in the order of the recording."""
        if isinstance(record, LaserScan):
            self._add_scan(record)
        elif isinstance(record, Odometry):
            self._extrapolator.add_odometry(record)
        elif isinstance(record, Imu):
            self._extrapolator.add_imu(record)
        if self._waiting.is_full:
            self._process(self._waiting.take())

    def finish(
        self, info: RecordingInfo | None = None, glass_sources: "Sequence[GlassSource]" = ()
    ) -> MapResult:
        """Process what waits, close the last loops, optimise and render.

        Parameters
        ----------
        info : RecordingInfo, optional
            The source, for the report.
        glass_sources : sequence of callable
            Sensors beside the lidar that see glass; see `draw`.

        Raises
        ------
        NoScansError
            Not one usable scan came in, or not one had a return.
        """
        return draw(self.settle(), info, glass_sources)

    def settle(self) -> SettledRun:
        """Process what waits, close the last loops and optimise: `finish` without drawing maps.

        Raises
        ------
        NoScansError
            Not one usable scan came in, or not one had a return.
        SessionError
            The records are not those of the earlier run.
        """
        try:
            self._process(self._waiting.take(everything=True))
            if not self.is_hurried:
                self._journal.confirm_end()
            for submap in self._local.finish():
                self._global.add_submap(submap)
            self._check_seen()
            self._global.finish()
        finally:
            self.close()
        with self._stages.measure("glass"):
            self._glass.settle()
        return self._settled()

    def hurry(self) -> None:
        """Make no further searches for loop closures and write nothing more down; from any thread.

        What follows, `settle` above all, makes the best of what there is, and is no part of the run.
        """
        self._global.hurry()

    @property
    def is_hurried(self) -> bool:
        """Whether the run was told to hurry."""
        return self._global.is_hurried

    def close(self) -> None:
        """Stop background work; without `finish` this gives the run up."""
        self._global.abandon()

    def _add_scan(self, scan: LaserScan) -> None:
        self._tally.read += 1
        reason = defect(scan)
        if reason:
            self._tally.dropped[reason] += 1
        else:
            self._waiting.add(mended(scan))

    def _process(self, scans: Iterator[TimedScan]) -> None:
        """Local SLAM for all of them, then global SLAM for what came of it."""
        self._local.locks.map_from_local = self._global.map_from_local
        with self._stages.measure("local SLAM"):
            placed = [self._place(scan) for scan in scans]
        for result in placed:
            for submap in result.finished:
                self._global.add_submap(submap)
            if result.node is not None:
                self._global.add_node(result.node)

    def _place(self, timed: TimedScan) -> LocalResult:
        scan, time, odometry = timed.scan, timed.time, timed.odometry_pose
        prediction = self._extrapolator.predict(time, odometry)
        look = self._glass.look(scan, prediction.twist)
        known = self._journal.recall_scan()
        if known is None:
            result, returns = self._matched(scan, prediction, look)
        else:
            result, returns = self._repeated(known, scan, prediction, look)
        self._extrapolator.add_pose(
            time, result.pose_in_local, odometry, 0.5 * sweep_time(scan), prediction.twist
        )
        self._poses.append(result.pose_in_local)
        self._corrections.append(self._local.locks.map_from_local)
        self._glass.add(look, result)
        self._tally.place(scan, returns, odometry, result.pose_in_local)
        return result

    def _matched(self, scan: LaserScan, prediction: Prediction, look: Look) -> tuple[LocalResult, int]:
        """Local SLAM for a scan, and the number of its returns."""
        data = self._range_data(scan, prediction, look)
        returns = _returns(data)
        match = self._local.match(data, prediction)
        result = self._local.enter(match, data, look.points)
        if not self.is_hurried:
            outcome = ScanOutcome(match, replace(self._local.tracking), returns, result.node is not None)
            self._journal.keep_scan(scan.stamp, outcome, result.node)
        return result, returns

    def _repeated(
        self, known: ScanOutcome, scan: LaserScan, prediction: Prediction, look: Look
    ) -> tuple[LocalResult, int]:
        """The same with what is known of it from before."""
        data = self._range_data(scan, prediction, look)
        self._local.tracking = replace(known.tracking)
        result = self._local.enter(known.match, data, look.points)
        # in a hurry scans do not wait for what comes after them, and so may come out otherwise
        if not self.is_hurried:
            self._journal.confirm_scan(scan.stamp, _returns(data), result.node)
        return result, known.returns

    def _range_data(self, scan: LaserScan, prediction: Prediction, look: Look) -> RangeData:
        """Returns and free rays of a scan, thinned."""
        behind = None if self._config.glass.ghosts_in_matching else look.behind_glass()
        data = prepare(scan, self._base_from_laser, prediction.twist, self._config.sensor, behind)
        return prepared(data, self._config.filter.voxel_filter_size)

    def _check_seen(self) -> None:
        if not self._poses:
            raise NoScansError("no usable laser scan in the recording", self._tally.excuse())
        if not self._tally.returns:
            limits = self._config.sensor
            raise NoScansError(
                f"not one of {len(self._poses)} scans has a return",
                f"used are ranges the scans call valid, from {limits.min_range:g} to {limits.max_range:g} m",
            )

    def _tracks(self) -> PoseTracks:
        """Poses of the run as they were known at different times."""
        nodes, poses = self._global.nodes, self._global.poses
        local, stamps = np.array(self._poses), np.array(self._tally.stamps)
        scans, in_local = np.array([node.scan for node in nodes]), np.array([n.pose_in_local for n in nodes])
        begins = np.array([node.begins for node in nodes])
        return PoseTracks(
            local=Trajectory(stamps, local),
            partial=Trajectory(stamps, compose(np.array(self._corrections), local)),
            nodes=Trajectory(np.array([node.stamp for node in nodes]), np.array(poses)),
            final=Trajectory(stamps, corrected_poses(local, scans, in_local, poses, begins)),
        )

    def _settled(self) -> SettledRun:
        tracks = self._tracks()
        return SettledRun(
            config=self._config,
            nodes=tuple(self._global.nodes),
            submaps=tuple(self._global.submaps),
            constraints=self._global.graph.constraints,
            tracks=tracks,
            statistics=run_statistics(
                self._tally, self._extrapolator, self._local, self._global, self._glass.choice, tracks
            ),
            glass=self._glass.findings(),
            stages=self._stages,
        )


def _returns(data: RangeData) -> int:
    return len(data.returns) + len(data.ghosts)
