"""What `inspect_recording` finds out of times and of sonar, as plain data."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class StampReport:
    """The header stamps of a topic, in the order of the recording.

    Attributes
    ----------
    count : int
        Readable messages.
    period : float
        Median time between two, s.
    backward, equal : int
        Stamps that step back, and that repeat the one before.
    largest_step_back : float
        The longest of these steps, s.
    gaps : int
        Intervals above three times the median and the mean.
    longest_gap : float
        The longest interval, s.
    offset, offset_min, offset_max : float
        Record time minus header stamp, median and extremes, s.
    """

    count: int
    period: float
    backward: int
    equal: int
    largest_step_back: float
    gaps: int
    longest_gap: float
    offset: float
    offset_min: float
    offset_max: float


@dataclass(frozen=True, slots=True)
class SonarReport:
    """A ring of sonars, or the 3D ultrasonic sensors of a recording.

    Attributes
    ----------
    topics : tuple of str
        Where they were published.
    ring : str
        Name of the ring, "as recorded" for one that has none; empty for 3D sensors.
    sonars : int
        Size of the ring; 0 for 3D sensors.
    stamps : StampReport
        Times of the messages.
    rate : float
        Messages per second, Hz.
    range_min, limit : float
        Shorter ranges are no readings, and from `limit` on nothing answered, m; NaN for 3D sensors.
    cycle : float
        Time within which a sonar repeats its last range instead of measuring, s; 0: it does not.
    shares : dict
        "echo" and "no_echo" among the new readings, "not_new" among all.
    points_per_message : float
        Mean number of points of 3D sensors.
    percentiles : tuple of float
        5, 50 and 95 % of the distances heard, to 1 cm; NaN without any.
    """

    topics: tuple[str, ...]
    ring: str
    sonars: int
    stamps: StampReport
    rate: float
    range_min: float
    limit: float
    cycle: float
    shares: dict[str, float]
    points_per_message: float
    percentiles: tuple[float, float, float]
