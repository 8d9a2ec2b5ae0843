"""Errors common to the beams of a lidar: where a beam truly starts, points and ends."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from glassslam.config import SensorConfig
from glassslam.geometry import wrap_angle
from glassslam.records import FloatArray

if TYPE_CHECKING:  # runs that do not look for glass need not load what finds it
    from detectors.detection import Detection


def errors_of(config: SensorConfig) -> FloatArray:
    """Bearing cosine and sine (rad), lateral and range offset (m) of a configuration, shape (4,)."""
    return np.array([config.bearing_cosine, config.bearing_sine, config.lateral_offset, config.range_offset])


def true_bearings(angles: FloatArray, errors: FloatArray) -> FloatArray:
    """Directions in which beams announced at `angles` point, rad.

    Parameters
    ----------
    angles : ndarray of float64, shape (n,)
        Angles of the beams in the laser frame, rad.
    errors : ndarray of float64, shape (4,)
        As `errors_of` gives them.
    """
    return np.asarray(angles + errors[0] * np.cos(angles) + errors[1] * np.sin(angles))


def true_points(angles: FloatArray, ranges: FloatArray, errors: FloatArray) -> FloatArray:
    """Ends of beams in the laser frame, m, shape (n, 2).

    Parameters
    ----------
    angles, ranges : ndarray of float64, shape (n,)
        As announced, rad and m.
    errors : ndarray of float64, shape (4,)
        As `errors_of` gives them.
    """
    bearings, lengths = true_bearings(angles, errors), ranges + errors[3]
    cosine, sine = np.cos(bearings), np.sin(bearings)
    return np.stack((lengths * cosine - errors[2] * sine, lengths * sine + errors[2] * cosine), axis=-1)


def true_detection(found: "Detection", errors: FloatArray) -> "Detection":
    """A detection with the errors of the beams taken out of what it says of position and direction.

    A wall turns with the beam that meets it at right angles, which is the beam its normal points along.

    Parameters
    ----------
    found : Detection
        As found in the scan as announced.
    errors : ndarray of float64, shape (4,)
        As `errors_of` gives them.
    """
    if not errors.any() or len(found) == 0:
        return found
    x, y = true_points(found.bearing, found.range, errors).T
    distance = found.range * np.cos(found.incidence)
    normal = wrap_angle(true_bearings(found.normal, errors) + np.arctan2(errors[2], distance))
    bearing = np.arctan2(y, x)
    return replace(
        found, range=np.hypot(x, y), bearing=bearing, normal=normal,
        incidence=np.abs(wrap_angle(bearing - normal)),
    )  # fmt: skip
