"""A bag beside a recording, read for its sonars only."""

from collections.abc import Iterator

from glassslam.errors import RecordingError
from glassslam.records import Damage
from glassslam.sources.bag import TF_TYPES, open_bag
from glassslam.sources.bagsonar import plan_sonar
from glassslam.sources.failures import reading
from glassslam.sources.formats import Piece
from glassslam.sources.messages import UNREADABLE, UnusableMessageError
from glassslam.sources.options import SourceOptions
from glassslam.sources.sonarfeed import SonarFeed, SonarRecord
from glassslam.sources.sonarfile import Drop, SonarFile
from glassslam.sources.topics import describe


class BagSonarFile(SonarFile):
    """Sonar topics of a bag; see `SonarFile`.

    Raises
    ------
    RecordingError
        The bag is damaged, or holds no sonar.
    UsageError
        The wishes of the user do not fit it.
    """

    def __init__(self, piece: Piece, options: SourceOptions) -> None:
        self._bag = open_bag(piece, strict=options.strict)
        transforms = [topic for topic in self._bag.topics if topic.msgtype in TF_TYPES]
        with reading(piece.path, piece.format), self._bag.session():
            self._plan = plan_sonar([self._bag], self._bag.topics, transforms, "", options, required=True)
        if not self._plan.names:
            filled = [topic for topic in self._bag.topics if topic.count]
            seconds = (self._bag.end - self._bag.start) / 1e9
            raise RecordingError(
                f"no sonar in {piece.path}", f"recorded: {describe(filled, seconds) or 'nothing'}"
            )
        self.path, self.ring, self.topics = piece.path, self._plan.ring, self._plan.names
        self.points_topics = self._plan.points_names
        self.span = self._bag.start / 1e9, self._bag.end / 1e9
        self.rule, self.warnings = self._plan.rule, self._plan.warnings

    @property
    def damage(self) -> tuple[Damage, ...]:
        """What could not be read so far."""
        return self._bag.damage

    def records(self, drop: Drop) -> Iterator[SonarRecord]:
        """Readings in the order of the file."""
        feed = SonarFeed(self._plan)
        topics = [topic for topic in self._bag.topics if topic.count and self._plan.uses(topic)]
        readers = {topic: (self._bag.decoder(topic.msgtype), feed.reader(topic)) for topic in topics}
        for topic, time, raw in self._bag.messages(topics):
            decode, read = readers[topic]
            try:
                complete = read(decode(raw), time)
            except UnusableMessageError as error:
                drop(str(error))
            except Exception:
                drop(UNREADABLE)
            else:
                yield from complete
        yield from feed.flush()
