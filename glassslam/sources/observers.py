"""Running statistics over records: fed one by one, asked at the end."""

import math
from array import array
from collections.abc import Iterable
from typing import TypeVar

import numpy as np

from glassslam.geometry import wrap_angle
from glassslam.records import Float32Array, Imu, LaserScan, Odometry
from glassslam.sources.messages import upper_limit
from glassslam.sources.noecho import detect_no_echo
from glassslam.sources.report import ImuReport, IntensityReport, OdometryReport, ScanReport, Span
from glassslam.sources.sonarreport import StampReport

_R = TypeVar("_R")

_BINS_PER_M = 100
_FARTHEST_M = 200
_SAMPLES = 256
_DISTINCT_KEPT = 3
_GAP_PERIODS = 3.0


def gather(reports: Iterable[_R | None]) -> tuple[_R, ...]:
    """The reports of those observers that have seen anything."""
    return tuple(report for report in reports if report is not None)


class StampObserver:
    """Header stamps and record times of one topic."""

    def __init__(self) -> None:
        self._stamps = array("d")
        self._recorded = array("d")

    def add(self, stamp: float, recorded: float) -> None:
        """Take in the next message."""
        self._stamps.append(stamp)
        self._recorded.append(recorded)

    def report(self) -> StampReport:
        """What was seen."""
        stamps, recorded = np.array(self._stamps), np.array(self._recorded)
        steps, offsets = np.diff(stamps), recorded - stamps
        forward = steps[steps > 0]
        period, mean = (float(np.median(forward)), float(np.mean(forward))) if forward.size else (0.0, 0.0)
        return StampReport(
            count=stamps.size,
            period=period,
            backward=int(np.sum(steps < 0)),
            equal=int(np.sum(steps == 0)),
            largest_step_back=float(-np.min(steps, initial=0.0)),
            gaps=int(np.sum(steps > _GAP_PERIODS * max(period, mean))),
            longest_gap=float(np.max(steps, initial=0.0)),
            offset=float(np.median(offsets)) if offsets.size else 0.0,
            offset_min=float(np.min(offsets)) if offsets.size else 0.0,
            offset_max=float(np.max(offsets)) if offsets.size else 0.0,
        )


class IntensityObserver:
    """Intensities of one topic, next to the ranges they came with."""

    def __init__(self) -> None:
        self._beams = 0
        self._minimum, self._maximum = math.inf, -math.inf
        self._at_maximum = 0
        self._distinct: set[float] = set()
        self._equals_range = True

    def add(self, intensities: Float32Array, ranges: Float32Array) -> None:
        """Take in the next scan."""
        equal = intensities.size == ranges.size and np.array_equal(intensities, ranges, equal_nan=True)
        self._equals_range = self._equals_range and (bool(equal) or intensities.size == 0)
        intensities = intensities[np.isfinite(intensities)]
        if intensities.size == 0:
            return
        self._beams += intensities.size
        highest = float(np.max(intensities))
        if highest > self._maximum:
            self._maximum, self._at_maximum = highest, 0
        if highest == self._maximum:
            self._at_maximum += int(np.sum(intensities == highest))
        self._minimum = min(self._minimum, float(np.min(intensities)))
        if len(self._distinct) < _DISTINCT_KEPT:
            self._distinct.update(np.unique(intensities)[:_DISTINCT_KEPT].tolist())

    def report(self) -> IntensityReport:
        """What was seen."""
        if self._beams == 0:
            return IntensityReport("none", 0.0, 0.0, 0.0)
        share = self._at_maximum / self._beams
        return IntensityReport(self._verdict(), self._minimum, self._maximum, share)

    def _verdict(self) -> str:
        if self._equals_range:
            return "equal to range"
        if len(self._distinct) == 1:
            return "constant" if self._maximum or self._minimum else "all zero"
        return "two-valued" if len(self._distinct) == 2 else "informative"


