"""Sonar messages for bags of a few messages."""

from typing import Any

import numpy as np
from rosbags.typesys import get_types_from_msg
from tiny_bags import ROS1, T0, Sent, floats, header

from glassslam.records import RangeRing
from glassslam.sources.bag import CLOUD, CLOUD2, RANGE, RANGE_ARRAY, TS_SCAN

_TS_SCAN = """Header header
TsPoint[] points
================================================================================
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
================================================================================
MSG: toposens_msgs/TsPoint
geometry_msgs/Point location
float32 intensity
================================================================================
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
"""
ROS1.register(get_types_from_msg(_TS_SCAN, TS_SCAN))


def sonar(
    at: float,
    value: float,
    *,
    topic: str = "/sonar",
    frame: str = "sonar_0",
    stamp: float | None = None,
    limits: tuple[float, float] = (0.1, 5.0),
    radiation: int = 0,
    view: float = 0.5,
) -> Sent:
    """A single range; radiation 0 is ultrasound, 1 infrared."""

    def build(store):
        return store.types[RANGE](
            header=header(store, T0 + at if stamp is None else stamp, frame),
            radiation_type=radiation,
            field_of_view=view,
            min_range=limits[0],
            max_range=limits[1],
            range=value,
        )

    return Sent(topic, RANGE, at, build)


def cloud(at: float, points: Any, *, topic: str = "/sonar", frame: str = "base_link") -> Sent:
    """A point cloud of the first kind."""

    def build(store):
        point = store.types["geometry_msgs/msg/Point32"]
        return store.types[CLOUD](
            header=header(store, T0 + at, frame),
            points=[point(*map(float, xyz)) for xyz in points],
            channels=[],
        )

    return Sent(topic, CLOUD, at, build)


def cloud2(
    at: float,
    points: Any,
    *,
    topic: str = "/points",
    frame: str = "base_link",
    number: str = "<f4",
    names: str = "xyz",
    padding: int = 0,
) -> Sent:
    """A point cloud of the second kind: intensity before the coordinates, `padding` bytes after a row."""
    size = np.dtype(number).itemsize

    def build(store):
        field = store.types["sensor_msgs/msg/PointField"]
        kind = {"f4": 7, "f8": 8, "i4": 5}[number[1:]]
        rows = np.asarray(points, dtype=float).reshape(-1, 3)
        data = np.column_stack([np.full(len(rows), 7.0), rows]).astype(number)
        return store.types[CLOUD2](
            header=header(store, T0 + at, frame),
            height=1,
            width=len(rows),
            fields=[field(name, (k + 1) * size, kind, 1) for k, name in enumerate(names)],
            is_bigendian=number[0] == ">",
            point_step=4 * size,
            row_step=4 * size * len(rows) + padding,
            data=np.frombuffer(data.tobytes() + bytes(padding), dtype=np.uint8),
            is_dense=True,
        )

    return Sent(topic, CLOUD2, at, build)


def range_array(at: float, ranges: Any, *, topic: str = "/sonar_array") -> Sent:
    """Plain numbers."""

    def build(store):
        layout = store.types["std_msgs/msg/MultiArrayLayout"](dim=[], data_offset=0)
        return store.types[RANGE_ARRAY](layout=layout, data=floats(ranges))

    return Sent(topic, RANGE_ARRAY, at, build)


def echoes(at: float, points: Any, *, topic: str = "/ts_scans", frame: str = "toposens") -> Sent:
    """A scan of a 3D ultrasonic sensor, of a type that only its maker knows."""

    def build(store):
        echo = store.types["toposens_msgs/msg/TsPoint"]
        point = store.types["geometry_msgs/msg/Point"]
        return store.types[TS_SCAN](
            header=header(store, T0 + at, frame),
            points=[echo(point(*map(float, xyz)), 0.5) for xyz in points],
        )

    return Sent(topic, TS_SCAN, at, build)


def only(recording, kind):
    """The records of one kind."""
    return [record for record in recording.records() if isinstance(record, kind)]


def ranges_of(recording):
    """Ranges of all sweeps, one row each."""
    return np.array([record.ranges for record in only(recording, RangeRing)])
