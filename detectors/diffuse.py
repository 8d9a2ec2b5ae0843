"""How bright a matte wall is at each range: the unit in which calibrated detectors measure."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from detectors.detection import FloatArray


@dataclass(frozen=True, slots=True)
class DiffuseCurve:
    """Intensity of ordinary matte surfaces against range.

    Attributes
    ----------
    ranges : tuple of float
        Increasing ranges, m.
    levels : tuple of float
        Intensity at these ranges at normal incidence, unit of the sensor; between them the curve is straight,
        outside it stays at the end values.
    incidence_exponent : float
        k in intensity = level * cos(incidence)^k; sensors compress their intensities, so it is far below 1.
    spread : float
        Standard deviation of the natural logarithm of intensities about the curve.

    Raises
    ------
    ValueError
        The curve has no points, or they are out of order, not positive or unequal in number.
    """

    ranges: tuple[float, ...]
    levels: tuple[float, ...]
    incidence_exponent: float = 0.0
    spread: float = 0.2

    def __post_init__(self) -> None:
        if not self.ranges or len(self.ranges) != len(self.levels):
            raise ValueError(
                f"a diffuse curve needs as many levels as ranges, not {len(self.levels)}, {len(self.ranges)}"
            )
        if min(self.levels) <= 0.0 or any(b <= a for a, b in zip(self.ranges, self.ranges[1:], strict=False)):
            raise ValueError("ranges of a diffuse curve must increase and levels be positive")

    def level(self, ranges: ArrayLike) -> FloatArray:
        """Intensity of a matte surface at normal incidence.

        Parameters
        ----------
        ranges : array_like
            Ranges, m; non-finite ones are taken as far away.

        Returns
        -------
        ndarray of float64
            Expected intensities, same shape.

        Examples
        --------
        >>> DiffuseCurve((1.0, 3.0), (4000.0, 3000.0)).level([0.5, 2.0, np.inf]).tolist()
        [4000.0, 3500.0, 3000.0]
        """
        return np.asarray(np.interp(np.asarray(ranges, dtype=np.float64), self.ranges, self.levels))
