"""What a Player log tells of its devices, gathered line by line."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from glassslam.geometry import compose
from glassslam.records import Float32Array, FloatArray
from glassslam.sources.carmenlines import NumberReader
from glassslam.sources.messages import UnusableMessageError
from glassslam.sources.playerlines import PlayerLine, split_line
from glassslam.sources.playervalues import (
    PlayerScan,
    Pose,
    parse_configuration,
    parse_elements,
    parse_pose,
    parse_ranges,
    parse_scan,
    parse_sonar,
    scan_of_ranger,
)
from glassslam.sources.textlines import TextLog

_SAMPLES = 256
_SWEEPS = 4000
# A ranger with more elements than any ring of sonars is a laser.
_LASER_BEAMS = 40


def player_lines(log: TextLog) -> Iterator[PlayerLine | str | None]:
    """Lines in file order: read so far, None for those without use, or why they cannot be read.

    Raises
    ------
    RecordingError
        The file cannot be read; or is damaged, and that is not accepted.
    """
    for line in log.lines():
        try:
            yield split_line(line)
        except UnusableMessageError as error:
            yield str(error)


@dataclass(slots=True)
class PlayerDevices:
    """Devices of a log.

    Attributes
    ----------
    counts : Counter
        Device -> lines of data.
    scans : dict
        Laser -> some of its scans, from all over the log.
    sweeps : dict
        Sonar -> times (s) and ranges of its first sweeps.
    geometry : dict
        Laser -> pose on the robot.
    rings : dict
        Sonar -> poses of its elements on the robot, shape (n, 3).
    configuration : dict
        Ranger -> angles and limits.
    first, last : float
        Times of the outermost lines of data, s.
    poses_with_scans : bool
        Whether scans carry the pose of the robot.
    """

    counts: Counter[str] = field(default_factory=Counter)
    scans: dict[str, list[PlayerScan]] = field(default_factory=dict)
    sweeps: dict[str, list[tuple[float, Float32Array]]] = field(default_factory=dict)
    geometry: dict[str, Pose] = field(default_factory=dict)
    rings: dict[str, FloatArray] = field(default_factory=dict)
    configuration: dict[str, FloatArray] = field(default_factory=dict)
    first: float = np.inf
    last: float = -np.inf
    poses_with_scans: bool = False
    _steps: dict[str, int] = field(default_factory=dict)
    _reader: NumberReader = field(default_factory=NumberReader)

    def add(self, line: PlayerLine) -> None:
        """Take in the next line; one that cannot be read is left out here and counted when it is due."""
        try:
            self._add(line)
        except UnusableMessageError:
            return

    def _add(self, line: PlayerLine) -> None:
        if line.kind == "laser geometry":
            self._add_mount(line.device, parse_pose(line, self._reader))
            return
        if line.kind == "ranger geometry":
            pose, elements = parse_elements(line, self._reader)
            self._add_mount(line.device, pose)
            self.rings[line.device] = compose(np.array(pose), elements)
            return
        if line.kind == "ranger configuration":
            self.configuration[line.device] = parse_configuration(line, self._reader)
            return
        if line.kind in {"sweep", "ring", "ring and sweep"}:
            self._add_sonar(line)
        elif line.kind in {"scan", "scan with pose"}:
            self._sample(line)
        elif line.kind == "ranges":
            self._add_ranges(line)
        if line.kind != "ring":
            self.counts[line.device] += 1
            self.first, self.last = min(self.first, line.logged), max(self.last, line.logged)

    def _add_mount(self, device: str, pose: Pose) -> None:
        if np.all(np.isfinite(pose)):
            self.geometry[device] = pose

    def _add_sonar(self, line: PlayerLine) -> None:
        poses, ranges = parse_sonar(line, self._reader)
        if poses is not None and len(poses) and np.all(np.isfinite(poses)):
            self.rings.setdefault(line.device, poses)
        if ranges is not None:
            self._add_sweep(line, ranges)

    def _add_sweep(self, line: PlayerLine, ranges: Float32Array) -> None:
        sweeps = self.sweeps.setdefault(line.device, [])
        if len(sweeps) < _SWEEPS:
            sweeps.append((line.stamp, ranges))

    def _add_ranges(self, line: PlayerLine) -> None:
        ranges, rest = parse_ranges(line, self._reader)
        if is_sonar_size(ranges):
            self._add_sweep(line, ranges)
            return
        if rest.size >= 7 and line.device not in self.configuration:
            # The configuration stands at the end of the line, resolution of the range and rate last.
            self.configuration[line.device] = rest[-7:-2].copy()
        if line.device in self.configuration:
            self._sample(line)

    def _sample(self, line: PlayerLine) -> None:
        """Keep a scan now and then; when there are too many, every other one is given up."""
        scans, step = self.scans.setdefault(line.device, []), self._steps.get(line.device, 1)
        if self.counts[line.device] % step == 0:
            scans.append(self.scan(line, self._reader))
            self.poses_with_scans = self.poses_with_scans or scans[-1].robot_pose is not None
            if len(scans) == 2 * _SAMPLES:
                self.scans[line.device], self._steps[line.device] = scans[::2], 2 * step

    def scan(self, line: PlayerLine, reader: NumberReader) -> PlayerScan:
        """A scan of a laser, or of a ranger whose configuration is known.

        Raises
        ------
        UnusableMessageError
            The line is cut off or its geometry makes no sense.
        """
        if line.kind == "ranges":
            return scan_of_ranger(parse_ranges(line, reader)[0], self.configuration[line.device])
        return parse_scan(line, reader)


def is_sonar_size(ranges: Float32Array) -> bool:
    """Whether a ranger with so many ranges is a ring of sonars."""
    return len(ranges) < _LASER_BEAMS
