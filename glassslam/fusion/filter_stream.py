"""The scan filter in a stream of records: every scan meets the latest reading of every sonar."""

import math
from collections.abc import Iterable, Iterator

import numpy as np

from glassslam.config import ScanFilterConfig
from glassslam.fusion.scan_filter import FilteredScan, filter_scan
from glassslam.records import FloatArray, LaserScan, RangeRing, Record, SonarRing


class ScanFilter:
    """Keeps the latest reading of every sonar and filters scans with them.

    The ring of a Pioneer fires its sonars in turn, so the readings that belong to a scan come from several
    sweeps; a reading older than `max_pairing_time` is not used.

    Parameters
    ----------
    base_from_laser : ndarray of float64, shape (3,)
        Pose of the laser in the base frame, m and rad.
    ring : SonarRing
        Where the sonars sit in the base frame.
    config : ScanFilterConfig
        Thresholds.

    Attributes
    ----------
    glass_sectors, corner_sectors : int
        Sectors drawn as glass so far, and sectors put back as corners.
    """

    def __init__(self, base_from_laser: FloatArray, ring: SonarRing, config: ScanFilterConfig) -> None:
        self._base_from_laser = np.asarray(base_from_laser, dtype=np.float64)
        self._ring, self._config = ring, config
        self._ranges = np.full(len(ring.poses), np.nan)
        self._stamps = np.full(len(ring.poses), -math.inf)
        self.glass_sectors = self.corner_sectors = 0

    def add_sweep(self, sweep: RangeRing) -> None:
        """Take the new readings of a sweep; those that are NaN leave the ones before."""
        fresh = ~np.isnan(sweep.ranges)
        self._ranges[fresh] = sweep.ranges[fresh]
        self._stamps[fresh] = sweep.stamp

    def filter(self, scan: LaserScan) -> FilteredScan:
        """The scan with the glass drawn that the readings of its time tell."""
        old = np.abs(scan.stamp - self._stamps) > self._config.max_pairing_time
        ranges = np.where(old, np.nan, self._ranges)
        filtered = filter_scan(scan, self._base_from_laser, self._ring, ranges, self._config)
        self.glass_sectors += int(filtered.glass.sum())
        self.corner_sectors += int(filtered.corner.sum())
        return filtered


def filtered_records(
    records: Iterable[Record], base_from_laser: FloatArray, ring: SonarRing, config: ScanFilterConfig
) -> Iterator[Record]:
    """The records with their scans filtered, if `config` enables the filter.

    Parameters
    ----------
    records : iterable of Record
        In the order of the recording.
    base_from_laser : ndarray of float64, shape (3,)
        Pose of the laser in the base frame, m and rad.
    ring : SonarRing
        Where the sonars sit in the base frame.
    config : ScanFilterConfig
        Switch and thresholds.
    """
    if not config.enabled:
        yield from records
        return
    scan_filter = ScanFilter(base_from_laser, ring, config)
    for record in records:
        if isinstance(record, RangeRing):
            scan_filter.add_sweep(record)
        yield scan_filter.filter(record).scan if isinstance(record, LaserScan) else record
