"""The lobe of known panes: how bright they are beside their normal."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from detectors.calibration import PaneModel
from detectors.detection import FloatArray
from detectors.panes import PaneProfile

# the mirror peak, the stretch of the lobe that is fitted, and the shoulders, rad
CORE = math.radians(1.5)
LOBE = (math.radians(2.0), math.radians(30.0))
SHOULDER = (math.radians(6.0), math.radians(25.0))
FAINT_LIMITS = (0.2, 0.6)
DEFAULT_FAINT = 0.45


def faces(pane: PaneProfile) -> bool:
    """Whether the pane answers at normal incidence."""
    return bool(core(pane).any())


def core(pane: PaneProfile) -> NDArray[np.bool_]:
    """Answers of the pane around its normal, where the mirror peak is."""
    return pane.answered & (np.abs(pane.angles) < CORE)


def fit_pane_lobe(pane: PaneProfile) -> tuple[float, float] | None:
    """Fit level = haze * exp(-decay * |angle|) to the answers of one pane.

    Parameters
    ----------
    pane : PaneProfile
        Any number of beams.

    Returns
    -------
    tuple of float or None
        Haze and decay (1/rad); None where fewer than 6 beams answer beside the mirror peak.
    """
    away = np.abs(pane.angles)
    used = pane.answered & (away > LOBE[0]) & (away < LOBE[1]) & (pane.levels > 0.0)
    if np.count_nonzero(used) < 6:
        return None
    x, y = away[used], np.log(pane.levels[used])
    trust = np.ones_like(y)
    slope = intercept = 0.0
    for _ in range(20):
        slope, intercept = np.polyfit(x, y, 1, w=np.sqrt(trust))
        trust = 1.0 / (1.0 + ((y - slope * x - intercept) / 0.25) ** 2)
    return math.exp(intercept), -float(slope)


def pane_model(profiles: Sequence[PaneProfile], lobes: FloatArray) -> PaneModel:
    """Median lobe and mirror peak of some panes; what no pane shows keeps its default."""
    peak = float(np.median([pane.levels[core(pane)].max() for pane in profiles]))
    if not len(lobes):
        return PaneModel(peak=round(peak, 2))
    haze, decay = np.median(lobes, axis=0)
    return PaneModel(round(float(haze), 3), round(float(decay), 2), round(peak, 2))


def faint_level(profiles: Sequence[PaneProfile]) -> float:
    """Half way, on the scale of logarithms, between the shoulders of panes and a matte wall, at 1."""
    shoulders = [
        pane.levels[pane.answered & (np.abs(pane.angles) > SHOULDER[0]) & (np.abs(pane.angles) < SHOULDER[1])]
        for pane in profiles
    ]
    levels = np.concatenate(shoulders)
    if levels.size == 0:
        return DEFAULT_FAINT
    middle = math.sqrt(max(float(np.percentile(levels, 75)), 1e-3))
    return round(float(np.clip(middle, *FAINT_LIMITS)), 3)
