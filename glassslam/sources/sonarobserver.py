"""Running statistics over sonar readings: fed one by one, asked at the end."""

import math
from collections.abc import Sequence

import numpy as np

from glassslam.records import PointSet, RangeRing, SonarRing
from glassslam.sources.observers import StampObserver
from glassslam.sources.sonarfeed import SonarRecord
from glassslam.sources.sonarreport import SonarReport, StampReport
from glassslam.sources.sweeps import SweepRule

_BINS_PER_M = 100
_FARTHEST_M = 50


class SonarObserver:
    """Readings of a ring, or of the 3D sensors of a recording.

    Parameters
    ----------
    topics : sequence of str
        Where they were published.
    ring : SonarRing or None
        Where the sonars sit; None for 3D sensors.
    rule : SweepRule or None
        How ranges are read.
    """

    def __init__(self, topics: Sequence[str], ring: SonarRing | None, rule: SweepRule | None) -> None:
        self._topics, self._ring, self._rule = tuple(topics), ring, rule
        self._stamps = StampObserver()
        self._counts = {"echo": 0, "no_echo": 0, "not_new": 0}
        self._points = 0
        self._histogram = np.zeros(_FARTHEST_M * _BINS_PER_M + 1, dtype=np.int64)

    def add(self, record: SonarRecord) -> None:
        """Take in the next reading."""
        if isinstance(record, PointSet) != (self._ring is None):
            return
        self._stamps.add(record.stamp, record.record_stamp)
        if isinstance(record, RangeRing):
            self._add_ranges(record)
        else:
            self._points += len(record.points)
            self._add_distances(np.linalg.norm(record.points - record.origin, axis=1))

    def _add_ranges(self, record: RangeRing) -> None:
        heard = record.ranges[np.isfinite(record.ranges)]
        self._counts["echo"] += heard.size
        self._counts["no_echo"] += int(np.isposinf(record.ranges).sum())
        self._counts["not_new"] += int(np.isnan(record.ranges).sum())
        self._add_distances(heard.astype(np.float64))

    def _add_distances(self, distances: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> None:
        bins = np.clip(np.rint(distances * _BINS_PER_M), 0, self._histogram.size - 1).astype(np.int64)
        self._histogram += np.bincount(bins, minlength=self._histogram.size)

    def report(self) -> SonarReport | None:
        """What was seen; None without a reading."""
        stamps = self._stamps.report()
        if stamps.count == 0:
            return None
        ring, rule = self._ring, self._rule
        return SonarReport(
            topics=self._topics,
            ring="" if ring is None else ring.name or "as recorded",
            sonars=0 if ring is None else len(ring.poses),
            stamps=stamps,
            rate=_rate(stamps),
            range_min=math.nan if rule is None else rule.range_min,
            limit=math.nan if rule is None else rule.limit,
            cycle=0.0 if rule is None else rule.cycle,
            shares=self._shares(),
            points_per_message=self._points / stamps.count,
            percentiles=self._percentiles(),
        )

    def _shares(self) -> dict[str, float]:
        """Echoes and silent readings among the new ones; readings that are not new among all."""
        new = max(1, self._counts["echo"] + self._counts["no_echo"])
        total = max(1, sum(self._counts.values()))
        if self._ring is None:
            return {}
        return {
            "echo": self._counts["echo"] / new,
            "no_echo": self._counts["no_echo"] / new,
            "not_new": self._counts["not_new"] / total,
        }

    def _percentiles(self) -> tuple[float, float, float]:
        reached = np.cumsum(self._histogram)
        if reached[-1] == 0:
            return math.nan, math.nan, math.nan
        low, middle, high = (
            float(np.searchsorted(reached, q * reached[-1])) / _BINS_PER_M for q in (0.05, 0.5, 0.95)
        )
        return low, middle, high


def _rate(stamps: StampReport) -> float:
    return 1.0 / stamps.period if stamps.period > 0.0 else 0.0
