"""A recording: what is known of it, and the stream of its records."""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from pathlib import Path

from glassslam.errors import NoScansError
from glassslam.records import LaserScan, Record, RecordingInfo
from glassslam.sources.formats import resolve
from glassslam.sources.options import SourceOptions


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
    """

    def __init__(self, info: RecordingInfo, warnings: Sequence[str] = ()) -> None:
        self.info = info
        self.dropped: dict[str, int] = {}
        self.warnings: list[str] = list(warnings)

    def records(self) -> Iterator[Record]:
        """Stream the records in the order of the recording; each call starts anew.

        Yields
        ------
        LaserScan, Odometry or Imu
            Never sorted by header stamps: what was recorded first comes first.

        Raises
        ------
        NoScansError
            The end was reached without a single usable scan.
        RecordingError
            The file is damaged.
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
        ROS1 bags, ROS2 bags (file or directory) or CARMEN logs, told by their content.
    options : SourceOptions, optional
        Topics, part and echo to use.

    Raises
    ------
    RecordingError
        A file is missing, empty, foreign, truncated or damaged.
    NoScansError
        There is no laser scan in it.
    UsageError
        Topics are ambiguous, or a named one is missing or of another type.
    """
    named = [paths] if isinstance(paths, str | Path) else list(paths)
    pieces = resolve(named)
    chosen = SourceOptions() if options is None else options
    if pieces[0].format == "carmen":
        from glassslam.sources.carmen import open_carmen  # noqa: PLC0415  (loads kernels)

        return open_carmen(pieces, chosen)
    from glassslam.sources.bagrecording import open_bags  # noqa: PLC0415  (loads rosbags)

    return open_bags(pieces, chosen)
