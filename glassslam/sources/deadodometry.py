"""Whether odometry is dead: the same pose all through a recording whose scans were taken from many places."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from typing import Any

from glassslam.records import FloatArray
from glassslam.slam.restless import by_direction, restless_share
from glassslam.sources.messages import UnusableMessageError, odometry, odometry_from_transform
from glassslam.sources.noecho import detect_no_echo
from glassslam.sources.transforms import Edge, frame_name

_RESTLESS = 0.15
_NEAREST = 0.05
_LEAST_POSES = 20


def is_dead(poses: Iterable[object], scans: Callable[[], Iterable[Any]]) -> bool:
    """Whether the odometry never moves while the scans do.

    Odometry of a robot that stands is never dead: its scans stay the same, however many people walk by.

    Parameters
    ----------
    poses : iterable
        Poses from all over a recording, of any kind that can be compared; read up to the first that differs.
    scans : callable
        Gives scans from all over the recording, with `ranges`, `angle_min` and `angle_increment`; only asked
        when all poses are the same.
    """
    rest = iter(poses)
    first, count = next(rest, None), 1
    for pose in rest:
        if pose != first:
            return False
        count += 1
    if count < _LEAST_POSES:
        return False
    return restless_share(_by_direction(list(scans()))) > _RESTLESS


def dead_warning(name: str) -> str:
    """What a user should know."""
    return f"{name} is not used: it stands still all the time while the scans change"


def poses_of(samples: Iterable[Any], edge: Edge | None) -> Iterator[object]:
    """Usable poses in messages of an odometry topic, or in transforms along an edge."""
    for message in samples:
        if edge is None:
            with suppress(UnusableMessageError):
                yield odometry(message, 0).pose
            continue
        for stamped in message.transforms:
            link = frame_name(stamped.header.frame_id), frame_name(stamped.child_frame_id)
            if link == (edge.parent, edge.child):
                with suppress(UnusableMessageError):
                    yield odometry_from_transform(stamped, 0).pose


def _by_direction(scans: list[Any]) -> list[FloatArray]:
    limits = _NEAREST, detect_no_echo(scan.ranges for scan in scans).ceiling
    usable = (scan for scan in scans if scan.angle_increment and len(scan.ranges))
    return [by_direction(scan.ranges, scan.angle_min, scan.angle_increment, limits) for scan in usable]
