"""ROS messages of sonars become plain arrays."""

import math
from typing import Any

import numpy as np

from glassslam.records import Float32Array
from glassslam.sources.messages import UnusableMessageError

BAD_CLOUD = "point cloud without x, y and z as numbers"
BAD_RANGE_LIMITS = "range without a usable maximum"
ULTRASOUND = 0

_NUMBERS = {7: "f4", 8: "f8"}


def cloud_points(message: Any) -> Float32Array:
    """Points of a sensor_msgs/PointCloud, shape (n, 3), m."""
    points = [(point.x, point.y, point.z) for point in message.points]
    return np.array(points, dtype=np.float32).reshape(-1, 3)


def cloud2_points(message: Any) -> Float32Array:
    """Points of a sensor_msgs/PointCloud2, shape (n, 3), m.

    Raises
    ------
    UnusableMessageError
        A coordinate is missing or of another type than float, or the data is cut off.
    """
    order = ">" if message.is_bigendian else "<"
    fields = {field.name: field for field in message.fields}
    if any(name not in fields or fields[name].datatype not in _NUMBERS for name in "xyz"):
        raise UnusableMessageError(BAD_CLOUD)
    kind = np.dtype(
        {
            "names": ["x", "y", "z"],
            "formats": [order + _NUMBERS[fields[name].datatype] for name in "xyz"],
            "offsets": [fields[name].offset for name in "xyz"],
            "itemsize": message.point_step,
        }
    )
    data = np.asarray(message.data, dtype=np.uint8)
    rows, used = message.height, message.width * message.point_step
    if data.size < rows * message.row_step or message.row_step < used:
        raise UnusableMessageError(BAD_CLOUD)
    # Rows may be padded; points may carry more than their place.
    lines = data[: rows * message.row_step].reshape(rows, message.row_step)[:, :used]
    points = np.frombuffer(lines.tobytes(), dtype=kind)
    return np.stack([points[name] for name in "xyz"], axis=1).astype(np.float32)


def scan_points(message: Any) -> Float32Array:
    """Echoes of a toposens_msgs/TsScan, shape (n, 3), m."""
    points = [(echo.location.x, echo.location.y, echo.location.z) for echo in message.points]
    return np.array(points, dtype=np.float32).reshape(-1, 3)


def array_ranges(message: Any) -> Float32Array:
    """Ranges of a std_msgs/Float32MultiArray, shape (n,), m."""
    data: Float32Array = np.asarray(message.data, dtype=np.float32)
    return data[message.layout.data_offset :]


def range_limits(message: Any) -> tuple[float, float, float]:
    """Opening angle (rad), least and largest range (m) of a sensor_msgs/Range.

    Raises
    ------
    UnusableMessageError
        The largest range is not above the least.
    """
    view, near, far = float(message.field_of_view), float(message.min_range), float(message.max_range)
    near = near if math.isfinite(near) and near > 0.0 else 0.0
    if math.isnan(far) or far <= near:
        raise UnusableMessageError(BAD_RANGE_LIMITS)
    return view, near, far
