"""CARMEN logs as a stream of records."""

import math
from collections.abc import Iterator, Sequence

from glassslam.errors import UsageError
from glassslam.records import Damage, LaserScan, Odometry, Record, RecordingInfo
from glassslam.sources.carmenlines import ODOM, LaserLine, NumberReader, Pose, parse_laser, parse_odom
from glassslam.sources.carmensurvey import CarmenSurvey, carmen_lines, survey
from glassslam.sources.formats import Piece
from glassslam.sources.messages import BAD_ODOMETRY, UnusableMessageError, upper_limit
from glassslam.sources.options import SourceOptions
from glassslam.sources.recording import Recording
from glassslam.sources.textlines import TextLog


def open_carmen(pieces: Sequence[Piece], options: SourceOptions) -> "CarmenRecording":
    """Open CARMEN logs that are consecutive pieces of one recording.

    Raises
    ------
    NoScansError, UsageError, RecordingError
        As in `open_recording`.
    """
    if options.imu_topic not in {None, "none"}:
        raise UsageError(f"imu topic {options.imu_topic} is not in the log; a CARMEN log has no IMU")
    if (options.sonar_topics or options.sonar_ring is not None) and not options.without_sonar:
        raise UsageError("a CARMEN log holds no sonar", "--sonar names a second file that does")
    if options.points_topics:
        raise UsageError("a CARMEN log holds no 3D points", "leave out --points-topic")
    return CarmenRecording(pieces, survey(pieces, options), options)


class CarmenRecording(Recording):
    """A recording in CARMEN logs; see `Recording`.

    The odometry pose written in a laser line belongs to the very scan and comes right before it; ODOM lines
    are stamped on their own, pair less well, and are used only when laser lines carry no pose.
    """

    def __init__(self, pieces: Sequence[Piece], found: CarmenSurvey, options: SourceOptions) -> None:
        start, stop = _window(found, options)
        span = max(start, found.begin), min(stop, found.end)
        super().__init__(_info(pieces, found, options, start, stop), found.warnings, span)
        self._pieces = pieces
        self._found = found
        self._options = options
        self._start, self._stop = start, stop

    @property
    def damage(self) -> tuple[Damage, ...]:
        """What could not be read."""
        return self._found.damage

    def _stream(self) -> Iterator[Record]:
        reader = NumberReader()
        seen = 0
        for tag, line in self._lines():
            try:
                if tag == ODOM:
                    stamp, logged, pose = parse_odom(line, reader)
                    time = self._found.record_time(stamp, logged)
                    if self._inside(time):
                        yield _odometry(stamp, pose, time)
                    continue
                laser = parse_laser(line, reader)
            except UnusableMessageError as error:
                self._drop(str(error))
                continue
            time = self._found.record_time(laser.stamp, laser.logged)
            if self._inside(time):
                seen += 1
                if (seen - 1) % self._options.every == 0:
                    yield from self._laser(laser, time)

    def _lines(self) -> Iterator[tuple[str, bytes]]:
        used = {self._found.laser, self._found.odometry}
        for piece in self._pieces:
            for tag, line in carmen_lines(TextLog(piece)):
                if tag in used and tag:
                    yield tag, line

    def _inside(self, time: float) -> bool:
        return self._start <= time <= self._stop

    def _laser(self, laser: LaserLine, time: float) -> Iterator[Record]:
        if self._found.odometry == self._found.laser:
            try:
                yield _odometry(laser.stamp, laser.robot_pose, time)
            except UnusableMessageError as error:
                self._drop(str(error))
        yield LaserScan(
            stamp=laser.stamp,
            ranges=laser.ranges,
            angle_min=laser.angle_min,
            angle_increment=laser.angle_increment,
            range_min=0.0,
            range_max=upper_limit(laser.range_max, self._found.no_echo.ceiling),
            intensities=laser.intensities,
            record_stamp=time,
        )


def _odometry(stamp: float, pose: Pose, time: float) -> Odometry:
    if not all(map(math.isfinite, pose)):
        raise UnusableMessageError(BAD_ODOMETRY)
    return Odometry(stamp, pose, time)


def _window(found: CarmenSurvey, options: SourceOptions) -> tuple[float, float]:
    """First and last record time in use, s; all of it unless a part is asked for."""
    length = found.end - found.begin
    if options.start > length:
        raise UsageError(f"start {options.start:g} s lies beyond the end of the recording ({length:.1f} s)")
    # Without a wish nothing is cut off: stamps may step outside those of the first and last line.
    start = found.begin + options.start if options.start > 0 else -math.inf
    stop = math.inf if options.duration is None else max(start, found.begin) + options.duration
    return start, stop


def _info(
    pieces: Sequence[Piece], found: CarmenSurvey, options: SourceOptions, start: float, stop: float
) -> RecordingInfo:
    length = found.end - found.begin
    used = min(stop, found.end) - max(start, found.begin)
    share = used / length if length > 0 else 1.0
    return RecordingInfo(
        paths=tuple(str(piece.path) for piece in pieces),
        format="carmen",
        duration=used,
        scan_count=-(-round(found.counts[found.laser] * share) // options.every),
        base_from_laser=found.base_from_laser,
        scan_topic=found.laser,
        odom_topic=found.odometry,
        no_echo=found.no_echo.value,
    )
