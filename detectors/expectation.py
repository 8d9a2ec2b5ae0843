"""What a detector does on scans whose panes are known."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from detectors.detection import Detection, FloatArray
from detectors.pane_lobe import CORE, faces
from detectors.panes import PaneProfile
from detectors.rates import Rate, wilson

ON_PANE = 0.15
# an observation may reach this far beyond the stated end of its pane, m
BEYOND_END = 0.25
# a pane is the harder to see the farther away it is: ends of the distances told apart, m
REACHES = (1.5, 3.0, 6.0, 10.0)


@dataclass(frozen=True, slots=True, eq=False)
class CalibrationScan:
    """One scan of a calibration recording.

    Attributes
    ----------
    ranges, intensities : ndarray, shape (n,)
        Metres and unit of the sensor.
    angle_min, angle_increment : float
        Angle of the first beam and step between beams, rad.
    panes : tuple of PaneProfile
        The known panes in it; returns elsewhere are known not to be glass.
    judged : ndarray of bool, shape (n,), or None
        Beams that are known to be glass or not; None: all. Observations of other beams count for nothing.
    place : hashable
        Scans of the same place are not independent of each other; None: a place of its own.
    """

    ranges: FloatArray
    intensities: FloatArray
    angle_min: float
    angle_increment: float
    panes: tuple[PaneProfile, ...] = ()
    judged: NDArray[np.bool_] | None = None
    place: object = None

    @property
    def is_judged(self) -> bool:
        """Whether any beam is known to be glass or not."""
        return self.judged is None or bool(self.judged.any())


@dataclass(frozen=True, slots=True)
class Expected:
    """What a detector does on the calibration recordings.

    Attributes
    ----------
    detection : Rate
        Panes seen at normal incidence that were found.
    false_alarm : Rate
        Judged scans with at least one observation off the known panes.
    by_distance : tuple of (float, Rate)
        The detection up to each of `REACHES` (m) and beyond the one before, where panes were seen.
    """

    detection: Rate
    false_alarm: Rate
    by_distance: tuple[tuple[float, Rate], ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers."""
        return {
            "detection": self.detection.to_dict(),
            "false_alarm": self.false_alarm.to_dict(),
            "by_distance": [{"to": reach, **rate.to_dict()} for reach, rate in self.by_distance],
        }


def expected(scans: Sequence[CalibrationScan], detect: Callable[[CalibrationScan], Detection]) -> Expected:
    """Count what a detector finds on scans whose panes are known.

    Parameters
    ----------
    scans : sequence of CalibrationScan
        With and without panes.
    detect : callable
        Scan -> Detection.
    """
    found, alarmed = _Trials(), _Trials()
    near = {reach: _Trials() for reach in REACHES}
    for scan in scans:
        detection = detect(scan)
        on = [_lies_on(detection, pane) for pane in scan.panes]
        for number, (pane, hits) in enumerate(zip(scan.panes, on, strict=True)):
            if faces(pane):
                success = bool((hits & _covers_foot(detection, pane)).any())
                found.add(success, scan.place, number)
                reach = next((reach for reach in REACHES if pane.distance <= reach), REACHES[-1])
                near[reach].add(success, scan.place, number)
        if scan.is_judged:
            off = ~np.any(on, axis=0) if on else np.ones(len(detection), dtype=bool)
            if scan.judged is not None:
                off &= scan.judged[detection.beam]
            alarmed.add(bool(off.any()), scan.place)
    by_distance = tuple((reach, rate) for reach in REACHES if (rate := near[reach].rate()).trials)
    return Expected(found.rate(), alarmed.rate(), by_distance)


class _Trials:
    """Successes and failures, and how many of them tell something new."""

    def __init__(self) -> None:
        self._successes = self._count = self._lone = 0
        self._places: set[object] = set()

    def add(self, success: bool, place: object, part: int = 0) -> None:
        """Count one trial at a place; None is a place of its own."""
        self._successes += success
        self._count += 1
        if place is None:
            self._lone += 1
        else:
            self._places.add((place, part))

    def rate(self) -> Rate:
        """Share and interval of what was counted."""
        return wilson(self._successes, self._count, len(self._places) + self._lone)


def _lies_on(detection: Detection, pane: PaneProfile) -> NDArray[np.bool_]:
    turned = detection.bearing - pane.normal
    behind = detection.range * np.cos(turned) - pane.distance
    along = detection.range * np.sin(turned)
    inside = (along > pane.along[0] - BEYOND_END) & (along < pane.along[1] + BEYOND_END)
    return np.asarray((np.abs(behind) < ON_PANE) & inside)


def _covers_foot(detection: Detection, pane: PaneProfile) -> NDArray[np.bool_]:
    away = np.abs(pane.distance * np.tan(np.clip(detection.bearing - pane.normal, -1.5, 1.5)))
    return np.asarray(away <= detection.extent + pane.distance * math.tan(2.0 * CORE))
