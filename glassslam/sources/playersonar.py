"""A Player log beside a recording, read for its sonars only."""

from collections.abc import Iterator

from glassslam.errors import RecordingError
from glassslam.records import Damage, RangeRing
from glassslam.sources.carmenlines import NumberReader
from glassslam.sources.formats import Piece
from glassslam.sources.messages import UnusableMessageError
from glassslam.sources.options import SourceOptions
from glassslam.sources.player import RingReader
from glassslam.sources.playerdevices import player_lines
from glassslam.sources.playersurvey import choose_sonar, gather_devices
from glassslam.sources.sonarfile import Drop, SonarFile
from glassslam.sources.textlines import TextLog


class PlayerSonarFile(SonarFile):
    """The ring of a Player log; see `SonarFile`.

    Raises
    ------
    RecordingError
        The log is damaged, or holds no sonar.
    UsageError
        The wishes of the user do not fit it.
    """

    def __init__(self, piece: Piece, options: SourceOptions) -> None:
        devices, self._damage = gather_devices([piece], strict=options.strict)
        self._sonar = choose_sonar(devices, options, max(0.0, devices.last - devices.first))
        if not self._sonar.device:
            raise RecordingError(f"no sonar in {piece.path}", "name a log with sonar or ranger lines")
        self._piece = piece
        self.path, self.ring, self.topics = piece.path, self._sonar.ring, (self._sonar.device,)
        self.rule, self.span = self._sonar.rule, (devices.first, devices.last)

    @property
    def damage(self) -> tuple[Damage, ...]:
        """What could not be read."""
        return self._damage

    def records(self, drop: Drop) -> Iterator[RangeRing]:
        """Sweeps in the order of the file."""
        reader, ring = NumberReader(), RingReader(self._sonar)
        for line in player_lines(TextLog(self._piece)):
            if isinstance(line, str):
                drop(line)
                continue
            if line is None or line.device != self._sonar.device:
                continue
            try:
                yield from ring.read(line, reader)
            except UnusableMessageError as error:
                drop(str(error))
