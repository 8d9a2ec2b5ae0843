"""Stretches of sonar messages from all over a bag: what is decided before streaming is decided by them."""

import itertools
from collections.abc import Callable, Sequence
from contextlib import closing
from typing import Any, TypeAlias

import numpy as np

from glassslam.records import Float32Array, FloatArray, SonarRing
from glassslam.sources.bag import Bag, Topic
from glassslam.sources.ringgeometry import ring_ranges
from glassslam.sources.sonarfeed import POINTS_OF
from glassslam.sources.sweeps import Series

Stretch: TypeAlias = tuple[FloatArray, list[Any]]
"""Record times (s) of consecutive messages, and what was read of each."""


_WINDOWS = 8
_MESSAGES_PER_WINDOW = 120


def as_it_is(message: Any) -> Any:
    """The message itself."""
    return message


def framed_points(topic: Topic, message: Any) -> tuple[str, Float32Array]:
    """Frame and points of a cloud, m.

    Raises
    ------
    UnusableMessageError
        It has no coordinates.
    """
    return message.header.frame_id, POINTS_OF[topic.msgtype](message)


def stretches(bags: Sequence[Bag], topic: Topic, read: Callable[[Any], Any] = as_it_is) -> list[Stretch]:
    """What is read of consecutive messages of a topic in several places of each bag."""
    found = []
    for bag in bags:
        length = (bag.end - bag.start) / _WINDOWS
        for k in range(_WINDOWS):
            start = bag.start + round(k * length)
            found.append(stretch(bag, topic, start, start + round(length) + 1, _MESSAGES_PER_WINDOW, read))
    return [(times, messages) for times, messages in found if messages]


def stretch(
    bag: Bag, topic: Topic, start: int, stop: int, count: int, read: Callable[[Any], Any] = as_it_is
) -> Stretch:
    """Record times (s) of consecutive messages, and what is read of them; unreadable ones are left out."""
    found = next((t for t in bag.topics if (t.name, t.msgtype) == (topic.name, topic.msgtype)), None)
    if found is None:
        return np.empty(0), []
    decode = bag.decoder(topic.msgtype)
    times, decoded = [], []
    with closing(bag.messages([found], start, stop)) as messages:
        for _, time, raw in itertools.islice(messages, count):
            try:
                decoded.append(read(decode(raw)))
            except Exception:  # noqa: S112  (counted when the record is due)
                continue
            times.append(time / 1e9)
    return np.array(times), decoded


def cloud_series(found: Sequence[Stretch], ring: SonarRing) -> list[Series]:
    """Sweeps of the clouds that are of the size of the ring."""
    size = len(ring.poses)
    series = []
    for times, clouds in found:
        fit = np.array([len(cloud) == size for cloud in clouds], dtype=bool)
        sweeps = [ring_ranges(cloud, ring.poses) for cloud in clouds if len(cloud) == size]
        series.append((times[fit], np.array(sweeps, dtype=np.float32).reshape(-1, size)))
    return series


def array_series(swept: Sequence[Stretch]) -> list[Series]:
    """Sweeps of the usual size in stretches."""
    sizes = [len(ranges) for _, sweeps in swept for ranges in sweeps]
    usual = max(set(sizes), key=sizes.count, default=0)
    series = []
    for times, sweeps in swept:
        fit = np.array([len(ranges) == usual for ranges in sweeps], dtype=bool)
        kept = [ranges for ranges in sweeps if len(ranges) == usual]
        series.append((times[fit], np.array(kept, dtype=np.float32).reshape(-1, usual)))
    return series
