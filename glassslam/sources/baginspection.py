"""ROS bags looked over."""

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from glassslam.errors import GlassSlamError
from glassslam.sources import messages
from glassslam.sources.bag import (
    IMU,
    MULTI_ECHO,
    ODOMETRY,
    TF_TYPES,
    USED_TYPES,
    Bag,
    Topic,
    merge_topics,
    open_bag,
)
from glassslam.sources.bagsurvey import scan_decoder
from glassslam.sources.formats import Piece
from glassslam.sources.frames import is_static
from glassslam.sources.messages import Mount, UnusableMessageError
from glassslam.sources.observers import ImuObserver, OdometryObserver, ScanObserver, gather
from glassslam.sources.report import Plan, RecordingReport, TopicReport, TransformReport
from glassslam.sources.topics import rate
from glassslam.sources.transforms import Edge, TransformTree, frame_name

Feed = Callable[[bytes, int], None]


class BagInspection:
    """One pass over bags with an observer for each topic of a known type.

    Parameters
    ----------
    pieces : sequence of Piece
        Consecutive pieces of one recording.
    strict : bool
        Whether damage is refused rather than reported.
    """

    def __init__(self, pieces: Sequence[Piece], *, strict: bool = False) -> None:
        self._pieces, self._strict = pieces, strict
        self._scans: dict[str, ScanObserver] = {}
        self._odometry: dict[str, OdometryObserver] = {}
        self._imus: dict[str, ImuObserver] = {}
        self._tree = TransformTree()
        self._dropped: dict[str, int] = {}

    def run(self, plan: Plan, warnings: tuple[str, ...]) -> RecordingReport:
        """Read everything and report.

        Raises
        ------
        RecordingError
            A file is damaged.
        """
        bags = [open_bag(piece, strict=self._strict) for piece in self._pieces]
        for bag in bags:
            self._read(bag)
        begin, end = min(bag.start for bag in bags), max(bag.end for bag in bags)
        seconds = max(0.0, (end - begin) / 1e9)
        topics = merge_topics([topic for bag in bags for topic in bag.topics])
        return RecordingReport(
            paths=tuple(str(piece.path) for piece in self._pieces),
            format=self._pieces[0].format,
            size=sum(map(_size, self._pieces)),
            begin=begin / 1e9 if end >= begin else 0.0,
            duration=seconds,
            topics=tuple(_topic_report(topic, seconds) for topic in topics),
            scans=gather(observer.report() for observer in self._scans.values()),
            odometry=gather(observer.report() for observer in self._odometry.values()),
            imus=gather(observer.report() for observer in self._imus.values()),
            transforms=tuple(_transform_report(edge) for edge in self._tree.edges.values()),
            plan=plan,
            dropped=self._dropped,
            warnings=warnings,
            damage=tuple(damage for bag in bags for damage in bag.damage),
        )

    def _read(self, bag: Bag) -> None:
        feeds = {topic: self._feed(bag, topic) for topic in bag.topics if topic.msgtype in USED_TYPES}
        if not feeds:
            return
        for topic, time, raw in bag.messages(list(feeds)):
            try:
                feeds[topic](raw, time)
            except UnusableMessageError as error:
                self._drop(f"{topic.name}: {error}")
            except GlassSlamError:
                raise
            except Exception:
                self._drop(f"{topic.name}: {messages.UNREADABLE}")

    def _drop(self, reason: str) -> None:
        self._dropped[reason] = self._dropped.get(reason, 0) + 1

    def _feed(self, bag: Bag, topic: Topic) -> Feed:
        if topic.msgtype == ODOMETRY:
            return partial(self._feed_odometry, topic.name, bag.decoder(topic.msgtype))
        if topic.msgtype == IMU:
            return partial(self._feed_imu, topic.name, bag.decoder(topic.msgtype))
        if topic.msgtype in TF_TYPES:
            return partial(self._feed_transforms, topic, bag.decoder(topic.msgtype))
        convert = messages.echo_scan if topic.msgtype == MULTI_ECHO else messages.laser_scan
        decode = scan_decoder(bag, topic, "first")
        observer = self._scans.setdefault(topic.name, ScanObserver(topic.name))
        return lambda raw, time: observer.add(convert(decode(raw), time, Mount()))

    def _feed_odometry(self, name: str, decode: Callable[[bytes], Any], raw: bytes, time: int) -> None:
        message = decode(raw)
        if name not in self._odometry:
            frames = f"{frame_name(message.header.frame_id)} -> {frame_name(message.child_frame_id)}"
            self._odometry[name] = OdometryObserver(name, frames)
        self._odometry[name].add(messages.odometry(message, time))

    def _feed_imu(self, name: str, decode: Callable[[bytes], Any], raw: bytes, time: int) -> None:
        message = decode(raw)
        if name not in self._imus:
            self._imus[name] = ImuObserver(name, frame_name(message.header.frame_id))
        self._imus[name].add(messages.imu(message, time, np.eye(4)))

    def _feed_transforms(self, topic: Topic, decode: Callable[[bytes], Any], raw: bytes, _: int) -> None:
        transforms = decode(raw).transforms
        self._tree.add_message(transforms, topic.name, static=is_static(topic))


def _size(piece: Piece) -> int:
    files = piece.path.iterdir() if piece.path.is_dir() else [piece.path]
    return sum(file.stat().st_size for file in files if file.is_file())


def _topic_report(topic: Topic, seconds: float) -> TopicReport:
    return TopicReport(topic.name, topic.msgtype, topic.count, rate(topic, seconds))


def _transform_report(edge: Edge) -> TransformReport:
    m = edge.matrix
    x, y, z = m[:3, 3].tolist()
    roll, pitch = math.atan2(m[2, 1], m[2, 2]), math.asin(max(-1.0, min(1.0, -float(m[2, 0]))))
    return TransformReport(
        parent=edge.parent,
        child=edge.child,
        topic=edge.topic,
        static=edge.static,
        moved=edge.moved,
        count=edge.count,
        position=(x, y, z),
        rotation=(roll, pitch, math.atan2(m[1, 0], m[0, 0])),
    )
