"""What a recording says of its own sensor: the diffuse curve, and which detector suits."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from detectors.calibration import Calibration
from detectors.diffuse_fit import fit_diffuse_curve, surface_samples
from detectors.informative import Verdict, is_intensity_informative

# beyond this step a pane near by answers with too few beams to show its lobe
COARSEST_STEP = math.radians(0.75)
MOST_SCANS = 100


def suggest_detector(verdict: Verdict, angle_increment: float) -> str:
    """Name the detector for a recording without a calibration.

    Parameters
    ----------
    verdict : Verdict
        On its intensities.
    angle_increment : float
        Step between beams, rad.

    Returns
    -------
    str
        "off" without informative intensities: narrow returns alone would change the maps of sensors that see
        no glass at all. Otherwise "calibrated_peak" for fine and "narrow_return" for coarse scans.

    Examples
    --------
    >>> suggest_detector(Verdict(True, "informative", ""), math.radians(0.25))
    'calibrated_peak'
    """
    if not verdict.informative:
        return "off"
    return "calibrated_peak" if abs(angle_increment) <= COARSEST_STEP else "narrow_return"


def self_calibration(
    name: str,
    scans: Sequence[tuple[ArrayLike, ArrayLike]],
    angle_min: float,
    angle_increment: float,
    *,
    range_min: float = 0.05,
    range_max: float = math.inf,
    no_echo: float | None = None,
) -> Calibration:
    """Calibrate a sensor from an ordinary recording, in which most surfaces are matte.

    Parameters
    ----------
    name : str
        Of the sensor or recording.
    scans : sequence of (ranges, intensities)
        At most 100 of them, spread evenly, are used.
    angle_min, angle_increment : float
        Angle of the first beam and step between beams, rad.
    range_min, range_max : float
        Limits of the sensor, m.
    no_echo : float or None
        Range written for beams without echo, m; None: `range_max` and above.

    Returns
    -------
    Calibration
        With the diffuse curve and the detector that suits; thresholds keep their defaults.

    Raises
    ------
    ValueError
        The intensities are not informative, or too few flat surfaces are seen.
    """
    chosen = scans[:: max(1, len(scans) // MOST_SCANS)]
    verdict = is_intensity_informative(chosen)
    if not verdict.informative:
        raise ValueError(f"no calibration without informative intensities: {verdict.reason}")
    limit = range_max if no_echo is None else min(range_max, no_echo)
    samples = surface_samples(chosen, angle_min, angle_increment, range_min=range_min, no_echo=limit)
    echoes = np.concatenate([np.asarray(i, dtype=np.float64) for _, i in chosen])
    positive = echoes[np.isfinite(echoes) & (echoes > 0.0)]
    return Calibration(
        name,
        fit_diffuse_curve(samples),
        beams=max(np.size(r) for r, _ in chosen),
        angle_increment=abs(angle_increment),
        range_min=range_min,
        range_max=range_max,
        no_echo=no_echo,
        floor=float(positive.min()),
        detector=suggest_detector(verdict, angle_increment),
        evidence={"scans": len(chosen), "surface_beams": int(samples.ranges.size)},
    )
