"""The diffuse curve of a sensor from all recordings of a calibration."""

import math
from collections.abc import Sequence

import numpy as np

from detectors.diffuse import DiffuseCurve
from detectors.diffuse_fit import SurfaceSamples, fit_diffuse_curve, surface_samples
from detectors.panes import PaneProfile
from glassslam.calibration.reading import Reading
from glassslam.calibration.views import View
from glassslam.errors import CalibrationError
from glassslam.records import FloatArray, LaserScan


def first_curve(readings: Sequence[Reading]) -> tuple[DiffuseCurve, SurfaceSamples]:
    """Curve of whatever is flat in all scans: most of it is matte.

    Raises
    ------
    CalibrationError
        There are too few flat surfaces.
    """
    samples = joined([flat_samples(scan) for reading in readings for scan in reading.scans])
    try:
        return fit_diffuse_curve(samples), samples
    except ValueError as error:
        raise CalibrationError(
            f"too few flat surfaces in the recordings: {error}", "record longer, or with walls in sight"
        ) from error


def final_curve(
    views: Sequence[tuple[Reading, list[View]]], curve: DiffuseCurve, samples: SurfaceSamples
) -> tuple[DiffuseCurve, SurfaceSamples]:
    """Curve without the known panes and what is behind them.

    Matte walls that were faced on purpose settle it at their ranges, other surfaces beyond them.

    Parameters
    ----------
    views : sequence of (Reading, list of View)
        All sessions.
    curve, samples : DiffuseCurve, SurfaceSamples
        To fall back on where the panes leave too little.
    """
    walls, others = [], []
    for reading, seen in views:
        for view in seen:
            profiles = view.profiles(curve)
            if reading.session.material == "matte":
                walls += [_wall_samples(profile) for profile in profiles]
            else:
                others.append(flat_samples(view.scan, _hidden(view, profiles)))
    matte, rest = joined(walls), joined(others)
    if matte.ranges.size:
        beyond = (rest.ranges < matte.ranges.min()) | (rest.ranges > matte.ranges.max())
        rest = SurfaceSamples(rest.ranges[beyond], rest.intensities[beyond], rest.incidences[beyond])
    used = joined([matte, rest])
    try:
        return fit_diffuse_curve(used), used
    except ValueError:
        return curve, samples


def flat_samples(scan: LaserScan, ranges: FloatArray | None = None) -> SurfaceSamples:
    """Returns of one scan, or of other ranges at its beams, that lie on flat surfaces."""
    return surface_samples(
        [(scan.ranges if ranges is None else ranges, scan.intensities)],
        scan.angle_min,
        scan.angle_increment,
        range_min=scan.range_min,
        no_echo=scan.range_max,
    )


def joined(samples: Sequence[SurfaceSamples]) -> SurfaceSamples:
    """All samples in one."""
    none = np.empty(0)
    return SurfaceSamples(
        np.concatenate([none, *(part.ranges for part in samples)]),
        np.concatenate([none, *(part.intensities for part in samples)]),
        np.concatenate([none, *(part.incidences for part in samples)]),
    )


def _hidden(view: View, profiles: Sequence[PaneProfile]) -> FloatArray:
    ranges = view.scan.ranges.astype(np.float64)
    if view.through is not None:
        ranges[view.through] = math.nan
    for profile in profiles:
        ranges[profile.beams[profile.answered | profile.passed]] = math.nan
    return ranges


def _wall_samples(profile: PaneProfile) -> SurfaceSamples:
    seen = profile.answered & (profile.intensities > 0.0)
    angles = profile.angles[seen]
    return SurfaceSamples(profile.distance / np.cos(angles), profile.intensities[seen], np.abs(angles))
