"""ROS bags as a stream of records."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

from glassslam.records import Damage, LaserScan, Record, RecordingInfo
from glassslam.sources import messages
from glassslam.sources.bag import MULTI_ECHO, RANGE, Bag, Topic, open_bag
from glassslam.sources.bagsurvey import Survey, scan_decoder, survey
from glassslam.sources.formats import Piece
from glassslam.sources.messages import UnusableMessageError
from glassslam.sources.options import SourceOptions
from glassslam.sources.recording import Recording
from glassslam.sources.sonarfeed import ReadSonar, SonarFeed
from glassslam.sources.transforms import Edge, frame_name

Handler = Callable[[bytes, int], Iterator[Record]]
Convert = Callable[[Any, int], Any]


def open_bags(pieces: Sequence[Piece], options: SourceOptions) -> "BagRecording":
    """Open bags that are consecutive pieces of one recording.

    Raises
    ------
    NoScansError, UsageError, RecordingError
        As in `open_recording`.
    """
    bags = [open_bag(piece, strict=options.strict) for piece in pieces]
    return BagRecording(bags, survey(bags, options), options)


class BagRecording(Recording):
    """A recording in ROS bags; see `Recording`."""

    def __init__(self, bags: Sequence[Bag], found: Survey, options: SourceOptions) -> None:
        span = found.start / 1e9, (found.stop - 1) / 1e9
        super().__init__(_info(bags, found, options), found.warnings, span, found.sonar.rule)
        self._bags = bags
        self._found = found
        self._options = options
        self._scans_seen = 0

    @property
    def damage(self) -> tuple[Damage, ...]:
        """What could not be read so far."""
        return tuple(damage for bag in self._bags for damage in bag.damage)

    def _stream(self) -> Iterator[Record]:
        self._scans_seen = 0
        sonar = SonarFeed(self._found.sonar)
        for bag in self._bags:
            yield from self._stream_bag(bag, sonar)
        yield from sonar.flush()

    def _stream_bag(self, bag: Bag, sonar: SonarFeed) -> Iterator[Record]:
        handlers = {topic: self._handler(bag, topic) for topic in bag.topics if self._uses(topic)}
        for topic in bag.topics:
            if topic.count > 0 and self._found.sonar.uses(topic):
                handlers[topic] = partial(_all, bag.decoder(topic.msgtype), sonar.reader(topic))
        for topic, time, raw in bag.messages(list(handlers), self._found.start, self._found.stop):
            if topic.msgtype != RANGE:
                yield from sonar.flush()
            try:
                yield from handlers[topic](raw, time)
            except UnusableMessageError as error:
                self._drop(str(error))

    def _uses(self, topic: Topic) -> bool:
        choice = self._found.choice
        used = [choice.scan, choice.odometry, choice.imu]
        if self._found.edge is not None:
            used += [tf for tf in choice.transforms if tf.name == self._found.edge.topic]
        key = (topic.name, topic.msgtype)
        return topic.count > 0 and any(other and (other.name, other.msgtype) == key for other in used)

    def _handler(self, bag: Bag, topic: Topic) -> Handler:
        choice, edge = self._found.choice, self._found.edge
        if topic.name == choice.scan.name and topic.msgtype == choice.scan.msgtype:
            convert = messages.echo_scan if topic.msgtype == MULTI_ECHO else messages.laser_scan
            return partial(self._scan, scan_decoder(bag, topic, self._options.echo), convert)
        decode = bag.decoder(topic.msgtype)
        if choice.odometry and topic.name == choice.odometry.name:
            return partial(_one, decode, messages.odometry)
        if choice.imu and topic.name == choice.imu.name:
            return partial(_one, decode, partial(messages.imu, base_from_imu=self._found.base_from_imu))
        if edge is None:
            raise LookupError(f"no use for topic {topic.name}")
        return partial(self._transforms, decode, edge)

    def _scan(
        self,
        decode: Callable[[bytes], Any],
        convert: Callable[[Any, int, messages.Mount], LaserScan],
        raw: bytes,
        time: int,
    ) -> Iterator[Record]:
        self._scans_seen += 1
        if (self._scans_seen - 1) % self._options.every:
            return

        def checked(message: Any, time: int) -> LaserScan:
            if messages.has_foreign_intensities(message):
                self._warn("intensities that do not belong to the beams one by one are ignored")
            return convert(message, time, self._found.mount)

        yield _convert(decode, checked, raw, time)

    def _transforms(
        self, decode: Callable[[bytes], Any], edge: Edge, raw: bytes, time: int
    ) -> Iterator[Record]:
        for stamped in _convert(decode, lambda message, _: _links(message, edge), raw, time):
            try:
                record = messages.odometry_from_transform(stamped, time)
            except UnusableMessageError as error:
                self._drop(str(error))
            else:
                yield record


def _links(message: Any, edge: Edge) -> list[Any]:
    """The transforms of a message that are the given link."""
    return [
        stamped
        for stamped in message.transforms
        if (frame_name(stamped.header.frame_id), frame_name(stamped.child_frame_id))
        == (edge.parent, edge.child)
    ]


def _one(decode: Callable[[bytes], Any], convert: Convert, raw: bytes, time: int) -> Iterator[Record]:
    yield _convert(decode, convert, raw, time)


def _all(decode: Callable[[bytes], Any], read: ReadSonar, raw: bytes, time: int) -> Iterator[Record]:
    yield from _convert(decode, read, raw, time)


def _convert(decode: Callable[[bytes], Any], convert: Convert, raw: bytes, time: int) -> Any:
    """A decoded and converted message; every failure makes it an unusable one."""
    try:
        return convert(decode(raw), time)
    except UnusableMessageError:
        raise
    except Exception as error:
        raise UnusableMessageError(messages.UNREADABLE) from error


def _info(bags: Sequence[Bag], found: Survey, options: SourceOptions) -> RecordingInfo:
    imu, scans = found.choice.imu, found.choice.scan.count
    return RecordingInfo(
        paths=tuple(str(bag.piece.path) for bag in bags),
        format=bags[0].piece.format,
        duration=(found.stop - 1 - found.start) / 1e9,
        scan_count=-(-round(scans * found.share) // options.every),
        base_from_laser=found.base_from_laser,
        scan_topic=found.choice.scan.name,
        odom_topic=found.odom_name,
        imu_topic=imu.name if imu else "",
        no_echo=found.no_echo.value,
        sonar_ring=found.sonar.ring,
        sonar_topics=found.sonar.names,
        points_topics=found.sonar.points_names,
        laser_height=found.laser_height,
    )
