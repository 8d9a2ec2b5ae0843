"""Which topics are used: the only candidate, or the one the user names."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from glassslam.errors import NoScansError, UsageError
from glassslam.sources.bag import IMU, ODOMETRY, SCAN_TYPES, TF_TYPES, Topic
from glassslam.sources.options import UNUSED, SourceOptions

TF = "tf"


@dataclass(frozen=True, slots=True)
class Choice:
    """The topics of a recording that are used.

    Attributes
    ----------
    scan : Topic
        Laser scans.
    odometry, imu : Topic or None
        None when there is none, or it is switched off; odometry may still come from tf.
    transforms : tuple of Topic
        All tf topics, static or not.
    odometry_from_tf : str or None
        "tf": find the odometry among the transforms; "tf:PARENT->CHILD": this one; "": if there is one;
        None: odometry comes from a topic or is switched off.
    """

    scan: Topic
    odometry: Topic | None
    imu: Topic | None
    transforms: tuple[Topic, ...]
    odometry_from_tf: str | None


def choose_topics(topics: Sequence[Topic], seconds: float, options: SourceOptions, path: Path) -> Choice:
    """Decide which topics of a recording of some length are used.

    Parameters
    ----------
    topics : sequence of Topic
        All that was recorded.
    seconds : float
        Length of the recording, s, for the rates in messages.
    options : SourceOptions
        The wishes of the user.
    path : Path
        The recording, for messages.

    Raises
    ------
    NoScansError
        There is no laser scan at all.
    UsageError
        Several candidates, or a named topic that is missing or of another type.
    """
    filled = [topic for topic in topics if topic.count > 0]
    scan = pick_topic("scan", filled, SCAN_TYPES, options.scan_topic, seconds)
    if scan is None:
        raise NoScansError(f"no laser scan in {path}", f"recorded: {describe(filled, seconds) or 'nothing'}")
    wish = options.odom_topic
    by_tf = wish is not None and (wish == TF or wish.startswith(f"{TF}:"))
    odometry = None if by_tf or wish == UNUSED else pick_topic("odom", filled, (ODOMETRY,), wish, seconds)
    imu_wish = options.imu_topic
    imu = None if imu_wish == UNUSED else pick_topic("imu", filled, (IMU,), imu_wish, seconds)
    transforms = tuple(topic for topic in filled if topic.msgtype in TF_TYPES)
    if by_tf:
        return Choice(scan, None, imu, transforms, wish)
    return Choice(scan, odometry, imu, transforms, None if odometry or wish == UNUSED else "")


def pick_topic(
    role: str, topics: Sequence[Topic], types: Sequence[str], wish: str | None, seconds: float
) -> Topic | None:
    """The only topic of some types, or the wished one; None when there is no such topic at all.

    Parameters
    ----------
    role : str
        "scan", "odom" or "imu", as in the option that names the topic.
    topics : sequence of Topic
        All that were recorded.
    types : sequence of str
        Message types that will do.
    wish : str or None
        The name given by the user.
    seconds : float
        Length of the recording, s, for the rates in messages.

    Raises
    ------
    UsageError
        Several candidates without a wish, or a wish that is missing or of another type.
    """
    candidates = [topic for topic in topics if topic.msgtype in types]
    if not candidates and (wish is None or role == "scan"):
        return None
    if wish is None:
        if len(candidates) > 1:
            raise UsageError(
                f"several {role} topics: {describe(candidates, seconds)}", f"choose one with --{role}-topic"
            )
        return candidates[0]
    named = [topic for topic in topics if topic.name.lstrip("/") == wish.lstrip("/")]
    for topic in named:
        if topic in candidates:
            return topic
    problem = f"is of type {named[0].msgtype}" if named else "is not in the recording"
    listed = describe(candidates, seconds) or "none"
    raise UsageError(f"{role} topic {wish} {problem}; candidates: {listed}")


def describe(topics: Sequence[Topic], seconds: float) -> str:
    """Name, type, count and rate of topics, in one line."""
    return ", ".join(
        f"{topic.name} ({topic.msgtype}, {topic.count} messages, {rate(topic, seconds):.1f} Hz)"
        for topic in topics
    )


def rate(topic: Topic, seconds: float) -> float:
    """Messages of a topic per second of the recording, Hz; 0 when it has no length."""
    return topic.count / seconds if seconds > 0 else 0.0
