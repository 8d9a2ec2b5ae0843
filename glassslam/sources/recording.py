"""A recording: what is known of it, and the stream of its records."""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from glassslam.errors import NoScansError
from glassslam.records import Damage, LaserScan, Record, RecordingInfo
from glassslam.sources.formats import Piece, resolve
from glassslam.sources.options import UNUSED, SourceOptions
from glassslam.sources.sweeps import SweepRule


class Recording(ABC):
    """An opened recording.

    Attributes
    ----------
    info : RecordingInfo
        What is known before reading.
    dropped : dict
        Reason -> number of messages that could not become records; filled while iterating.
    warnings : list of str
        What a user should know, one line each; grows while iterating.
    span : tuple of float
        Record times of the beginning and the end of the part in use, s.
    sonar_rule : SweepRule or None
        How the ranges of the ring of sonars are read; None without a ring.
    """

    def __init__(
        self,
        info: RecordingInfo,
        warnings: Sequence[str] = (),
        span: tuple[float, float] = (-math.inf, math.inf),
        sonar_rule: SweepRule | None = None,
    ) -> None:
        self.info = info
        self.span = span
        self.sonar_rule = sonar_rule
        self.dropped: dict[str, int] = {}
        self.warnings: list[str] = list(warnings)

    @property
    def damage(self) -> tuple[Damage, ...]:
        """What could not be read so far: what opening has shown, and what iterating adds."""
        return ()

    def records(self) -> Iterator[Record]:
        """Stream the records in the order of the recording; each call starts anew.

        Yields
        ------
        LaserScan, Odometry, Imu, RangeRing or PointSet
            Never sorted by header stamps: what was recorded first comes first.

        Raises
        ------
        NoScansError
            The end was reached without a single usable scan.
        RecordingError
            The file is damaged, and `SourceOptions.strict` was said or nothing more can be read.
        """
        self.dropped.clear()
        scans = 0
        for record in self._stream():
            scans += isinstance(record, LaserScan)
            yield record
        if scans == 0:
            reasons = ", ".join(f"{count} x {reason}" for reason, count in self.dropped.items())
            raise NoScansError(
                f"no usable scan of {self.info.scan_topic} in {', '.join(self.info.paths)}",
                f"dropped: {reasons}" if reasons else "the chosen part of the recording holds none",
            )

    @abstractmethod
    def _stream(self) -> Iterator[Record]:
        """The records, unguarded."""

    def _drop(self, reason: str) -> None:
        self.dropped[reason] = self.dropped.get(reason, 0) + 1

    def _warn(self, text: str) -> None:
        if text not in self.warnings:
            self.warnings.append(text)


def open_recording(
    paths: str | Path | Sequence[str | Path], options: SourceOptions | None = None
) -> Recording:
    """Open a recording of any format; several paths are consecutive pieces of one.

    Parameters
    ----------
    paths : path or sequence of paths
        ROS1 bags, ROS2 bags (file or directory), CARMEN or Player logs, told by their content.
    options : SourceOptions, optional
        Topics, part and echo to use; a second file with sonar readings.

    Raises
    ------
    RecordingError
        A file is missing, empty or foreign; or damaged, and nothing is readable or `strict` was said.
    NoScansError
        There is no laser scan in it.
    UsageError
        Topics are ambiguous, or a named one is missing or of another type.
    """
    named = [paths] if isinstance(paths, str | Path) else list(paths)
    pieces = resolve(named)
    chosen = SourceOptions() if options is None else options
    if chosen.sonar is None:
        return _open(pieces, chosen)
    from glassslam.sources.sonarfile import with_sonar  # noqa: PLC0415  (it builds on this module)

    # What the user says of sonar is then said of the second file.
    alone = replace(chosen, sonar=None, sonar_topic=UNUSED, sonar_ring=None, points_topic=None)
    return with_sonar(_open(pieces, alone), chosen)


def _open(pieces: Sequence[Piece], options: SourceOptions) -> Recording:
    if pieces[0].format == "pimap":
        raise NoScansError(
            f"{pieces[0].path} holds no laser scans", "name the recording, and this file with --sonar"
        )
    if pieces[0].format == "carmen":
        from glassslam.sources.carmen import open_carmen  # noqa: PLC0415  (loads kernels)

        return open_carmen(pieces, options)
    if pieces[0].format == "player":
        from glassslam.sources.player import open_player  # noqa: PLC0415  (loads kernels)

        return open_player(pieces, options)
    from glassslam.sources.bagrecording import open_bags  # noqa: PLC0415  (loads rosbags)

    return open_bags(pieces, options)
