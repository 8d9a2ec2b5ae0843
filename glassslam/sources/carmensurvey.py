"""What must be known of a CARMEN log before its records can be streamed."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from glassslam.errors import NoScansError, UsageError
from glassslam.geometry import between, wrap_angle
from glassslam.records import Damage
from glassslam.sources.bag import Topic
from glassslam.sources.carmenlines import (
    FLASER,
    ODOM,
    ROBOTLASER,
    LaserLine,
    NumberReader,
    Pose,
    parse_laser,
    parse_odom,
)
from glassslam.sources.deadodometry import dead_warning, is_dead
from glassslam.sources.formats import Piece
from glassslam.sources.messages import UnusableMessageError
from glassslam.sources.noecho import NoEcho, detect_no_echo
from glassslam.sources.options import UNUSED, SourceOptions
from glassslam.sources.textlines import TextLog, text_damage
from glassslam.sources.topics import pick_topic

_T = TypeVar("_T")

TAGS = (FLASER, ROBOTLASER, ODOM)

_PREFIXES = {tag: tag.encode() + b" " for tag in TAGS}
_LASER_OFFSET = b"PARAM robot_frontlaser_offset "
_SAMPLES = 256
_RIGID = 1e-3


def carmen_lines(log: TextLog) -> Iterator[tuple[str, bytes]]:
    """Tag and text of the lines that carry sensor data, in file order; other lines have an empty tag.

    Raises
    ------
    RecordingError
        The file cannot be read; or is damaged, and that is not accepted.
    """
    for line in log.lines():
        for tag, prefix in _PREFIXES.items():
            if line.startswith(prefix):
                yield tag, line
                break
        else:
            yield "", line


@dataclass(slots=True)
class TagSamples:
    """Lines of one tag: how many, the outermost, and some from all over the log."""

    count: int = 0
    first: bytes = b""
    last: bytes = b""
    some: list[bytes] = field(default_factory=list)
    _step: int = 1

    def add(self, line: bytes) -> None:
        """Take in the next line; when the samples are full, every other one is given up."""
        if self.count == 0:
            self.first = line
        if self.count % self._step == 0:
            self.some.append(line)
            if len(self.some) == 2 * _SAMPLES:
                self.some, self._step = self.some[::2], 2 * self._step
        self.count += 1
        self.last = line


@dataclass(frozen=True, slots=True)
class CarmenSurvey:
    """Everything decided before streaming.

    Attributes
    ----------
    counts : dict
        Tag -> number of lines.
    laser, odometry : str
        Tags in use; `odometry` equals `laser` when the pose in the laser lines is used, "" for none.
    base_from_laser : tuple of float
        (x, y, yaw), m and rad.
    no_echo : NoEcho
        What a silent beam looks like.
    clock_offset : float
        Added to the logger's time to give the record time, s; NaN: the stamps are the record times.
    begin, end : float
        First and last record time, s.
    warnings : tuple of str
        What a user should know.
    damage : tuple of Damage
        What could not be read.
    """

    counts: dict[str, int]
    laser: str
    odometry: str
    base_from_laser: Pose
    no_echo: NoEcho
    clock_offset: float
    begin: float
    end: float
    warnings: tuple[str, ...]
    damage: tuple[Damage, ...] = ()

    def record_time(self, stamp: float, logged: float) -> float:
        """When a line was written, s; its stamp where the logger kept no time."""
        time = logged + self.clock_offset
        return stamp if math.isnan(time) else time


def survey(pieces: Sequence[Piece], options: SourceOptions) -> CarmenSurvey:
    """Read a log once, quickly, and decide how its lines are used.

    Raises
    ------
    NoScansError, UsageError, RecordingError
        As in `open_recording`.
    """
    samples = {tag: TagSamples() for tag in TAGS}
    offset = 0.0
    logs = [TextLog(piece, strict=options.strict) for piece in pieces]
    for log in logs:
        for tag, line in carmen_lines(log):
            if tag:
                samples[tag].add(line)
            elif line.startswith(_LASER_OFFSET):
                offset = _number(line[len(_LASER_OFFSET) :])
    return _Surveyor(logs, options, samples, offset).run()


def _number(text: bytes) -> float:
    try:
        value = float(text.split()[0])
    except (ValueError, IndexError):
        return 0.0
    return value if math.isfinite(value) else 0.0


class _Surveyor:
    """The steps of `survey` after reading, in which warnings gather."""

    def __init__(
        self, logs: Sequence[TextLog], options: SourceOptions, samples: dict[str, TagSamples], offset: float
    ) -> None:
        self._logs = logs
        self._options = options
        self._samples = samples
        self._offset = offset
        self._reader = NumberReader()
        self._warnings: list[str] = []

    def run(self) -> CarmenSurvey:
        topics = [Topic(tag, f"CARMEN {tag}", s.count) for tag, s in self._samples.items() if s.count]
        times = [time for tag in TAGS for time in self._outer_times(tag)]
        stamps = [stamp for stamp, _ in times]
        seconds = max(stamps) - min(stamps) if stamps else 0.0
        wish = self._options.scan_topic
        kinds = [f"CARMEN {FLASER}", f"CARMEN {ROBOTLASER}"]
        laser = pick_topic("scan", topics, kinds, wish, seconds)
        lines = self._lasers(laser.name) if laser else []
        if laser is None or not lines:
            raise NoScansError(
                f"no usable FLASER or ROBOTLASER1 line in {self._logs[0].piece.path}",
                "".join(gap.reason for log in self._logs for gap in log.gaps[:1]),
            )
        times = times or [(line.stamp, line.logged) for line in lines]  # neither end can be read
        clock = self._clock_offset(times)
        record_times = [stamp if math.isnan(logged + clock) else logged + clock for stamp, logged in times]
        begin, end = min(record_times), max(record_times)
        return CarmenSurvey(
            counts={topic.name: topic.count for topic in topics},
            laser=laser.name,
            odometry=self._odometry(laser.name, lines),
            base_from_laser=self._options.laser_pose or self._base_from_laser(lines),
            no_echo=detect_no_echo(line.ranges for line in lines),
            clock_offset=clock,
            begin=begin,
            end=end,
            warnings=tuple(self._warnings),
            damage=text_damage(self._logs, sum(s.count for s in self._samples.values()), begin, end),
        )

    def _outer_times(self, tag: str) -> list[tuple[float, float]]:
        """(stamp, logger's time) of the first and last line of a tag."""
        samples = self._samples[tag]
        ends = [samples.first, samples.last] if samples.count else []
        if tag == ODOM:
            read = self._readable(ends, lambda line: parse_odom(line, self._reader))
            return [(stamp, logged) for stamp, logged, _ in read]
        return [(line.stamp, line.logged) for line in self._lasers(tag, ends)]

    def _lasers(self, tag: str, lines: Sequence[bytes] | None = None) -> list[LaserLine]:
        chosen = self._samples[tag].some if lines is None else lines
        return self._readable(chosen, lambda line: parse_laser(line, self._reader))

    def _readable(self, lines: Sequence[bytes], parse: Callable[[bytes], _T]) -> list[_T]:
        parsed = []
        for line in lines:
            try:
                parsed.append(parse(line))
            except UnusableMessageError:  # counted when the record is due
                continue
        return parsed

    def _clock_offset(self, times: Sequence[tuple[float, float]]) -> float:
        """From the logger's clock to that of the stamps; NaN when the logger's clock stands or restarts."""
        logged = [time for _, time in times]
        if len(self._logs) > 1 or not all(map(math.isfinite, logged)) or max(logged) <= min(logged):
            return math.nan
        first = min(times, key=lambda pair: pair[1])
        return first[0] - first[1]

    def _odometry(self, laser: str, lines: Sequence[LaserLine]) -> str:
        wish = self._options.odom_topic
        if wish == UNUSED:
            return ""
        has_odom = self._samples[ODOM].count > 0
        known = [laser, ODOM] if has_odom else [laser]
        if wish is not None:
            if wish not in known:
                raise UsageError(f"odom topic {wish} is not in the log; candidates: {', '.join(known)}")
            return wish
        poses = np.array([line.robot_pose for line in lines])
        is_finite = bool(np.all(np.isfinite(poses)))
        if is_finite and np.any(poses != poses[0]):
            return laser
        odom = [pose for _, _, pose in self._readable(self._samples[ODOM].some, self._parse_odom)]
        if any(pose != odom[0] for pose in odom):
            return ODOM
        if is_finite and is_dead([line.robot_pose for line in lines], lambda: lines):
            self._warnings.append(dead_warning(f"the odometry in {laser} lines"))
            return ""
        return laser if is_finite or has_odom else ""

    def _parse_odom(self, line: bytes) -> tuple[float, float, Pose]:
        return parse_odom(line, self._reader)

    def _base_from_laser(self, lines: Sequence[LaserLine]) -> Pose:
        """The mount of the laser: the two poses in each line, where they differ by a fixed amount."""
        with np.errstate(invalid="ignore", over="ignore"):
            mount = between(
                np.array([line.robot_pose for line in lines]), np.array([line.laser_pose for line in lines])
            )
        mount = mount[np.all(np.isfinite(mount), axis=1)]
        spread = mount - mount[:1]
        spread[:, 2] = wrap_angle(spread[:, 2])
        if mount.size and np.abs(spread).max() > _RIGID:
            self._warnings.append(
                "the laser pose in the log is no fixed mount (a corrected log?): the laser is taken to sit at"
                " the base (--laser-pose x,y,yaw says otherwise)"
            )
            return 0.0, 0.0, 0.0
        if mount.size == 0 or np.abs(mount[0]).max() < _RIGID:
            return self._offset, 0.0, 0.0
        x, y, yaw = mount[0].tolist()
        return x, y, yaw
