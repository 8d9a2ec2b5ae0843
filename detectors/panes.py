"""A known pane in a scan: finding it, and its brightness against the angle to its normal."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from detectors.beams import checked_scan, directions
from detectors.detection import FloatArray
from detectors.diffuse import DiffuseCurve
from detectors.labels import NO_RETURN, SOLID
from detectors.pane_lines import FIT_HALF_ANGLE, TOLERANCE, TOLERANCE_PER_METRE, fit_line

LEAST_BEAMS = 3
PROFILE_TO = math.radians(60.0)


@dataclass(frozen=True, slots=True, eq=False)
class PaneProfile:
    """The beams of one scan that cross a known pane.

    Attributes
    ----------
    normal : float
        Direction from the sensor to the pane along its normal, rad.
    distance : float
        Distance to the plane of the pane, m.
    angles : ndarray of float64, shape (n,)
        Angle between beam and normal, rad, increasing with the beam.
    intensities, levels : ndarray of float64, shape (n,)
        Intensity in the unit of the sensor and in units of the diffuse level at the pane.
    answered, passed : ndarray of bool, shape (n,)
        Whether the pane answered, or nothing did before the beam was through.
    beams : ndarray of int64, shape (n,)
        Indices of the beams in the scan.
    along : tuple of float
        Ends of the pane along its plane, m from the foot of the normal, counter-clockwise positive.
    """

    normal: float
    distance: float
    angles: FloatArray
    intensities: FloatArray
    levels: FloatArray
    answered: NDArray[np.bool_]
    passed: NDArray[np.bool_]
    beams: NDArray[np.int64]
    along: tuple[float, float] = (-math.inf, math.inf)


def find_pane(
    ranges: ArrayLike,
    intensities: ArrayLike,
    angle_min: float,
    angle_increment: float,
    *,
    curve: DiffuseCurve,
    distance: float,
    bearing: float = 0.0,
    half_angle: float = math.radians(30.0),
    tolerance: float = 0.15,
    range_min: float = 0.05,
    no_echo: float = math.inf,
) -> tuple[float, float] | None:
    """Find the pane that the sensor faces at a stated distance.

    Parameters
    ----------
    ranges, intensities : array_like, shape (n,)
        One scan, m and unit of the sensor.
    angle_min, angle_increment : float
        Angle of the first beam and step between beams, rad.
    curve : DiffuseCurve
        Of the sensor.
    distance : float
        Stated distance, m.
    bearing, half_angle : float
        Where to look, rad: straight ahead, 30 deg to both sides.
    tolerance : float
        Largest deviation from the stated distance, m.
    range_min, no_echo : float
        Nearer readings are invalid; ranges from `no_echo` on mean that nothing came back, m.

    Returns
    -------
    tuple of float or None
        Direction of its normal, rad, and distance along it, m; None when nothing answers there.
    """
    values, echoes, labels = checked_scan(ranges, intensities, range_min, no_echo)
    bearings = angle_min + angle_increment * np.arange(values.size)
    turned = (bearings - bearing + math.pi) % (2.0 * math.pi) - math.pi
    seen = (labels == SOLID) & (np.abs(turned) < half_angle) & (np.abs(values - distance) < tolerance)
    if np.count_nonzero(seen) < LEAST_BEAMS:
        return None
    levels = echoes / curve.level(values)
    best = int(np.flatnonzero(seen)[np.argmax(levels[seen])])
    window = max(LEAST_BEAMS, int(FIT_HALF_ANGLE / abs(angle_increment)))
    cosines, sines = directions(values.size, angle_min, angle_increment)
    normal, found, _, used = fit_line(
        values,
        labels,
        cosines,
        sines,
        levels,
        max(0, best - window),
        min(values.size, best + window + 1),
        float(bearings[best]),
        float(values[best]),
    )
    return (normal, found) if used >= LEAST_BEAMS and abs(found - distance) < tolerance else None


def pane_profile(
    ranges: ArrayLike,
    intensities: ArrayLike,
    angle_min: float,
    angle_increment: float,
    *,
    curve: DiffuseCurve,
    normal: float,
    distance: float,
    along: tuple[float, float] = (-math.inf, math.inf),
    range_min: float = 0.05,
    no_echo: float = math.inf,
) -> PaneProfile:
    """Read the beams that cross a pane whose plane is known.

    Parameters
    ----------
    ranges, intensities, angle_min, angle_increment, curve, range_min, no_echo
        As in `find_pane`.
    normal, distance : float
        Plane of the pane, rad and m.
    along : tuple of float
        Ends of the pane along its plane, m from the foot of the normal, counter-clockwise positive.
    """
    values, echoes, labels = checked_scan(ranges, intensities, range_min, no_echo)
    turned = angle_min + angle_increment * np.arange(values.size) - normal
    angles = (turned + math.pi) % (2.0 * math.pi) - math.pi
    inside = np.abs(angles) < PROFILE_TO
    place = distance * np.tan(np.where(inside, angles, 0.0))
    chosen = np.flatnonzero(inside & (place >= along[0]) & (place <= along[1]))
    chosen = chosen[np.argsort(angles[chosen], kind="stable")]
    phi = angles[chosen]
    tolerance = TOLERANCE + TOLERANCE_PER_METRE * distance
    silent = labels[chosen] == NO_RETURN
    solid = labels[chosen] == SOLID
    behind = np.where(solid, values[chosen], 0.0) * np.cos(phi) - distance
    return PaneProfile(
        normal=normal,
        distance=distance,
        angles=np.asarray(phi, dtype=np.float64),
        intensities=echoes[chosen],
        levels=echoes[chosen] / curve.level(distance / np.cos(phi)),
        answered=solid & (np.abs(behind) <= tolerance),
        passed=silent | (solid & (behind > 2.0 * tolerance)),
        beams=chosen,
        along=along,
    )
