"""What must be known of bags before their records can be streamed: topics, frames, the no-echo value."""

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from glassslam.errors import UsageError
from glassslam.records import FloatArray
from glassslam.sources.bag import MULTI_ECHO, Bag, Topic, merge_topics
from glassslam.sources.bagsonar import plan_sonar
from glassslam.sources.deadodometry import dead_warning, is_dead, poses_of
from glassslam.sources.failures import reading
from glassslam.sources.frames import edge_name, guess_base, odometry_edge, read_tree
from glassslam.sources.messages import Mount
from glassslam.sources.multiecho import EchoScan, parse_cdr, parse_ros1
from glassslam.sources.noecho import NoEcho, detect_no_echo
from glassslam.sources.options import Echo, SourceOptions
from glassslam.sources.sonarfeed import SonarPlan
from glassslam.sources.topics import Choice, choose_topics
from glassslam.sources.transforms import (
    Edge,
    Pose2,
    TransformTree,
    frame_name,
    is_upside_down,
    planar,
    tilt,
)

ScanDecoder: TypeAlias = Callable[[bytes], Any]

_WINDOWS = 8
_SCANS_PER_WINDOW = 20
# Some way apart, lest a standing robot shows the same scan again and again.
_STRIDE = 5
_IMU_SAMPLES = 50
_EVENLY = 128
_TILT_NOTED = np.radians(10.0)


@dataclass(frozen=True, slots=True)
class Survey:
    """Everything decided before streaming.

    Attributes
    ----------
    choice : Choice
        Topics in use.
    edge : Edge or None
        The transform that is odometry.
    base_from_laser : tuple of float
        (x, y, yaw), m and rad.
    base_from_imu : ndarray, shape (4, 4)
        Pose of the IMU in the base frame.
    mount : Mount
        How scans are read.
    no_echo : NoEcho
        What a silent beam looks like.
    start, stop : int
        Record times of the part in use, ns; `stop` is exclusive.
    share : float
        Part of the recording in use, 0 to 1.
    sonar : SonarPlan
        How sonars are read.
    warnings : tuple of str
        What a user should know.
    laser_height : float or None
        Height of the laser above the base, m; None when no transform tells it.
    """

    choice: Choice
    edge: Edge | None
    base_from_laser: Pose2
    base_from_imu: FloatArray
    mount: Mount
    no_echo: NoEcho
    start: int
    stop: int
    share: float
    sonar: SonarPlan
    warnings: tuple[str, ...]
    laser_height: float | None = None

    @property
    def odom_name(self) -> str:
        """The odometry in use; empty when there is none."""
        if self.choice.odometry is not None:
            return self.choice.odometry.name
        return edge_name(self.edge) if self.edge is not None else ""


def scan_decoder(bag: Bag, topic: Topic, echo: Echo) -> ScanDecoder:
    """The function that turns a serialised scan of a topic into an object with its fields."""
    if topic.msgtype != MULTI_ECHO:
        return bag.decoder(topic.msgtype)
    return partial(parse_ros1 if bag.piece.format == "rosbag1" else parse_cdr, echo=echo)


def survey(bags: Sequence[Bag], options: SourceOptions) -> Survey:
    """Decide how bags that are pieces of one recording are read.

    Raises
    ------
    NoScansError, UsageError, RecordingError
        As in `open_recording`.
    """
    piece = bags[0].piece
    with reading(piece.path, piece.format), ExitStack() as stack:
        for bag in bags:
            stack.enter_context(bag.session())
        return _Surveyor(bags, options).run()


