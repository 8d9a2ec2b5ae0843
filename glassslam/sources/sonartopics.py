"""Which topics of a bag come from sonars."""

import re
from collections.abc import Sequence

from glassslam.errors import UsageError
from glassslam.sources.bag import CLOUD, CLOUD2, RANGE, RANGE_ARRAY, SONAR_TYPES, TS_SCAN, Topic
from glassslam.sources.options import SourceOptions
from glassslam.sources.topics import describe

_SOUNDS_LIKE_SONAR = re.compile(r"sonar|ultra|toposens", re.IGNORECASE)


def sonar_topics(topics: Sequence[Topic], seconds: float, options: SourceOptions) -> tuple[Topic, ...]:
    """The named topics, or all that may be sonar.

    Without a wish these are all ranges and 3D ultrasonic scans, clouds (which turn out to be sonar when they
    hold few points), and arrays of numbers whose name tells what they are.

    Parameters
    ----------
    topics : sequence of Topic
        All that was recorded.
    seconds : float
        Length of the recording, s, for the rates in messages.
    options : SourceOptions
        The wishes of the user.

    Raises
    ------
    UsageError
        A named topic is missing or of another type.
    """
    if options.without_sonar:
        return ()
    filled = [topic for topic in topics if topic.count > 0]
    candidates = [topic for topic in filled if topic.msgtype in SONAR_TYPES]
    if options.sonar_topics:
        return tuple(_named(wish, filled, candidates, seconds) for wish in options.sonar_topics)
    return tuple(topic for topic in candidates if _may_be_sonar(topic))


def _named(wish: str, topics: Sequence[Topic], candidates: Sequence[Topic], seconds: float) -> Topic:
    named = [topic for topic in topics if topic.name.lstrip("/") == wish.lstrip("/")]
    for topic in named:
        if topic in candidates:
            return topic
    problem = f"is of type {named[0].msgtype}" if named else "is not in the recording"
    listed = describe(candidates, seconds) or "none"
    raise UsageError(f"sonar topic {wish} {problem}; candidates: {listed}")


def _may_be_sonar(topic: Topic) -> bool:
    if topic.msgtype in {RANGE, TS_SCAN, CLOUD, CLOUD2}:
        return True
    return topic.msgtype == RANGE_ARRAY and _SOUNDS_LIKE_SONAR.search(topic.name) is not None


def natural_order(name: str) -> list[tuple[int, str]]:
    """Key that sorts sonar_2 before sonar_10."""
    return [(int(part), "") if part.isdigit() else (-1, part) for part in re.split(r"(\d+)", name)]
