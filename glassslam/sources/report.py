"""What `inspect_recording` finds out, as plain data."""

import math
from dataclasses import asdict, dataclass
from typing import Any

from glassslam.records import Damage
from glassslam.sources.sonarreport import SonarReport, StampReport
from glassslam.sources.transforms import Pose2

Span = tuple[float, float]


@dataclass(frozen=True, slots=True)
class TopicReport:
    """One topic: `rate` in Hz over the whole recording."""

    name: str
    msgtype: str
    count: int
    rate: float


@dataclass(frozen=True, slots=True)
class IntensityReport:
    """Whether intensities carry information.

    Attributes
    ----------
    verdict : str
        "none", "all zero", "constant", "two-valued", "equal to range" or "informative".
    minimum, maximum : float
        Extremes of the finite ones, in the unit of the sensor.
    share_at_maximum : float
        Share of beams at the very maximum: a sensor that saturates shows it here.
    """

    verdict: str
    minimum: float
    maximum: float
    share_at_maximum: float


@dataclass(frozen=True, slots=True)
class ScanReport:
    """The scans of one topic: spans are (smallest, largest); angles rad, ranges m.

    Attributes
    ----------
    topic, frame_id : str
        Where they were published, and in which frame.
    stamps : StampReport
        Their times.
    beams, angle_min, angle_increment, time_increment : tuple
        Geometry.
    geometry_changes : int
        Scans whose number of beams, first angle or increment differs from that of the scan before.
    field_of_view : float
        Between the first and the last beam of the first scan, rad.
    range_min, range_max : float
        Limits announced in the headers.
    no_echo : float or None
        Range written for a beam without echo.
    limit : float
        Range from which on a beam counts as one without echo.
    shares : dict
        "no_echo", "nan", "too_near" and "valid" shares of all beams.
    percentiles : tuple of float
        5, 50 and 95 % of the valid ranges, to 1 cm; NaN without any.
    intensity : IntensityReport
        What the intensities are worth.
    """

    topic: str
    frame_id: str
    stamps: StampReport
    beams: tuple[int, int]
    angle_min: Span
    angle_increment: Span
    time_increment: Span
    geometry_changes: int
    field_of_view: float
    range_min: float
    range_max: float
    no_echo: float | None
    limit: float
    shares: dict[str, float]
    percentiles: tuple[float, float, float]
    intensity: IntensityReport


@dataclass(frozen=True, slots=True)
class OdometryReport:
    """Odometry of one topic or transform: length of the path in m, turning in rad."""

    topic: str
    frames: str
    stamps: StampReport
    path_length: float
    turning: float


@dataclass(frozen=True, slots=True)
class ImuReport:
    """An IMU: yaw rate about the vertical axis of the base, rad/s."""

    topic: str
    frame_id: str
    stamps: StampReport
    yaw_rate_mean: float
    yaw_rate_extreme: float


@dataclass(frozen=True, slots=True)
class TransformReport:
    """A link of the frame tree: position in m, roll, pitch and yaw in rad, as first seen."""

    parent: str
    child: str
    topic: str
    static: bool
    moved: bool
    count: int
    position: tuple[float, float, float]
    rotation: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Plan:
    """What a map would be made from, or why that is not clear (`problem`, with a `hint`)."""

    scan_topic: str = ""
    odom_topic: str = ""
    imu_topic: str = ""
    base_from_laser: Pose2 = (0.0, 0.0, 0.0)
    sonar_topics: tuple[str, ...] = ()
    sonar_ring: str = ""
    points_topics: tuple[str, ...] = ()
    laser_height: float | None = None
    problem: str = ""
    hint: str = ""


@dataclass(frozen=True, slots=True)
class RecordingReport:
    """Everything `inspect_recording` finds out.

    Attributes
    ----------
    paths : tuple of str
        The files.
    format : str
        As in `RecordingInfo`.
    size : int
        Bytes on disk.
    begin, duration : float
        First record time (s since 1970 where the clock was set) and length, s.
    topics, scans, odometry, imus, transforms : tuple
        What was recorded.
    plan : Plan
        What `map` would use.
    dropped : dict
        Reason -> number of messages that cannot be used.
    warnings : tuple of str
        What a user should know.
    sonars : tuple of SonarReport
        The ring and the 3D sensors.
    damage : tuple of Damage
        What could not be read.
    """

    paths: tuple[str, ...]
    format: str
    size: int
    begin: float
    duration: float
    topics: tuple[TopicReport, ...]
    scans: tuple[ScanReport, ...]
    odometry: tuple[OdometryReport, ...]
    imus: tuple[ImuReport, ...]
    transforms: tuple[TransformReport, ...]
    plan: Plan
    dropped: dict[str, int]
    warnings: tuple[str, ...]
    sonars: tuple[SonarReport, ...] = ()
    damage: tuple[Damage, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON; infinite and undefined numbers become the strings "inf", "-inf" and "nan"."""
        plain: dict[str, Any] = _plain(asdict(self))
        return plain


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return value
