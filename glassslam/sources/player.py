"""Logs of the Player robot server as a stream of records."""

import math
from collections.abc import Callable, Iterator, Sequence

from glassslam.errors import UsageError
from glassslam.records import Damage, LaserScan, Odometry, RangeRing, Record, RecordingInfo
from glassslam.sources.carmenlines import NumberReader
from glassslam.sources.formats import Piece
from glassslam.sources.messages import BAD_ODOMETRY, UnusableMessageError, upper_limit
from glassslam.sources.options import SourceOptions
from glassslam.sources.playerdevices import player_lines
from glassslam.sources.playerlines import DESCRIPTIONS, PlayerLine
from glassslam.sources.playersurvey import PlayerSonar, PlayerSurvey, survey_player
from glassslam.sources.playervalues import Pose, parse_pose, parse_ranges, parse_sonar
from glassslam.sources.recording import Recording
from glassslam.sources.sonarfeed import OTHER_SIZE
from glassslam.sources.sweeps import SweepFilter
from glassslam.sources.textlines import TextLog


def open_player(pieces: Sequence[Piece], options: SourceOptions) -> "PlayerRecording":
    """Open Player logs that are consecutive pieces of one recording.

    Raises
    ------
    NoScansError, UsageError, RecordingError
        As in `open_recording`.
    """
    if options.imu_topic not in {None, "none"}:
        raise UsageError(f"imu topic {options.imu_topic} is not in the log; no IMU is read from Player logs")
    return PlayerRecording(pieces, survey_player(pieces, options), options)


class PlayerRecording(Recording):
    """A recording in Player logs; see `Recording`."""

    def __init__(self, pieces: Sequence[Piece], found: PlayerSurvey, options: SourceOptions) -> None:
        span = _window(found, options)
        super().__init__(_info(pieces, found, options, span), found.warnings, span, found.sonar.rule)
        self._pieces = pieces
        self._found = found
        self._options = options

    @property
    def damage(self) -> tuple[Damage, ...]:
        """What could not be read."""
        return self._found.damage

    def _stream(self) -> Iterator[Record]:
        reader, ring = NumberReader(), RingReader(self._found.sonar)
        seen = 0
        for line in _used_lines(self._pieces, self._found, self._drop):
            if not self.span[0] <= line.logged <= self.span[1]:
                continue
            is_scan = line.device == self._found.laser
            seen += is_scan
            if is_scan and (seen - 1) % self._options.every:
                continue
            try:
                yield from self._records(line, reader, ring)
            except UnusableMessageError as error:
                self._drop(str(error))

    def _records(self, line: PlayerLine, reader: NumberReader, ring: "RingReader") -> Iterator[Record]:
        if line.device == self._found.laser:
            yield from self._scan(line, reader)
        elif line.device == self._found.odometry:
            yield _odometry(line, parse_pose(line, reader))
        else:
            yield from ring.read(line, reader)

    def _scan(self, line: PlayerLine, reader: NumberReader) -> Iterator[Record]:
        scan = self._found.devices.scan(line, reader)
        if scan.robot_pose is not None and self._found.odometry == self._found.laser:
            yield _odometry(line, scan.robot_pose)
        yield LaserScan(
            stamp=line.stamp,
            ranges=scan.ranges,
            angle_min=scan.angle_min,
            angle_increment=scan.angle_increment,
            range_min=0.0,
            range_max=upper_limit(scan.range_max, self._found.no_echo.ceiling),
            intensities=scan.intensities,
            record_stamp=line.logged,
        )


class RingReader:
    """Reads the lines of a ring of sonars; remembers what each sonar last said.

    Parameters
    ----------
    sonar : PlayerSonar
        The ring.
    """

    def __init__(self, sonar: PlayerSonar) -> None:
        ring, rule = sonar.ring, sonar.rule
        self._size = 0 if ring is None else len(ring.poses)
        self._filter = None if rule is None else SweepFilter(rule, self._size)

    def read(self, line: PlayerLine, reader: NumberReader) -> Iterator[RangeRing]:
        """The sweep of a line, if it holds one.

        Raises
        ------
        UnusableMessageError
            The line is cut off, or the sweep is of another size.
        """
        if line.kind in {"sweep", "ring", "ring and sweep"}:
            _, ranges = parse_sonar(line, reader)
        elif line.kind == "ranges":
            ranges, _ = parse_ranges(line, reader)
        else:
            return
        if ranges is None or self._filter is None:
            return
        if len(ranges) != self._size:
            raise UnusableMessageError(OTHER_SIZE)
        yield RangeRing(line.stamp, self._filter.read(line.stamp, ranges), line.logged)


def _used_lines(
    pieces: Sequence[Piece], found: PlayerSurvey, drop: Callable[[str], None]
) -> Iterator[PlayerLine]:
    used = {found.laser, found.odometry, found.sonar.device}
    for piece in pieces:
        for line in player_lines(TextLog(piece)):
            if isinstance(line, str):
                drop(line)
            elif line is not None and line.device in used and line.kind not in DESCRIPTIONS:
                yield line


def _odometry(line: PlayerLine, pose: Pose) -> Odometry:
    if not all(map(math.isfinite, pose)):
        raise UnusableMessageError(BAD_ODOMETRY)
    return Odometry(line.stamp, pose, line.logged)


def _window(found: PlayerSurvey, options: SourceOptions) -> tuple[float, float]:
    """First and last record time in use, s."""
    begin, end = found.devices.first, found.devices.last
    if options.start > end - begin:
        raise UsageError(
            f"start {options.start:g} s lies beyond the end of the recording ({end - begin:.1f} s)"
        )
    start = begin + options.start
    return start, end if options.duration is None else min(end, start + options.duration)


def _info(
    pieces: Sequence[Piece], found: PlayerSurvey, options: SourceOptions, span: tuple[float, float]
) -> RecordingInfo:
    length = found.devices.last - found.devices.first
    share = (span[1] - span[0]) / length if length > 0 else 1.0
    sonar = found.sonar
    return RecordingInfo(
        paths=tuple(str(piece.path) for piece in pieces),
        format="player",
        duration=span[1] - span[0],
        scan_count=-(-round(found.devices.counts[found.laser] * share) // options.every),
        base_from_laser=found.base_from_laser,
        scan_topic=found.laser,
        odom_topic=found.odometry,
        no_echo=found.no_echo.value,
        sonar_ring=sonar.ring,
        sonar_topics=(sonar.device,) if sonar.device else (),
    )
