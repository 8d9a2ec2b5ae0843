"""Player logs looked over."""

import math
from collections.abc import Sequence

from glassslam.errors import NoScansError
from glassslam.records import LaserScan, Odometry
from glassslam.sources.carmenlines import NumberReader
from glassslam.sources.formats import Piece
from glassslam.sources.messages import UnusableMessageError
from glassslam.sources.observers import OdometryObserver, ScanObserver, gather
from glassslam.sources.playerdevices import PlayerDevices, player_lines
from glassslam.sources.playerlines import PlayerLine
from glassslam.sources.playersurvey import gather_devices
from glassslam.sources.playervalues import Pose, parse_pose
from glassslam.sources.report import Plan, RecordingReport, TopicReport
from glassslam.sources.textlines import TextLog


class _PlayerInspection:
    """One pass over the lines, with an observer for each device."""

    def __init__(self, devices: PlayerDevices) -> None:
        self.scans: dict[str, ScanObserver] = {}
        self.odometry: dict[str, OdometryObserver] = {}
        self.dropped: dict[str, int] = {}
        self._devices = devices
        self._reader = NumberReader()

    def add(self, line: PlayerLine | str | None) -> None:
        """Take in the next line."""
        if isinstance(line, str):
            self._drop(line)
        elif line is not None:
            try:
                self._add(line)
            except UnusableMessageError as error:
                self._drop(f"{line.device}: {error}")

    def _drop(self, reason: str) -> None:
        self.dropped[reason] = self.dropped.get(reason, 0) + 1

    def _add(self, line: PlayerLine) -> None:
        name = line.device
        if line.kind == "pose":
            pose = parse_pose(line, self._reader)
            self.odometry.setdefault(name, OdometryObserver(name)).add(
                Odometry(line.stamp, pose, line.logged)
            )
        elif line.kind in {"scan", "scan with pose"} or (
            line.kind == "ranges" and name in self._devices.scans
        ):
            scan = self._devices.scan(line, self._reader)
            record = LaserScan(
                stamp=line.stamp,
                ranges=scan.ranges,
                angle_min=scan.angle_min,
                angle_increment=scan.angle_increment,
                range_min=0.0,
                range_max=scan.range_max,
                intensities=scan.intensities,
                record_stamp=line.logged,
            )
            self.scans.setdefault(name, ScanObserver(name)).add(record)
            if scan.robot_pose is not None:
                self._add_pose(line, scan.robot_pose)

    def _add_pose(self, line: PlayerLine, pose: Pose) -> None:
        observer = self.odometry.setdefault(line.device, OdometryObserver(line.device))
        observer.add(Odometry(line.stamp, pose, line.logged))


def inspect_player(pieces: Sequence[Piece], plan: Plan, warnings: tuple[str, ...]) -> RecordingReport:
    """Read logs that are pieces of one recording, and report.

    Raises
    ------
    NoScansError
        No line could be read.
    RecordingError
        A file cannot be read.
    """
    devices, damage = gather_devices(pieces)
    if math.isinf(devices.first):
        raise NoScansError(f"no usable line in {pieces[0].path}", plan.problem)
    seen = _PlayerInspection(devices)
    for piece in pieces:
        for line in player_lines(TextLog(piece)):
            seen.add(line)
    seconds = devices.last - devices.first
    return RecordingReport(
        paths=tuple(str(piece.path) for piece in pieces),
        format="player",
        size=sum(piece.path.stat().st_size for piece in pieces),
        begin=devices.first,
        duration=seconds,
        topics=tuple(
            TopicReport(name, "Player line", count, count / seconds if seconds > 0 else 0.0)
            for name, count in devices.counts.items()
        ),
        scans=gather(observer.report() for observer in seen.scans.values()),
        odometry=gather(observer.report() for observer in seen.odometry.values()),
        imus=(),
        transforms=(),
        plan=plan,
        dropped=seen.dropped,
        warnings=warnings,
        damage=damage,
    )
