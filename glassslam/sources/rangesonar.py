"""Rings made of single ranges: sensor_msgs/Range, one message per sonar."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from glassslam.errors import UsageError
from glassslam.records import SonarRing
from glassslam.sources.bag import Topic
from glassslam.sources.frames import BASE_FRAMES
from glassslam.sources.messages import UnusableMessageError
from glassslam.sources.sonarfeed import SensorKey, SonarPlan, limited_range
from glassslam.sources.sonarmessages import ULTRASOUND, range_limits
from glassslam.sources.sonarsamples import Stretch
from glassslam.sources.sonartopics import natural_order
from glassslam.sources.sweeps import Series, sweep_rule
from glassslam.sources.transforms import TransformTree, frame_name, planar

Stretches: TypeAlias = Sequence[Stretch]


def plan_ranges(
    topics: Sequence[Topic],
    messages_of: Callable[[Topic], Stretches],
    tree: TransformTree,
    base: str,
    ring: SonarRing | None,
    *,
    wished: bool,
) -> SonarPlan | None:
    """Find the sonars behind topics of sensor_msgs/Range, and where they sit.

    A sonar is a frame of a topic. With a described ring, frames in natural order (sonar_2 before sonar_10)
    are its sonars in their order.

    Parameters
    ----------
    topics : sequence of Topic
        Where ranges were published.
    messages_of : callable
        Record times (s) and messages of stretches of a topic.
    tree : TransformTree
        The frames of the recording.
    base : str
        The base frame; empty when the recording does not name it.
    ring : SonarRing or None
        The ring the user named.
    wished : bool
        Whether the user named the topics; otherwise only ultrasonic sensors are taken.

    Returns
    -------
    SonarPlan or None
        None when no topic is of an ultrasonic sensor.

    Raises
    ------
    UsageError
        A frame is not connected to the base, or the ring has another number of sonars.
    """
    sensors = _sensors(topics, messages_of, wished=wished)
    if not sensors:
        return None
    keys = sorted(sensors, key=lambda key: (natural_order(key[1]), natural_order(key[0])))
    if ring is None:
        ring = _ring_from_frames(keys, sensors, tree, base)
    elif len(ring.poses) != len(keys):
        raise UsageError(
            f"the ring {ring.name} has {len(ring.poses)} sonars, the recording {len(keys)}",
            f"recorded are {', '.join(frame or topic for topic, frame in keys)}",
        )
    series = [_single(stretch) for key in keys for stretch in sensors[key]]
    rule = sweep_rule(ring, series, whole_sweeps=False)
    used = tuple(topic for topic in topics if any(name == topic.name for name, _ in keys))
    return SonarPlan(ring, rule, used, (), {key: place for place, key in enumerate(keys)}, {})


def _sensors(
    topics: Sequence[Topic], messages_of: Callable[[Topic], Stretches], *, wished: bool
) -> dict[SensorKey, list[Stretch]]:
    """The messages of every sensor, in stretches."""
    sensors: dict[SensorKey, list[Stretch]] = {}
    for topic in topics:
        for times, messages in messages_of(topic):
            frames = [frame_name(message.header.frame_id) for message in messages]
            for frame in sorted(set(frames)):
                own = [k for k, other in enumerate(frames) if other == frame and _usable(messages[k], wished)]
                if own:
                    stretch = (times[own], [messages[k] for k in own])
                    sensors.setdefault((topic.name, frame), []).append(stretch)
    return sensors


def _usable(message: Any, wished: bool) -> bool:
    try:
        range_limits(message)
    except UnusableMessageError:
        return False
    return wished or message.radiation_type == ULTRASOUND


def _single(stretch: Stretch) -> Series:
    times, messages = stretch
    return times, np.array([[limited_range(message)] for message in messages], dtype=np.float32)


def _ring_from_frames(
    keys: Sequence[SensorKey],
    sensors: Mapping[SensorKey, Stretches],
    tree: TransformTree,
    base: str,
) -> SonarRing:
    frames = [frame for _, frame in keys]
    base = base or next((name for name in BASE_FRAMES if tree.lookup(name, frames[0]) is not None), "")
    matrices = {frame: tree.lookup(base, frame) if base else None for frame in frames}
    missing = [frame for frame, matrix in matrices.items() if matrix is None]
    if missing:
        raise UsageError(
            f"no transform from {base or 'a base frame'} to the sonars {', '.join(missing)}",
            "--sonar-ring NAME or FILE says where the sonars sit",
        )
    limits = np.array([range_limits(sensors[key][0][1][0]) for key in keys])
    poses = np.array([planar(matrix) for frame in frames if (matrix := matrices[frame]) is not None])
    return SonarRing(poses, float(limits[:, 0].max()), float(limits[:, 1].min()), float(limits[:, 2].max()))