class ScanObserver:
    """Scans of one topic, as their headers describe them."""

    def __init__(self, topic: str) -> None:
        self._topic = topic
        self._stamps = StampObserver()
        self._intensity = IntensityObserver()
        self._first: LaserScan | None = None
        self._last: tuple[int, float, float] | None = None
        self._changes = 0
        self._low = np.full(4, np.inf)
        self._high = np.full(4, -np.inf)
        self._histogram = np.zeros(_FARTHEST_M * _BINS_PER_M + 1, dtype=np.int64)
        self._counts = {"beams": 0, "nan": 0, "inf": 0, "too_near": 0}
        self._samples: list[Float32Array] = []
        self._seen, self._step = 0, 1

    def add(self, scan: LaserScan) -> None:
        """Take in the next scan."""
        self._first = self._first or scan
        self._stamps.add(scan.stamp, scan.record_stamp)
        self._intensity.add(scan.intensities, scan.ranges)
        self._add_geometry(scan)
        self._add_ranges(scan)
        if self._seen % self._step == 0:
            self._samples.append(scan.ranges)
            if len(self._samples) == 2 * _SAMPLES:
                self._samples, self._step = self._samples[::2], 2 * self._step
        self._seen += 1

    def _add_geometry(self, scan: LaserScan) -> None:
        geometry = (scan.ranges.size, scan.angle_min, scan.angle_increment)
        self._changes += self._last is not None and geometry != self._last
        self._last = geometry
        values = np.array([*geometry, scan.time_increment])
        self._low, self._high = np.minimum(self._low, values), np.maximum(self._high, values)

    def _add_ranges(self, scan: LaserScan) -> None:
        ranges = scan.ranges
        near = (ranges < scan.range_min) | (ranges <= 0)
        infinite = np.isposinf(ranges)
        usable = ranges[np.isfinite(ranges) & ~near]
        bins = np.rint(np.minimum(usable, _FARTHEST_M) * _BINS_PER_M).astype(np.int64)
        self._histogram += np.bincount(
            np.minimum(bins, self._histogram.size - 1), minlength=self._histogram.size
        )
        self._counts["beams"] += ranges.size
        self._counts["nan"] += int(np.isnan(ranges).sum())
        self._counts["inf"] += int(infinite.sum())
        self._counts["too_near"] += int(near.sum())

    def report(self) -> ScanReport | None:
        """What was seen; None without a scan."""
        first = self._first
        if first is None:
            return None
        no_echo = detect_no_echo(self._samples)
        limit = upper_limit(first.range_max, no_echo.ceiling)
        (beams, angle, increment, time) = zip(self._low.tolist(), self._high.tolist(), strict=True)
        shares, percentiles = self._ranges(limit)
        return ScanReport(
            topic=self._topic,
            frame_id=first.frame_id,
            stamps=self._stamps.report(),
            beams=(int(beams[0]), int(beams[1])),
            angle_min=_span(angle),
            angle_increment=_span(increment),
            time_increment=_span(time),
            geometry_changes=self._changes,
            field_of_view=abs(first.angle_increment) * (first.ranges.size - 1),
            range_min=first.range_min,
            range_max=first.range_max,
            no_echo=no_echo.value,
            limit=limit,
            shares=shares,
            percentiles=percentiles,
            intensity=self._intensity.report(),
        )

    def _ranges(self, limit: float) -> tuple[dict[str, float], tuple[float, float, float]]:
        cut = round(min(limit, _FARTHEST_M) * _BINS_PER_M)
        valid = self._histogram[:cut]
        beams = max(1, self._counts["beams"])
        silent = int(self._histogram[cut:].sum()) + self._counts["inf"]
        shares = {
            "valid": float(valid.sum()) / beams,
            "no_echo": silent / beams,
            "nan": self._counts["nan"] / beams,
            "too_near": self._counts["too_near"] / beams,
        }
        reached = np.cumsum(valid)
        if not reached.size or reached[-1] == 0:
            return shares, (math.nan, math.nan, math.nan)
        low, middle, high = (
            float(np.searchsorted(reached, q * reached[-1])) / _BINS_PER_M for q in (0.05, 0.5, 0.95)
        )
        return shares, (low, middle, high)


def _span(values: tuple[float, ...]) -> Span:
    return values[0], values[1]


class OdometryObserver:
    """Odometry of one topic."""

    def __init__(self, topic: str, frames: str = "") -> None:
        self._topic, self._frames = topic, frames
        self._stamps = StampObserver()
        self._last: tuple[float, float, float] | None = None
        self._length, self._turning = 0.0, 0.0

    def add(self, odometry: Odometry) -> None:
        """Take in the next pose."""
        self._stamps.add(odometry.stamp, odometry.record_stamp)
        if self._last is not None:
            length, turn = math.dist(self._last[:2], odometry.pose[:2]), odometry.pose[2] - self._last[2]
            # a pose that is not finite, or absurdly far away, is no travel
            if math.isfinite(length) and math.isfinite(turn):
                self._length += length
                self._turning += abs(float(wrap_angle(turn)))
        self._last = odometry.pose

    def report(self) -> OdometryReport | None:
        """What was seen; None without a pose."""
        if self._last is None:
            return None
        return OdometryReport(self._topic, self._frames, self._stamps.report(), self._length, self._turning)


class ImuObserver:
    """An IMU of one topic."""

    def __init__(self, topic: str, frame_id: str) -> None:
        self._topic, self._frame_id = topic, frame_id
        self._stamps = StampObserver()
        self._sum, self._extreme, self._count = 0.0, 0.0, 0

    def add(self, imu: Imu) -> None:
        """Take in the next rate."""
        self._stamps.add(imu.stamp, imu.record_stamp)
        self._sum += imu.yaw_rate
        self._count += 1
        if abs(imu.yaw_rate) > abs(self._extreme):
            self._extreme = imu.yaw_rate

    def report(self) -> ImuReport | None:
        """What was seen; None without a rate."""
        if self._count == 0:
            return None
        mean = self._sum / self._count
        return ImuReport(self._topic, self._frame_id, self._stamps.report(), mean, self._extreme)
