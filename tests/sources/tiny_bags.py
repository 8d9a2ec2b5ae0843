"""Bags of a few messages, written by rosbags itself."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from glassslam.sources.bag import IMU, LASER_SCAN, MULTI_ECHO, ODOMETRY

ROS1 = get_typestore(Stores.ROS1_NOETIC)
ROS2 = get_typestore(Stores.ROS2_HUMBLE)

TF = "tf2_msgs/msg/TFMessage"
OLD_TF = "tf/msg/tfMessage"
for _msgtype in (TF, OLD_TF):
    ROS1.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", _msgtype))

T0 = 1_600_000_000


@dataclass(frozen=True)
class Sent:
    """One message: where, what, when recorded (s after T0), and how to build it with a type store."""

    topic: str
    msgtype: str
    at: float
    build: Callable[[Any], Any]


def _time(store, at):
    # Whole seconds apart from the rest: their sum in a float would lose the last digits.
    seconds, rest = divmod(at, 1.0) if at < T0 else (T0, at - T0)
    nanoseconds = int(seconds) * 10**9 + round(rest * 1e9)
    return store.types["builtin_interfaces/msg/Time"](nanoseconds // 10**9, nanoseconds % 10**9)


def header(store, at, frame):
    fields = {"stamp": _time(store, at), "frame_id": frame}
    if store is ROS1:
        fields["seq"] = 0
    return store.types["std_msgs/msg/Header"](**fields)


def floats(values):
    return np.asarray(values, dtype=np.float32)


def _echoes(store, beams):
    echo = store.types["sensor_msgs/msg/LaserEcho"]
    return [echo(echoes=floats(beam)) for beam in beams]


def scan(
    at: float,
    ranges: Any = (1.0, 2.0, 3.0),
    *,
    topic: str = "/scan",
    stamp: float | None = None,
    frame: str = "laser",
    intensities: Any = (),
    echoes: bool = False,
    **fields: float,
) -> Sent:
    """A laser scan stamped when it is recorded unless told otherwise; lists of lists for several echoes."""
    header_time = T0 + at if stamp is None else stamp
    geometry = {
        "angle_min": -0.5,
        "angle_max": 0.5,
        "angle_increment": 0.5,
        "time_increment": 0.0,
        "scan_time": 0.1,
        "range_min": 0.1,
        "range_max": 30.0,
    }
    geometry.update(fields)

    def build(store):
        pack = (lambda values: _echoes(store, values)) if echoes else floats
        stamped = header(store, header_time, frame)
        kind = store.types[MULTI_ECHO if echoes else LASER_SCAN]
        return kind(header=stamped, **geometry, ranges=pack(ranges), intensities=pack(intensities))

    return Sent(topic, MULTI_ECHO if echoes else LASER_SCAN, at, build)


def _vector(store, x, y, z):
    return store.types["geometry_msgs/msg/Vector3"](x, y, z)


def _quaternion(store, roll, pitch, yaw):
    (cr, sr), (cp, sp), (cy, sy) = ((math.cos(a / 2), math.sin(a / 2)) for a in (roll, pitch, yaw))
    return store.types["geometry_msgs/msg/Quaternion"](
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )


def odom(
    at: float,
    x: float = 0.0,
    y: float = 0.0,
    yaw: float = 0.0,
    *,
    topic: str = "/odom",
    child: str = "base_link",
    upright: bool = True,
) -> Sent:
    """Odometry; not `upright`: with a quaternion of zeros."""

    def build(store):
        types = store.types
        rotation = _quaternion(store, 0, 0, yaw)
        if not upright:
            rotation = types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 0.0)
        pose = types["geometry_msgs/msg/Pose"](types["geometry_msgs/msg/Point"](x, y, 0.0), rotation)
        twist = types["geometry_msgs/msg/Twist"](_vector(store, 0.0, 0.0, 0.0), _vector(store, 0.0, 0.0, 0.0))
        return types[ODOMETRY](
            header=header(store, T0 + at, "odom"),
            child_frame_id=child,
            pose=types["geometry_msgs/msg/PoseWithCovariance"](pose, np.zeros(36)),
            twist=types["geometry_msgs/msg/TwistWithCovariance"](twist, np.zeros(36)),
        )

    return Sent(topic, ODOMETRY, at, build)


def imu(
    at: float,
    rate: tuple[float, float, float],
    *,
    topic: str = "/imu",
    frame: str = "imu",
    without_gyroscope: bool = False,
) -> Sent:
    """An IMU reading with an angular velocity."""

    def build(store):
        covariance = np.zeros(9)
        covariance[0] = -1.0 if without_gyroscope else 0.0
        return store.types[IMU](
            header=header(store, T0 + at, frame),
            orientation=_quaternion(store, 0, 0, 0),
            orientation_covariance=np.zeros(9),
            angular_velocity=_vector(store, *rate),
            angular_velocity_covariance=covariance,
            linear_acceleration=_vector(store, 0.0, 0.0, 9.81),
            linear_acceleration_covariance=np.zeros(9),
        )

    return Sent(topic, IMU, at, build)


def tf(
    at: float,
    parent: str,
    child: str,
    position: tuple[float, float, float] = (0.0, 0.0, 0.0),
    rotation: tuple[float, float, float] = (0.0, 0.0, 0.0),
    *,
    topic: str = "/tf",
    msgtype: str = TF,
) -> Sent:
    """One transform; rotation is roll, pitch, yaw."""

    def build(store):
        types = store.types
        transform = types["geometry_msgs/msg/Transform"](
            _vector(store, *position), _quaternion(store, *rotation)
        )
        stamp = header(store, T0 + at, parent)
        stamped = types["geometry_msgs/msg/TransformStamped"](stamp, child, transform)
        return types[msgtype](transforms=[stamped])

    return Sent(topic, msgtype, at, build)


def write_ros1(
    path: Path, messages: Sequence[Sent], compression: str = "none", *, chunk_bytes: int | None = None
) -> Path:
    """A ROS1 bag with the messages in the order given."""
    writer = Writer1(path)
    if compression != "none":
        writer.set_compression(Writer1.CompressionFormat[compression.upper()])
    if chunk_bytes is not None:
        writer.chunk_threshold = chunk_bytes
    with writer:
        connections = {}
        for sent in messages:
            key = (sent.topic, sent.msgtype)
            if key not in connections:
                connections[key] = writer.add_connection(sent.topic, sent.msgtype, typestore=ROS1)
            data = ROS1.serialize_ros1(sent.build(ROS1), sent.msgtype)
            writer.write(connections[key], T0 * 10**9 + round(sent.at * 1e9), data)
    return path


def write_ros2(path: Path, messages: Sequence[Sent], storage: str = "sqlite3", packing: str = "none") -> Path:
    """A ROS2 directory with the messages in the order given; `packing` is "none", "message" or "file"."""
    writer = Writer2(path, version=9, storage_plugin=StoragePlugin[storage.upper()])
    if packing != "none":
        writer.set_compression(CompressionMode[packing.upper()], CompressionFormat.ZSTD)
    with writer:
        connections = {}
        for sent in messages:
            key = (sent.topic, sent.msgtype)
            if key not in connections:
                connections[key] = writer.add_connection(sent.topic, sent.msgtype, typestore=ROS2)
            data = ROS2.serialize_cdr(sent.build(ROS2), sent.msgtype)
            writer.write(connections[key], T0 * 10**9 + round(sent.at * 1e9), data)
    return path


def lone_file(directory: Path) -> Path:
    """The storage file of a ROS2 directory, alone in a new directory."""
    (file,) = (p for p in directory.iterdir() if p.suffix in {".db3", ".mcap"})
    target = directory.parent / f"alone-{directory.name}{file.suffix}"
    return file.rename(target)
