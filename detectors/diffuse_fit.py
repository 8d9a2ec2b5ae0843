"""The diffuse curve of a sensor from its scans: most of what a lidar sees is matte."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from detectors.beams import checked_scan, directions
from detectors.detection import FloatArray
from detectors.diffuse import DiffuseCurve
from detectors.surface_kernels import local_incidence

WINDOW = 0.20
FLATNESS = 0.02
STEEPEST = math.radians(75.0)
# the level is taken where the incidence hardly matters, the exponent from all of it
NEARLY_NORMAL = math.radians(35.0)
BINS_PER_DOUBLING = 3
LEAST_IN_BIN = 40
KNOTS = 12
ROUNDS = 20
# histogram of the logarithms of intensities, its smoothing in steps, and what counts beside its highest peak
_MODE_STEP = 0.04
_MODE_REACH = 6
_MODE_SHARE = 0.3


@dataclass(frozen=True, slots=True)
class SurfaceSamples:
    """Returns from flat surfaces.

    Attributes
    ----------
    ranges, intensities, incidences : ndarray of float64, shape (n,)
        Metres, unit of the sensor, rad.
    """

    ranges: FloatArray
    intensities: FloatArray
    incidences: FloatArray


def surface_samples(
    scans: Iterable[tuple[ArrayLike, ArrayLike]],
    angle_min: float,
    angle_increment: float,
    *,
    range_min: float = 0.05,
    no_echo: float = math.inf,
) -> SurfaceSamples:
    """Collect the returns that lie on flat surfaces, with their incidence.

    Parameters
    ----------
    scans : iterable of (ranges, intensities)
        Scans of one sensor, m and unit of the sensor.
    angle_min, angle_increment : float
        Angle of the first beam and step between beams, rad.
    range_min, no_echo : float
        Nearer readings are invalid; ranges from `no_echo` on mean that nothing came back, m.
    """
    kept: list[FloatArray] = [np.empty((3, 0))]
    for scan, echoes in scans:
        ranges, intensities, labels = checked_scan(scan, echoes, range_min, no_echo)
        cosines, sines = directions(ranges.size, angle_min, angle_increment)
        incidence, spread = np.empty_like(ranges), np.empty_like(ranges)
        local_incidence(ranges, labels, cosines, sines, WINDOW, incidence, spread)
        flat = (spread < FLATNESS) & (incidence < STEEPEST) & (intensities > 0.0)
        kept.append(np.stack((ranges[flat], intensities[flat], incidence[flat])))
    return SurfaceSamples(*np.concatenate(kept, axis=1))


def fit_diffuse_curve(samples: SurfaceSamples) -> DiffuseCurve:
    """Fit the intensity of matte surfaces against range and incidence.

    In every bin of range the brightest mode of the logarithms is taken: glass, and all that is seen through
    it, is fainter, metal is brighter but spreads out. A quadratic in the logarithm of the range is laid
    through the modes.

    Parameters
    ----------
    samples : SurfaceSamples
        From any recordings of one sensor.

    Returns
    -------
    DiffuseCurve
        Over the ranges that occurred.

    Raises
    ------
    ValueError
        No bin holds enough returns.
    """
    logs = np.log(samples.intensities)
    tilt = np.log(np.cos(samples.incidences))
    exponent = 0.0
    for _ in range(2):
        square = samples.incidences < NEARLY_NORMAL
        centres, modes, weights = _modes(samples.ranges[square], (logs - exponent * tilt)[square])
        coefficients = _robust_polynomial(np.log(centres), modes, weights)
        residuals = logs - np.polyval(coefficients, np.log(np.clip(samples.ranges, centres[0], centres[-1])))
        exponent = _slope(tilt, residuals)
    about = residuals - exponent * tilt
    near = about[np.abs(about) < 1.0]
    spread = 1.4826 * float(np.median(np.abs(near - np.median(near))))
    knots = np.geomspace(centres[0], centres[-1], KNOTS) if centres.size > 1 else centres
    brightest = float(samples.intensities.max())
    levels = np.minimum(np.exp(np.polyval(coefficients, np.log(knots))), brightest)
    return DiffuseCurve(
        tuple(round(float(r), 3) for r in knots),
        tuple(float(f"{v:.4g}") for v in levels),
        round(exponent, 3),
        round(spread, 3),
    )


def _modes(ranges: FloatArray, logs: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    bins = np.floor(BINS_PER_DOUBLING * np.log2(np.maximum(ranges, 1e-3))).astype(int)
    rows = [
        (math.exp(float(np.mean(np.log(ranges[bins == b])))), brightest_mode(logs[bins == b]), float(n))
        for b, n in zip(*np.unique(bins, return_counts=True), strict=True)
        if n >= LEAST_IN_BIN
    ]
    if not rows:
        raise ValueError(f"a diffuse curve needs {LEAST_IN_BIN} returns from flat surfaces at some range")
    centres, modes, counts = np.array(rows).T
    return centres, modes, np.sqrt(np.minimum(counts, 2000.0))


def brightest_mode(values: FloatArray) -> float:
    """The highest value around which many of a sample gather.

    Glass, what stands behind it, and dark paint are all fainter than a matte wall and may well be more
    numerous; what is brighter - metal, reflectors, the mirror peaks of panes - gathers nowhere.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Logarithms of intensities, at least one.
    """
    low = float(values.min()) - _MODE_REACH * _MODE_STEP
    bins = int((float(values.max()) - low) / _MODE_STEP) + _MODE_REACH + 1
    counts = np.bincount(((values - low) / _MODE_STEP).astype(np.int64), minlength=bins).astype(np.float64)
    offsets = np.arange(-_MODE_REACH, _MODE_REACH + 1)
    density = np.convolve(counts, np.exp(-2.0 * (offsets / (0.5 * _MODE_REACH)) ** 2), mode="same")
    high = density >= _MODE_SHARE * density.max()
    rising = np.concatenate(([True], density[1:] >= density[:-1]))
    falling = np.concatenate((density[:-1] >= density[1:], [True]))
    peak = low + _MODE_STEP * (float(np.flatnonzero(high & rising & falling)[-1]) + 0.5)
    return float(values[np.abs(values - peak) <= 0.5 * _MODE_REACH * _MODE_STEP].mean())


def _robust_polynomial(x: FloatArray, y: FloatArray, weights: FloatArray) -> FloatArray:
    degree = 0 if x.size < 3 else 1 if x.size < 5 else 2
    trust = np.ones_like(y)
    coefficients = np.zeros(degree + 1)
    for _ in range(ROUNDS):
        coefficients = np.polyfit(x, y, degree, w=weights * np.sqrt(trust))
        trust = 1.0 / (1.0 + ((y - np.polyval(coefficients, x)) / 0.15) ** 2) ** 2
    return np.asarray(coefficients, dtype=np.float64)


def _slope(tilt: FloatArray, residuals: FloatArray) -> float:
    """Exponent of the cosine: a robust line through the origin."""
    trust = np.ones_like(tilt)
    slope = 0.0
    for _ in range(ROUNDS):
        total = float(np.sum(trust * tilt * tilt))
        slope = float(np.sum(trust * tilt * residuals)) / total if total > 0.0 else 0.0
        trust = 1.0 / (1.0 + ((residuals - slope * tilt) / 0.2) ** 2) ** 2
    return min(max(slope, 0.0), 2.0)
