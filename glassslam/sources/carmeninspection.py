"""CARMEN logs looked over."""

from collections.abc import Sequence

from glassslam.errors import NoScansError
from glassslam.records import LaserScan, Odometry
from glassslam.sources.carmenlines import (
    FLASER,
    ODOM,
    ROBOTLASER,
    LaserLine,
    NumberReader,
    parse_laser,
    parse_odom,
)
from glassslam.sources.carmensurvey import TAGS, carmen_lines
from glassslam.sources.formats import Piece
from glassslam.sources.messages import UnusableMessageError
from glassslam.sources.observers import OdometryObserver, ScanObserver, gather
from glassslam.sources.report import Plan, RecordingReport, TopicReport
from glassslam.sources.textlines import TextLog, text_damage


class _CarmenInspection:
    """One pass over the lines, with an observer for each tag."""

    def __init__(self) -> None:
        self.counts = dict.fromkeys(TAGS, 0)
        self.scans = {tag: ScanObserver(tag) for tag in (FLASER, ROBOTLASER)}
        self.odometry = {tag: OdometryObserver(tag) for tag in TAGS}
        self.dropped: dict[str, int] = {}
        self.first, self.last = float("inf"), float("-inf")
        self._reader = NumberReader()

    def add(self, tag: str, line: bytes) -> None:
        """Take in the next line."""
        self.counts[tag] += 1
        try:
            if tag == ODOM:
                stamp, _, pose = parse_odom(line, self._reader)
                self.odometry[tag].add(Odometry(stamp, pose, stamp))
            else:
                laser = parse_laser(line, self._reader)
                stamp = laser.stamp
                self.odometry[tag].add(Odometry(stamp, laser.robot_pose, stamp))
                self.scans[tag].add(_scan(laser))
        except UnusableMessageError as error:
            reason = f"{tag}: {error}"
            self.dropped[reason] = self.dropped.get(reason, 0) + 1
        else:
            self.first, self.last = min(self.first, stamp), max(self.last, stamp)


def inspect_carmen(pieces: Sequence[Piece], plan: Plan, warnings: tuple[str, ...]) -> RecordingReport:
    """Read logs that are pieces of one recording, and report.

    Raises
    ------
    NoScansError
        No line could be read.
    RecordingError
        A file cannot be read.
    """
    seen = _CarmenInspection()
    logs = [TextLog(piece) for piece in pieces]
    for log in logs:
        for tag, line in carmen_lines(log):
            if tag:
                seen.add(tag, line)
    if seen.first > seen.last:
        raise NoScansError(f"no usable line in {pieces[0].path}", plan.problem)
    seconds = seen.last - seen.first
    return RecordingReport(
        paths=tuple(str(piece.path) for piece in pieces),
        format="carmen",
        size=sum(piece.path.stat().st_size for piece in pieces),
        begin=seen.first,
        duration=seconds,
        topics=tuple(
            TopicReport(tag, "CARMEN line", count, count / seconds if seconds > 0 else 0.0)
            for tag, count in seen.counts.items()
            if count
        ),
        scans=gather(observer.report() for observer in seen.scans.values()),
        odometry=gather(observer.report() for observer in seen.odometry.values()),
        imus=(),
        transforms=(),
        plan=plan,
        dropped=seen.dropped,
        warnings=warnings,
        damage=text_damage(logs, sum(seen.counts.values()), seen.first, seen.last),
    )


def _scan(line: LaserLine) -> LaserScan:
    return LaserScan(
        stamp=line.stamp,
        ranges=line.ranges,
        angle_min=line.angle_min,
        angle_increment=line.angle_increment,
        range_min=0.0,
        range_max=line.range_max,
        intensities=line.intensities,
        record_stamp=line.stamp,
    )
