"""The tree of coordinate frames, built from transform messages."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from glassslam.records import FloatArray

Pose2 = tuple[float, float, float]

# Larger changes than these mean a joint or a vehicle moved, smaller ones are rounding.
_MOVED_M = 1e-3
_MOVED_RAD = 1e-3


def frame_name(name: str) -> str:
    """A frame without the leading slash of old recordings."""
    return name.lstrip("/")


def matrix_of(transform: Any) -> FloatArray | None:
    """Homogeneous matrix (4, 4) of a geometry_msgs/Transform; None when it is no rigid motion."""
    t, q = transform.translation, transform.rotation
    values = np.array([t.x, t.y, t.z, q.x, q.y, q.z, q.w], dtype=np.float64)
    norm = math.hypot(*values[3:].tolist()) if np.all(np.isfinite(values)) else 0.0
    if not 1e-6 < norm < math.inf:
        return None
    x, y, z, w = (values[3:] / norm).tolist()
    matrix = np.eye(4)
    matrix[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    matrix[:3, 3] = values[:3]
    return matrix


def planar(matrix: FloatArray) -> Pose2:
    """(x, y, yaw) of a pose seen from above, m and rad; yaw is where its x axis points."""
    return float(matrix[0, 3]), float(matrix[1, 3]), math.atan2(matrix[1, 0], matrix[0, 0])


def is_upside_down(matrix: FloatArray) -> bool:
    """Whether the z axis of the frame points downwards."""
    return bool(matrix[2, 2] < 0.0)


def tilt(matrix: FloatArray) -> float:
    """Angle between the z axis of the frame and the vertical, whichever way up, rad."""
    return math.acos(min(1.0, abs(float(matrix[2, 2]))))


@dataclass(slots=True)
class Edge:
    """One link of the tree.

    Attributes
    ----------
    parent, child : str
        Frames, without leading slash.
    matrix : ndarray, shape (4, 4)
        Pose of the child in the parent frame, as first seen.
    topic : str
        Where it was published.
    static : bool
        Whether it came from a static topic.
    count : int
        Messages seen.
    moved : bool
        Whether a later message differed.
    """

    parent: str
    child: str
    matrix: FloatArray
    topic: str
    static: bool
    count: int = 1
    moved: bool = False

    def update(self, matrix: FloatArray) -> None:
        """Count a repetition and notice a change."""
        self.count += 1
        self.moved = self.moved or not _same(self.matrix, matrix)


@dataclass(slots=True)
class TransformTree:
    """Frames linked by the transforms seen so far; the first value of each link stands."""

    edges: dict[tuple[str, str], Edge] = field(default_factory=dict)
    _parents: dict[str, Edge] = field(default_factory=dict)

    def add_message(self, transforms: Iterable[Any], topic: str, *, static: bool) -> None:
        """Take in the transforms of one tf message; those that are no rigid motion are ignored."""
        for stamped in transforms:
            matrix = matrix_of(stamped.transform)
            parent, child = frame_name(stamped.header.frame_id), frame_name(stamped.child_frame_id)
            if matrix is not None and parent and child and parent != child:
                self.add(parent, child, matrix, topic, static=static)

    def add(self, parent: str, child: str, matrix: FloatArray, topic: str = "", *, static: bool) -> None:
        """Take in one transform."""
        known = self.edges.get((parent, child))
        if known is not None:
            known.update(matrix)
            return
        edge = Edge(parent, child, matrix, topic, static)
        self.edges[parent, child] = edge
        # Where a fixed and a moving link lead to the same child, the fixed one is the mount.
        if child not in self._parents or (static and not self._parents[child].static):
            self._parents[child] = edge

    def chain(self, target: str, source: str) -> tuple[list[Edge], list[Edge]] | None:
        """Links from `source` and from `target` up to their nearest common frame; None if unconnected."""
        above_source = [source, *(edge.parent for edge in self._upwards(source))]
        above_target = [target, *(edge.parent for edge in self._upwards(target))]
        common = next((name for name in above_source if name in above_target), None)
        if common is None:
            return None
        rise = list(self._upwards(source))[: above_source.index(common)]
        fall = list(self._upwards(target))[: above_target.index(common)]
        return rise, fall

    def lookup(self, target: str, source: str) -> FloatArray | None:
        """Matrix target_from_source, shape (4, 4); None when the frames are not connected."""
        chain = self.chain(frame_name(target), frame_name(source))
        if chain is None:
            return None
        rise, fall = (_stack(edges) for edges in chain)
        return np.asarray(np.linalg.inv(fall) @ rise)

    def is_rigid(self, target: str, source: str) -> bool:
        """Whether no link between the two frames has been seen moving."""
        chain = self.chain(frame_name(target), frame_name(source))
        return chain is not None and not any(edge.moved for edges in chain for edge in edges)

    def _upwards(self, frame: str) -> Iterator[Edge]:
        seen = {frame}
        while (edge := self._parents.get(frame)) is not None and edge.parent not in seen:
            yield edge
            frame = edge.parent
            seen.add(frame)


def _stack(edges: list[Edge]) -> FloatArray:
    """Matrix from the lowest child of a chain of links to its highest parent."""
    matrix = np.eye(4)
    for edge in edges:
        matrix = edge.matrix @ matrix
    return matrix


def _same(a: FloatArray, b: FloatArray) -> bool:
    difference = np.abs(a - b)
    return bool(difference[:3, 3].max() < _MOVED_M and difference[:3, :3].max() < _MOVED_RAD)
