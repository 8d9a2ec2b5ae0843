"""Sonar readings of a second file beside a recording."""

import itertools
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

from glassslam.errors import RecordingError, UsageError
from glassslam.records import Damage, Record, SonarRing
from glassslam.sources.formats import Piece, resolve
from glassslam.sources.options import SourceOptions
from glassslam.sources.recording import Recording
from glassslam.sources.sonarfeed import SonarRecord
from glassslam.sources.sweeps import SweepRule

KNOWN_SONAR = "sonar is read from ROS bags, mcap, Player logs and the text logs of pi-map"

Drop = Callable[[str], None]


class SonarFile(ABC):
    """An opened file of sonar readings.

    Attributes
    ----------
    path : Path
        The file.
    ring : SonarRing or None
        Where the sonars of the ring sit; None when the file holds points of a 3D sensor only.
    topics : tuple of str
        What is read.
    points_topics : tuple of str
        Those of 3D sensors among them.
    span : tuple of float
        Record times of the first and the last reading, s.
    rule : SweepRule or None
        How the ranges of the ring are read.
    warnings : tuple of str
        What a user should know.
    """

    path: Path
    ring: SonarRing | None
    topics: tuple[str, ...]
    span: tuple[float, float]
    points_topics: tuple[str, ...] = ()
    rule: SweepRule | None = None
    warnings: tuple[str, ...] = ()

    @property
    def damage(self) -> tuple[Damage, ...]:
        """What could not be read so far."""
        return ()

    @abstractmethod
    def records(self, drop: Drop) -> Iterator[SonarRecord]:
        """Readings in the order of the file; `drop` is told why a message cannot become one."""


def open_sonar(path: str | Path, options: SourceOptions) -> SonarFile:
    """Open a file of sonar readings of any format.

    Raises
    ------
    RecordingError
        The file is missing, damaged or of an unknown format, or holds no sonar.
    UsageError
        The wishes of the user do not fit it.
    """
    piece = _piece(path)
    if piece.format == "pimap":
        from glassslam.sources.pimapsonar import PimapSonarFile  # noqa: PLC0415

        return PimapSonarFile(piece.path, options)
    if piece.format == "player":
        from glassslam.sources.playersonar import PlayerSonarFile  # noqa: PLC0415  (loads kernels)

        return PlayerSonarFile(piece, options)
    from glassslam.sources.bagsonarfile import BagSonarFile  # noqa: PLC0415  (loads rosbags)

    return BagSonarFile(piece, options)


def _piece(path: str | Path) -> Piece:
    try:
        pieces = resolve([path])
    except RecordingError as error:
        foreign = error.message.endswith("is no recording known here")
        raise RecordingError(error.message, KNOWN_SONAR if foreign else error.hint) from error
    if pieces[0].format == "carmen":
        raise RecordingError(f"{path} is a CARMEN log, which holds no sonar", KNOWN_SONAR)
    if len(pieces) > 1:
        raise UsageError(f"{path} holds {len(pieces)} recordings", "name one of the files")
    return pieces[0]


def with_sonar(recording: Recording, options: SourceOptions) -> Recording:
    """A recording with the readings of the file `options.sonar` merged in.

    Raises
    ------
    RecordingError
        The file cannot be read, or no reading falls into the time of the recording.
    UsageError
        The wishes of the user do not fit it.
    """
    if options.sonar is None:
        return recording
    sonar = open_sonar(options.sonar, options)
    begin, end = recording.span
    if sonar.span[1] < begin or sonar.span[0] > end:
        gap = max(begin - sonar.span[1], sonar.span[0] - end)
        raise RecordingError(
            f"{sonar.path} and the recording do not overlap in time ({gap:.1f} s apart)",
            "both must be recorded at the same time, on the same clock",
        )
    return MergedRecording(recording, sonar)


class MergedRecording(Recording):
    """A recording and a file of sonar readings as one stream.

    Records of the recording come exactly as they would alone; a reading comes before the first of them that
    was recorded later.

    Parameters
    ----------
    inner : Recording
        Scans and odometry.
    sonar : SonarFile
        Sonar readings.
    """

    def __init__(self, inner: Recording, sonar: SonarFile) -> None:
        info = replace(
            inner.info, sonar_ring=sonar.ring, sonar_topics=sonar.topics, points_topics=sonar.points_topics
        )
        super().__init__(info, (*inner.warnings, *sonar.warnings), inner.span, sonar.rule)
        inner.warnings, inner.dropped = self.warnings, self.dropped
        self._inner, self._sonar = inner, sonar

    @property
    def damage(self) -> tuple[Damage, ...]:
        """What could not be read of both so far."""
        return (*self._inner.damage, *self._sonar.damage)

    def _stream(self) -> Iterator[Record]:
        inner = self._inner.records()
        # The inner recording empties the common counts when it starts: nothing may be dropped before.
        first = next(inner, None)
        readings = self._readings()
        waiting = next(readings, None)
        for record in itertools.chain([] if first is None else [first], inner):
            while waiting is not None and waiting.record_stamp <= record.record_stamp:
                yield waiting
                waiting = next(readings, None)
            yield record
        while waiting is not None:
            yield waiting
            waiting = next(readings, None)

    def _readings(self) -> Iterator[SonarRecord]:
        begin, end = self.span
        for reading in self._sonar.records(self._drop):
            if begin <= reading.record_stamp <= end:
                yield reading
