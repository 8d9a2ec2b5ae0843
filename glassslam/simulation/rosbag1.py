"""Records written as a ROS1 bag, as a robot would have recorded them."""

import contextlib
import os
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from glassslam.errors import OutputError
from glassslam.records import FloatArray, LaserScan, Odometry, PointSet, RangeRing, Record, SonarRing

if TYPE_CHECKING:
    from rosbags.rosbag1 import Writer
    from rosbags.typesys.store import Typestore

_NS = 1_000_000_000
_TF_DEFINITION = "geometry_msgs/TransformStamped[] transforms\n"
_RANGE = "sensor_msgs/msg/Range"
_POINTS = "sensor_msgs/msg/PointCloud2"
_ULTRASONIC = "ultrasonic"
_FLOAT32 = 7
_TOPICS = {
    "/tf_static": ("tf2_msgs/msg/TFMessage", 1),
    "/tf": ("tf2_msgs/msg/TFMessage", 0),
    "/odom": ("nav_msgs/msg/Odometry", 0),
    "/scan": ("sensor_msgs/msg/LaserScan", 0),
}


def write_rosbag1(
    records: Iterable[Record],
    path: str | Path,
    base_from_laser: tuple[float, float, float] = (0.0, 0.0, 0.0),
    progress: Callable[[Record], None] | None = None,
    ring: SonarRing | None = None,
    ultrasonic: tuple[float, float, float, float] | None = None,
    laser_height: float = 0.0,
    replacing: Callable[[], None] | None = None,
) -> int:
    """Write scans and odometry as `/scan`, `/odom`, `/tf` (odom to base_link) and `/tf_static`.

    Sonars are written as `/sonar_00`, `/sonar_01` ... (sensor_msgs/Range), each in a frame of its own name,
    points of a 3D ultrasonic sensor as `/ultrasonic` (sensor_msgs/PointCloud2) in the frame `ultrasonic`.

    The bag appears under its name only when it is complete.

    Parameters
    ----------
    records : iterable of Record
        In the order of recording; what the robot has no sensor for is left out.
    path : str or Path
        The bag; an existing one is replaced.
    base_from_laser : tuple of float
        Pose x, y, yaw of the laser on the base, m and rad.
    progress : callable, optional
        Called with each record after it was written.
    ring : SonarRing, optional
        The sonars of the robot; without it sonar readings are left out.
    ultrasonic : tuple of float, optional
        Pose x, y, z, yaw of a 3D ultrasonic sensor on the base, m and rad; without it points are left out.
    laser_height : float
        Height of the laser above the base, m.
    replacing : callable, optional
        Called when the bag is complete, just before it takes its name.

    Returns
    -------
    int
        Number of scans written.

    Raises
    ------
    OutputError
        The file cannot be written.
    """
    from rosbags.rosbag1 import Writer  # noqa: PLC0415  (slow to import)

    target = Path(path)
    partial = target.with_name(f".{target.name}.partial")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        partial.unlink(missing_ok=True)
        with Writer(partial) as writer:
            bag = _BagMessages(writer, ring, ultrasonic)
            laser = (*base_from_laser, laser_height)
            scans = _write_all(bag, records, laser, progress)
        with partial.open("rb") as done:
            os.fsync(done.fileno())
        if replacing is not None:
            replacing()
        partial.replace(target)
    except OSError as error:
        raise OutputError(f"cannot write {target}: {error.strerror}") from error
    finally:
        with contextlib.suppress(OSError):
            partial.unlink(missing_ok=True)
    return scans


def _write_all(
    bag: "_BagMessages",
    records: Iterable[Record],
    laser: tuple[float, float, float, float],
    progress: Callable[[Record], None] | None,
) -> int:
    scans = 0
    for number, record in enumerate(records):
        if number == 0:
            bag.static_transform(record.stamp, laser)
        if isinstance(record, LaserScan):
            bag.scan(record, scans)
            scans += 1
        elif isinstance(record, Odometry):
            bag.odometry(record)
        elif isinstance(record, RangeRing):
            bag.readings(record)
        elif isinstance(record, PointSet):
            bag.points(record)
        if progress is not None:
            progress(record)
    return scans


