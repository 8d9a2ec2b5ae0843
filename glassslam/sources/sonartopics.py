"""Which topics of a bag come from sonars."""

import re
from collections.abc import Sequence

from glassslam.errors import UsageError
from glassslam.sources.bag import CLOUD, CLOUD2, RANGE, RANGE_ARRAY, SONAR_TYPES, TS_SCAN, Topic
from glassslam.sources.options import SourceOptions
from glassslam.sources.sonarfeed import POINTS_OF
from glassslam.sources.topics import describe

# few points a message come from radars and clusters of lidars as well
_OTHER_SENSOR = re.compile(r"radar|lidar|laser|camera|depth", re.IGNORECASE)
_SOUNDS_LIKE_SONAR = re.compile(r"sonar|ultra|toposens", re.IGNORECASE)


def sonar_topics(topics: Sequence[Topic], seconds: float, options: SourceOptions) -> tuple[Topic, ...]:
    """The named topics, or all that may be sonar; and those named as points.

    Without a wish the former are all ranges and 3D ultrasonic scans, clouds (which turn out to be sonar when
    they hold few points, unless their name tells of another sensor), and arrays of numbers whose name tells
    what they are.

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
    filled = [topic for topic in topics if topic.count > 0]
    clouds = [topic for topic in filled if topic.msgtype in POINTS_OF]
    points = [_named("points", wish, filled, clouds, seconds) for wish in options.points_topics]
    return tuple(dict.fromkeys((*_sonars(filled, seconds, options), *points)))


def is_named(topic: Topic, wishes: Sequence[str]) -> bool:
    """Whether a topic is one of those a user names; a leading slash does not matter."""
    return topic.name.lstrip("/") in {wish.lstrip("/") for wish in wishes}


def _sonars(filled: Sequence[Topic], seconds: float, options: SourceOptions) -> list[Topic]:
    if options.without_sonar:
        return []
    candidates = [topic for topic in filled if topic.msgtype in SONAR_TYPES]
    if options.sonar_topics:
        return [_named("sonar", wish, filled, candidates, seconds) for wish in options.sonar_topics]
    return [topic for topic in candidates if _may_be_sonar(topic)]


def _named(
    role: str, wish: str, topics: Sequence[Topic], candidates: Sequence[Topic], seconds: float
) -> Topic:
    named = [topic for topic in topics if is_named(topic, [wish])]
    for topic in named:
        if topic in candidates:
            return topic
    problem = f"is of type {named[0].msgtype}" if named else "is not in the recording"
    listed = describe(candidates, seconds) or "none"
    raise UsageError(f"{role} topic {wish} {problem}; candidates: {listed}")


def _may_be_sonar(topic: Topic) -> bool:
    sounds = _SOUNDS_LIKE_SONAR.search(topic.name) is not None
    if topic.msgtype in {CLOUD, CLOUD2}:
        return sounds or _OTHER_SENSOR.search(topic.name) is None
    if topic.msgtype in {RANGE, TS_SCAN}:
        return True
    return topic.msgtype == RANGE_ARRAY and sounds


def natural_order(name: str) -> list[tuple[int, str]]:
    """Key that sorts sonar_2 before sonar_10."""
    return [(int(part), "") if part.isdigit() else (-1, part) for part in re.split(r"(\d+)", name)]
