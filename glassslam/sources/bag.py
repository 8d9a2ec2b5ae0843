"""What every bag format offers, and how one is opened."""

from collections.abc import Callable, Collection, Generator
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

from glassslam.records import Damage
from glassslam.sources.formats import Format, Piece

if TYPE_CHECKING:
    from rosbags.interfaces import Connection
    from rosbags.typesys.store import Typestore

LASER_SCAN = "sensor_msgs/msg/LaserScan"
MULTI_ECHO = "sensor_msgs/msg/MultiEchoLaserScan"
ODOMETRY = "nav_msgs/msg/Odometry"
IMU = "sensor_msgs/msg/Imu"
TF_TYPES = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")
RANGE = "sensor_msgs/msg/Range"
CLOUD = "sensor_msgs/msg/PointCloud"
CLOUD2 = "sensor_msgs/msg/PointCloud2"
RANGE_ARRAY = "std_msgs/msg/Float32MultiArray"
TS_SCAN = "toposens_msgs/msg/TsScan"
SCAN_TYPES = (LASER_SCAN, MULTI_ECHO)
SONAR_TYPES = (RANGE, CLOUD, CLOUD2, RANGE_ARRAY, TS_SCAN)
USED_TYPES = (*SCAN_TYPES, ODOMETRY, IMU, *TF_TYPES)

_TF_DEFINITION = "geometry_msgs/TransformStamped[] transforms"

Decoder: TypeAlias = Callable[[bytes], Any]
Raw: TypeAlias = tuple["Topic", int, bytes]


@dataclass(frozen=True, slots=True)
class Topic:
    """One stream of messages: its name, message type and number of messages."""

    name: str
    msgtype: str
    count: int


class Bag(Protocol):
    """An opened bag file of any version.

    Attributes
    ----------
    piece : Piece
        The file and its format.
    topics : tuple of Topic
        Everything recorded.
    start, end : int
        Record times of the first and last message, ns; `end < start` when there is none.
    damage : tuple of Damage
        What could not be read so far: what was seen at opening, and what each reading adds.
    """

    piece: Piece
    topics: tuple[Topic, ...]
    start: int
    end: int

    @property
    def damage(self) -> tuple[Damage, ...]:
        """What could not be read so far."""
        ...

    def messages(
        self, topics: Collection[Topic], start: int | None = None, stop: int | None = None
    ) -> Generator[Raw, None, None]:
        """Topic, record time in ns and serialised message, from `start` up to before `stop`."""
        ...

    def decoder(self, msgtype: str) -> Decoder:
        """The function that turns a serialised message of this type into an object."""
        ...

    def session(self) -> AbstractContextManager[object]:
        """Keep files open between several readings."""
        ...


def open_bag(piece: Piece, *, strict: bool = False) -> Bag:
    """Open one bag file or directory; what is readable of a damaged one, unless `strict`.

    Raises
    ------
    RecordingError
        Nothing can be read, the file is not what it pretends to be, or it is damaged and `strict` was said.
    """
    if piece.format == "rosbag1":
        from glassslam.sources.rosbag1 import Ros1Bag  # noqa: PLC0415  (rosbags is loaded for bags only)

        return Ros1Bag(piece, strict=strict)
    from glassslam.sources.rosbag2 import Ros2Bag  # noqa: PLC0415

    return Ros2Bag(piece, strict=strict)


def merge_topics(topics: Collection[Topic]) -> tuple[Topic, ...]:
    """Topics of several connections or files added up by name and type, in order of appearance."""
    counts: dict[tuple[str, str], int] = {}
    for topic in topics:
        key = (topic.name, topic.msgtype)
        counts[key] = counts.get(key, 0) + topic.count
    return tuple(Topic(name, msgtype, count) for (name, msgtype), count in counts.items())


def typestore_for(connections: Collection["Connection"], format_name: Format) -> "Typestore":
    """Message definitions as recorded, the common ones where a bag holds none."""
    store = _store_of_used_types(connections, format_name)
    _add_sonar_types(store, connections)
    return store


def _add_sonar_types(store: "Typestore", connections: Collection["Connection"]) -> None:
    """Add what sonars need; a definition that does not fit costs its topic and no other."""
    from rosbags.interfaces import MessageDefinitionFormat  # noqa: PLC0415
    from rosbags.typesys import TypesysError, get_types_from_msg  # noqa: PLC0415

    for connection in connections:
        definition = connection.msgdef
        wanted = connection.msgtype in SONAR_TYPES and connection.msgtype not in store.fielddefs
        if wanted and definition.format is MessageDefinitionFormat.MSG:
            with suppress(TypesysError):
                store.register(get_types_from_msg(definition.data, connection.msgtype))


def _store_of_used_types(connections: Collection["Connection"], format_name: Format) -> "Typestore":
    from rosbags.interfaces import MessageDefinitionFormat  # noqa: PLC0415
    from rosbags.typesys import Stores, TypesysError, get_types_from_msg, get_typestore  # noqa: PLC0415

    own = get_typestore(Stores.EMPTY)
    for connection in connections:
        definition = connection.msgdef
        if connection.msgtype not in USED_TYPES or connection.msgtype in own.fielddefs:
            continue
        if definition.format is not MessageDefinitionFormat.MSG:
            break
        try:
            own.register(get_types_from_msg(definition.data, connection.msgtype))
        except TypesysError:
            break
    else:
        return own
    common = get_typestore(Stores.ROS1_NOETIC if format_name == "rosbag1" else Stores.ROS2_HUMBLE)
    for msgtype in TF_TYPES:
        if msgtype not in common.fielddefs:
            common.register(get_types_from_msg(_TF_DEFINITION, msgtype))
    return common
