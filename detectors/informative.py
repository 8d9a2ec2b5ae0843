"""Whether the intensities of a recording tell anything about surfaces."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from detectors.detection import FloatArray

Kind: TypeAlias = Literal[
    "informative", "empty", "not finite", "zero", "constant", "two-valued", "range", "saturated"
]

# share of beams at the highest value from which a mirror peak can no longer stand out
SATURATED_SHARE = 0.2
# share of beams that must follow the range before the intensity is called a copy of it
COPY_SHARE = 0.98
MOST_SCANS = 50


@dataclass(frozen=True, slots=True)
class Verdict:
    """Whether intensities are of use, and why not.

    Attributes
    ----------
    informative : bool
        Whether glass can be looked for in them.
    kind : str
        "informative" or what is wrong: "empty", "not finite", "zero", "constant", "two-valued", "range",
        "saturated".
    reason : str
        One sentence for a person.
    """

    informative: bool
    kind: Kind
    reason: str

    def __bool__(self) -> bool:
        return self.informative


def is_intensity_informative(scans: Iterable[tuple[ArrayLike, ArrayLike]]) -> Verdict:
    """Judge the intensities of a recording from some of its scans.

    Parameters
    ----------
    scans : iterable of (ranges, intensities)
        Scans of one recording, m and unit of the sensor; the first 50 are looked at. Only beams with a finite
        range above 0 count.

    Returns
    -------
    Verdict
        True in a condition when the intensities are of use.

    Raises
    ------
    ValueError
        The intensities of a scan are neither absent nor one per range.

    Examples
    --------
    >>> is_intensity_informative([([1.0, 2.0, 3.0], [])]).reason
    'the recording has no intensities'
    >>> bool(is_intensity_informative([([1.0, 2.0, 3.0], [900.0, 400.0, 250.0])]))
    True
    """
    ranges, intensities = _gather(scans)
    if intensities.size == 0:
        return Verdict(False, "empty", "the recording has no intensities")
    finite = np.isfinite(intensities)
    if not finite.any():
        return Verdict(False, "not finite", "no intensity is a finite number")
    return _judge(ranges[finite], intensities[finite])


def _gather(scans: Iterable[tuple[ArrayLike, ArrayLike]]) -> tuple[FloatArray, FloatArray]:
    kept: list[tuple[FloatArray, FloatArray]] = []
    for number, (scan, echoes) in enumerate(scans):
        if number >= MOST_SCANS:
            break
        ranges = np.asarray(scan, dtype=np.float64)
        intensities = np.asarray(echoes, dtype=np.float64)
        if intensities.size == 0:
            continue
        if intensities.shape != ranges.shape:
            raise ValueError(f"{intensities.size} intensities do not fit {ranges.size} ranges")
        valid = np.isfinite(ranges) & (ranges > 0.0)
        kept.append((ranges[valid], intensities[valid]))
    if not kept:
        return np.empty(0), np.empty(0)
    return np.concatenate([r for r, _ in kept]), np.concatenate([i for _, i in kept])


def _judge(ranges: FloatArray, intensities: FloatArray) -> Verdict:
    values, counts = np.unique(intensities, return_counts=True)
    if values.size == 1:
        if values[0] == 0.0:
            return Verdict(False, "zero", "all intensities are 0")
        return Verdict(False, "constant", f"all intensities are {values[0]:g}")
    if values.size == 2:
        return Verdict(
            False, "two-valued", f"the intensities know two values only, {values[0]:g} and {values[1]:g}"
        )
    ratio = intensities / ranges
    scale = float(np.median(ratio))
    if scale > 0.0 and np.mean(np.abs(ratio - scale) < 1e-3 * scale) >= COPY_SHARE:
        return Verdict(False, "range", "the intensities are a copy of the ranges")
    share = counts[-1] / intensities.size
    if share >= SATURATED_SHARE:
        return Verdict(False, "saturated", f"{share:.0%} of the intensities are saturated at {values[-1]:g}")
    return Verdict(True, "informative", f"{values.size} distinct intensities up to {values[-1]:g}")
