"""Where the known surfaces are in every scan, and how they answer."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from detectors.beams import checked_scan, directions
from detectors.diffuse import DiffuseCurve
from detectors.pane_lines import fit_line
from detectors.panes import PaneProfile, find_pane, pane_profile
from glassslam.calibration.reading import Reading, bearings, opened, places_of
from glassslam.calibration.roi import Roi
from glassslam.records import LaserScan

# a stated distance may be wrong by this much, and by this share of it, m
TOLERANCE = 0.15
TOLERANCE_SHARE = 0.03
# a plane that is stated in a map may be moved so far onto the returns around it
MOST_SHIFT = 0.15
MOST_TURN = math.radians(6.0)
LEAST_BEAMS = 8


@dataclass(frozen=True, slots=True)
class Plane:
    """A surface in the frame of the laser.

    Attributes
    ----------
    normal, distance : float
        Direction from the laser along its normal, rad, and the distance along it, m.
    along : tuple of float
        Its ends, m from the foot of the normal, counter-clockwise positive.
    """

    normal: float
    distance: float
    along: tuple[float, float] = (-math.inf, math.inf)


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """One scan and the known surfaces in it.

    Attributes
    ----------
    scan : LaserScan
        A scan of a full turn begins behind the surface.
    planes : tuple of Plane
        Panes, or the matte wall.
    judged : ndarray of bool, shape (n,), or None
        Beams of which is known whether they meet glass; None: all.
    place : int
        Scans of the same place have the same number.
    through : ndarray of bool, shape (n,), or None
        Beams that have met a pane before they returned, at whatever incidence, where that is known.
    """

    scan: LaserScan
    planes: tuple[Plane, ...]
    judged: NDArray[np.bool_] | None
    place: int
    through: NDArray[np.bool_] | None = None

    def profiles(self, curve: DiffuseCurve) -> list[PaneProfile]:
        """The beams that cross the surfaces."""
        return [
            pane_profile(
                self.scan.ranges,
                self.scan.intensities,
                self.scan.angle_min,
                self.scan.angle_increment,
                curve=curve,
                normal=plane.normal,
                distance=plane.distance,
                along=plane.along,
                range_min=self.scan.range_min,
                no_echo=self.scan.range_max,
            )
            for plane in self.planes
        ]


def faced_views(reading: Reading, curve: DiffuseCurve) -> list[View]:
    """Find the surface that the laser faces at the stated distance in every scan of a session."""
    distance = reading.session.distance
    if distance is None:
        raise ValueError("the session has no stated distance")
    roi = region(reading)
    scans = [opened(scan, roi.centre) for scan in reading.scans]
    numbers = places_of(reading)
    return [
        View(scan, _faced(scan, curve, distance, roi), roi.covers(bearings(scan)), int(place))
        for scan, place in zip(scans, numbers, strict=True)
    ]


def plain_views(reading: Reading) -> list[View]:
    """The scans of a session in which no surface is known: none is judged, or all are without glass."""
    numbers = places_of(reading)
    clear = reading.session.material == "no-glass"
    return [
        View(scan, (), None if clear else np.zeros(len(scan.ranges), dtype=bool), int(place))
        for scan, place in zip(reading.scans, numbers, strict=True)
    ]


def region(reading: Reading) -> Roi:
    """Where the faced surface is looked for: as stated, or straight ahead of the robot."""
    return reading.session.roi or Roi.ahead(-reading.info.base_from_laser[2])


def tolerance(distance: float) -> float:
    """Largest deviation from a stated distance, m."""
    return TOLERANCE + TOLERANCE_SHARE * distance


def _faced(scan: LaserScan, curve: DiffuseCurve, distance: float, roi: Roi) -> tuple[Plane, ...]:
    found = find_pane(
        roi.hide(scan.ranges.astype(np.float64), bearings(scan)),
        scan.intensities,
        scan.angle_min,
        scan.angle_increment,
        curve=curve,
        distance=distance,
        bearing=roi.centre,
        half_angle=roi.half_angle,
        tolerance=tolerance(distance),
        range_min=scan.range_min,
        no_echo=scan.range_max,
    )
    return () if found is None else (Plane(*found),)


def nearest_surface(reading: Reading) -> float:
    """Median over the scans of the nearest range in the region, m; NaN where nothing answers there."""
    roi = region(reading)
    nearest: list[float] = []
    for scan in reading.scans:
        ranges = roi.hide(scan.ranges.astype(np.float64), bearings(scan))
        seen = ranges[(ranges >= max(scan.range_min, 1e-3)) & (ranges < scan.range_max)]
        if seen.size:
            nearest.append(float(np.min(seen)))
    return float(np.median(nearest)) if nearest else math.nan


def settled(scan: LaserScan, plane: Plane, curve: DiffuseCurve) -> Plane:
    """A stated plane laid onto the returns around it; as stated where there are too few."""
    ranges, echoes, labels = checked_scan(scan.ranges, scan.intensities, scan.range_min, scan.range_max)
    cosines, sines = directions(ranges.size, scan.angle_min, scan.angle_increment)
    first, last = _beams_of(scan, plane)
    if last - first < LEAST_BEAMS:
        return plane
    levels = echoes / curve.level(ranges)
    normal, distance, _, used = fit_line(
        ranges, labels, cosines, sines, levels, first, last, plane.normal, plane.distance
    )
    moved = abs(distance - plane.distance) > MOST_SHIFT or abs(normal - plane.normal) > MOST_TURN
    if used < LEAST_BEAMS or moved or not math.isfinite(distance):
        return plane
    shift = plane.distance * math.tan(normal - plane.normal)
    return Plane(normal, distance, (plane.along[0] - shift, plane.along[1] - shift))


def _beams_of(scan: LaserScan, plane: Plane) -> tuple[int, int]:
    """First beam that crosses a plane between its ends, and the one after the last, across no seam."""
    phi = (bearings(scan) - plane.normal + math.pi) % (2.0 * math.pi) - math.pi
    low, high = (math.atan2(end, plane.distance) for end in plane.along)
    inside = np.flatnonzero((phi >= low) & (phi <= high))
    if not inside.size:
        return 0, 0
    runs = np.split(inside, np.flatnonzero(np.diff(inside) > 1) + 1)
    longest = max(runs, key=len)
    return int(longest[0]), int(longest[-1]) + 1