class _Surveyor:
    """The steps of `survey`, in which warnings gather."""

    def __init__(self, bags: Sequence[Bag], options: SourceOptions) -> None:
        self._bags = bags
        self._options = options
        self._path: Path = bags[0].piece.path
        self._warnings: list[str] = []

    def run(self) -> Survey:
        begin, end = min(bag.start for bag in self._bags), max(bag.end for bag in self._bags)
        seconds = max(0.0, (end - begin) / 1e9)
        topics = merge_topics([topic for bag in self._bags for topic in bag.topics])
        choice = choose_topics(topics, seconds, self._options, self._path)
        self._check_order()
        start, stop = self._window(begin, end)
        choice = self._without_dead_imu(choice)
        laser, base, imu = self._frames(choice)
        wanted = [frame for frame in (base, laser, imu) if frame] if base else []
        tree = read_tree(self._bags, choice.transforms, wanted)
        edge = odometry_edge(tree, choice)
        base = base or (edge.child if edge else guess_base(tree, laser))
        choice, edge = self._without_dead_odometry(choice, edge)
        matrix = self._base_from_laser(tree, base, laser)
        no_echo = detect_no_echo(self._sample_ranges(choice.scan))
        base_from_imu = tree.lookup(base, imu) if imu else None
        sonar = plan_sonar(self._bags, topics, choice.transforms, base, self._options)
        return Survey(
            choice=choice,
            edge=edge,
            base_from_laser=self._options.laser_pose or planar(matrix),
            base_from_imu=np.eye(4) if base_from_imu is None else base_from_imu,
            mount=Mount(no_echo.ceiling, is_upside_down(matrix)),
            no_echo=no_echo,
            start=start,
            stop=stop,
            share=min(1.0, (stop - start) / (end + 1 - begin)),
            sonar=sonar,
            warnings=(*self._warnings, *sonar.warnings),
            # a laser that is its own base is of no known height
            laser_height=None if tree.lookup(base, laser) is None or base == laser else float(matrix[2, 3]),
        )

    def _check_order(self) -> None:
        for before, after in itertools.pairwise(self._bags):
            if after.start < before.end:
                self._warnings.append(
                    f"{after.piece.path} begins before {before.piece.path} ends: pieces are read as ordered"
                )

    def _window(self, begin: int, end: int) -> tuple[int, int]:
        start = begin + round(self._options.start * 1e9)
        if start > end:
            raise UsageError(
                f"start {self._options.start:g} s lies beyond the end of the recording"
                f" ({(end - begin) / 1e9:.1f} s)"
            )
        length = self._options.duration
        return start, end + 1 if length is None else min(end + 1, start + round(length * 1e9))

    def _frames(self, choice: Choice) -> tuple[str, str, str]:
        """Frames of the laser, the base (empty unless odometry names it) and the IMU."""
        scan = self._first(choice.scan)
        odometry = self._first(choice.odometry) if choice.odometry else None
        imu = self._first(choice.imu) if choice.imu else None
        laser = "" if scan is None else scan.frame_id if isinstance(scan, EchoScan) else scan.header.frame_id
        base = odometry.child_frame_id if odometry else ""
        return frame_name(laser), frame_name(base), frame_name(imu.header.frame_id) if imu else ""

    def _without_dead_imu(self, choice: Choice) -> Choice:
        """An IMU whose gyroscope says exactly zero all the time is worse than none."""
        if choice.imu is None or self._options.imu_topic is not None:
            return choice
        rates = [message.angular_velocity for message in self._samples(choice.imu, _IMU_SAMPLES)]
        if any(rate.x or rate.y or rate.z for rate in rates):
            return choice
        self._warnings.append(f"{choice.imu.name} is not used: its angular velocity is always zero")
        return replace(choice, imu=None)

    def _without_dead_odometry(self, choice: Choice, edge: Edge | None) -> tuple[Choice, Edge | None]:
        """Odometry that stands still all the time while the robot drives is worse than none."""
        moving = [topic for topic in choice.transforms if edge is not None and topic.name == edge.topic]
        topic = next(iter(moving), choice.odometry)
        if topic is None or self._options.odom_topic is not None:
            return choice, edge
        some = poses_of(self._samples(topic, _SCANS_PER_WINDOW), edge)
        every = poses_of(self._evenly(topic), edge)  # records may all bear the same time
        if not is_dead(itertools.chain(some, every), lambda: self._evenly(choice.scan)):
            return choice, edge
        self._warnings.append(dead_warning(topic.name if edge is None else edge_name(edge)))
        return replace(choice, odometry=None, odometry_from_tf=None), None

    def _base_from_laser(self, tree: TransformTree, base: str, laser: str) -> FloatArray:
        matrix = tree.lookup(base, laser)
        if matrix is None:
            if base and base != laser and self._options.laser_pose is None:
                self._warnings.append(
                    f"no transform from {base} to {laser}: the laser is taken to sit at the base"
                    " (--laser-pose x,y,yaw says otherwise)"
                )
            return np.eye(4)
        if not tree.is_rigid(base, laser):
            self._warnings.append(f"the laser moves on the robot ({base} to {laser}): its first pose is used")
        if tilt(matrix) > _TILT_NOTED:
            self._warnings.append(
                f"the laser is tilted by {np.degrees(tilt(matrix)):.0f} deg: ranges are slant"
            )
        return matrix

    def _sample_ranges(self, topic: Topic) -> Iterator[Any]:
        return (message.ranges for message in self._samples(topic, _SCANS_PER_WINDOW))

    def _samples(self, topic: Topic, count: int) -> Iterator[Any]:
        """Messages from several places of the recording."""
        for bag in self._bags:
            length = (bag.end - bag.start) / _WINDOWS
            for k in range(_WINDOWS):
                start = bag.start + round(k * length)
                yield from self._sample(bag, topic, count, start, start + round(length) + 1)

    def _evenly(self, topic: Topic) -> Iterator[Any]:
        """Messages from all over the recording, whatever their times: all of it is read."""
        for bag in self._bags:
            stride = max(1, math.ceil(sum(t.count for t in bag.topics if t.name == topic.name) / _EVENLY))
            yield from self._sample(bag, topic, _EVENLY, bag.start, stride=stride)

    def _first(self, topic: Topic) -> Any:
        """The first readable message of a topic, or None."""
        return next((m for bag in self._bags for m in self._sample(bag, topic, 1, bag.start)), None)

    def _sample(
        self,
        bag: Bag,
        topic: Topic,
        count: int,
        start: int,
        stop: int | None = None,
        *,
        stride: int = _STRIDE,
    ) -> Iterator[Any]:
        """Readable messages of a topic from a record time on, some way apart."""
        found = next((t for t in bag.topics if (t.name, t.msgtype) == (topic.name, topic.msgtype)), None)
        if found is None:
            return
        decode = scan_decoder(bag, found, self._options.echo)
        with closing(bag.messages([found], start, stop)) as messages:
            for _, _, raw in itertools.islice(messages, 0, count * stride, stride):
                try:
                    yield decode(raw)
                except Exception:  # noqa: S112  (counted when the record is due)
                    continue