class _BagMessages:
    """Turns records into serialised messages of an open bag."""

    def __init__(
        self,
        writer: "Writer",
        ring: SonarRing | None = None,
        ultrasonic: tuple[float, float, float, float] | None = None,
    ) -> None:
        self._store = _typestore()
        self._writer = writer
        self._ring, self._ultrasonic = ring, ultrasonic
        sonars = range(0 if ring is None else len(ring.poses))
        self._topics = _TOPICS | {f"/{_sonar(number)}": (_RANGE, 0) for number in sonars}
        if ultrasonic is not None:
            self._topics[f"/{_ULTRASONIC}"] = (_POINTS, 0)
        self._connections = {
            topic: writer.add_connection(
                topic, kind, typestore=self._store, callerid="/glassslam", latching=latching
            )
            for topic, (kind, latching) in self._topics.items()
        }
        self._count = 0

    def scan(self, record: LaserScan, number: int) -> None:
        message = self._make(
            "sensor_msgs/msg/LaserScan",
            header=self._header(record.stamp, record.frame_id, number),
            angle_min=record.angle_min,
            angle_max=record.angle_min + (record.ranges.size - 1) * record.angle_increment,
            angle_increment=record.angle_increment,
            time_increment=record.time_increment,
            scan_time=record.ranges.size * record.time_increment,
            range_min=record.range_min,
            range_max=record.range_max,
            ranges=record.ranges,
            intensities=record.intensities,
        )
        self._write("/scan", record.record_stamp, message)

    def odometry(self, record: Odometry) -> None:
        x, y, theta = record.pose
        zero, unknown = self._vector(0.0, 0.0), np.zeros(36)
        make = self._make
        pose = make("geometry_msgs/msg/Pose", position=self._point(x, y), orientation=self._yaw(theta))
        message = make(
            "nav_msgs/msg/Odometry",
            header=self._header(record.stamp, "odom", self._count),
            child_frame_id="base_link",
            pose=make("geometry_msgs/msg/PoseWithCovariance", pose=pose, covariance=unknown),
            twist=make(
                "geometry_msgs/msg/TwistWithCovariance",
                twist=make("geometry_msgs/msg/Twist", linear=zero, angular=zero),
                covariance=unknown,
            ),
        )
        self._count += 1
        self._write("/odom", record.record_stamp, message)
        transform = self._transform(record.stamp, "odom", "base_link", (x, y, theta))
        self._write("/tf", record.record_stamp, transform)

    def readings(self, record: RangeRing) -> None:
        """One message for each sonar that has fired."""
        if self._ring is None:
            return
        for number in np.flatnonzero(~np.isnan(record.ranges)).tolist():
            message = self._make(
                _RANGE,
                header=self._header(record.stamp, _sonar(number), self._count),
                radiation_type=0,
                field_of_view=self._ring.field_of_view,
                min_range=self._ring.range_min,
                max_range=self._ring.range_max,
                range=float(record.ranges[number]),
            )
            self._write(f"/{_sonar(number)}", record.record_stamp, message)

    def points(self, record: PointSet) -> None:
        """The points in the frame of the sensor."""
        if self._ultrasonic is None:
            return
        local = _turned_back(record.points.astype(np.float64) - self._ultrasonic[:3], self._ultrasonic[3])
        fields = [
            self._make("sensor_msgs/msg/PointField", name=name, offset=4 * k, datatype=_FLOAT32, count=1)
            for k, name in enumerate("xyz")
        ]
        message = self._make(
            _POINTS,
            header=self._header(record.stamp, _ULTRASONIC, self._count),
            height=1,
            width=len(local),
            fields=fields,
            is_bigendian=False,
            point_step=12,
            row_step=12 * len(local),
            data=np.frombuffer(local.astype("<f4").tobytes(), dtype=np.uint8),
            is_dense=True,
        )
        self._write(f"/{_ULTRASONIC}", record.record_stamp, message)

    def static_transform(self, stamp: float, laser: tuple[float, float, float, float]) -> None:
        x, y, yaw, height = laser
        frames = [self._stamped(stamp, "base_link", "laser", (x, y, yaw), height)]
        for number, (x, y, yaw) in enumerate([] if self._ring is None else self._ring.poses.tolist()):
            frames.append(self._stamped(stamp, "base_link", _sonar(number), (x, y, yaw)))
        if self._ultrasonic is not None:
            x, y, height, yaw = self._ultrasonic
            frames.append(self._stamped(stamp, "base_link", _ULTRASONIC, (x, y, yaw), height))
        self._write("/tf_static", stamp, self._make("tf2_msgs/msg/TFMessage", transforms=frames))

    def _transform(self, stamp: float, parent: str, child: str, pose: tuple[float, float, float]) -> Any:
        return self._make("tf2_msgs/msg/TFMessage", transforms=[self._stamped(stamp, parent, child, pose)])

    def _stamped(
        self, stamp: float, parent: str, child: str, pose: tuple[float, float, float], height: float = 0.0
    ) -> Any:
        transform = self._make(
            "geometry_msgs/msg/Transform",
            translation=self._vector(pose[0], pose[1], height),
            rotation=self._yaw(pose[2]),
        )
        return self._make(
            "geometry_msgs/msg/TransformStamped",
            header=self._header(stamp, parent, 0),
            child_frame_id=child,
            transform=transform,
        )

    def _header(self, stamp: float, frame: str, number: int) -> Any:
        seconds, nanoseconds = divmod(_nanoseconds(stamp), _NS)
        time = self._make("builtin_interfaces/msg/Time", sec=seconds, nanosec=nanoseconds)
        return self._make("std_msgs/msg/Header", seq=number, stamp=time, frame_id=frame)

    def _yaw(self, theta: float) -> Any:
        z, w = float(np.sin(theta / 2)), float(np.cos(theta / 2))
        return self._make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=z, w=w)

    def _vector(self, x: float, y: float, z: float = 0.0) -> Any:
        return self._make("geometry_msgs/msg/Vector3", x=x, y=y, z=z)

    def _point(self, x: float, y: float) -> Any:
        return self._make("geometry_msgs/msg/Point", x=x, y=y, z=0.0)

    def _make(self, kind: str, **fields: Any) -> Any:
        return self._store.types[kind](**fields)

    def _write(self, topic: str, stamp: float, message: Any) -> None:
        data = self._store.serialize_ros1(message, self._topics[topic][0])
        self._writer.write(self._connections[topic], _nanoseconds(stamp), data)


def _typestore() -> "Typestore":
    """Message types of ROS1 noetic, with the one for transforms that is not among them."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore  # noqa: PLC0415  (slow to import)

    store = get_typestore(Stores.ROS1_NOETIC)
    store.register(get_types_from_msg(_TF_DEFINITION, "tf2_msgs/msg/TFMessage"))
    return store


def _turned_back(points: FloatArray, yaw: float) -> FloatArray:
    """Points (n, 3) in a frame turned by a yaw, rad."""
    cosine, sine = np.cos(yaw), np.sin(yaw)
    x, y = points[:, 0], points[:, 1]
    return np.stack((cosine * x + sine * y, cosine * y - sine * x, points[:, 2]), axis=1)


def _sonar(number: int) -> str:
    """Name of the frame of a sonar, and of its topic."""
    return f"sonar_{number:02d}"


def _nanoseconds(stamp: float) -> int:
    """Nanoseconds of a stamp, rounded to the microsecond a float64 of this size can hold."""
    return round(stamp * 1e6) * 1000
