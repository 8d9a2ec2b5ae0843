"""What a beam met: one label per beam of a scan."""

import math
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

INVALID: Final = 0
SOLID: Final = 1
GLASS: Final = 2
GHOST: Final = 3
NO_RETURN: Final = 4

NAMES: Final = ("invalid", "solid", "glass", "ghost", "no_return")


def base_labels(ranges: ArrayLike, *, range_min: float = 0.0, no_echo: float = math.inf) -> NDArray[np.uint8]:
    """Sort beams into solid, without return and invalid, before any glass is looked for.

    Parameters
    ----------
    ranges : array_like, shape (n,)
        Ranges of one scan, m.
    range_min, no_echo : float
        Nearer readings are invalid; ranges from `no_echo` on mean that nothing came back, m.

    Returns
    -------
    ndarray of uint8, shape (n,)
        SOLID, NO_RETURN (+inf or at least `no_echo`) or INVALID (NaN, -inf, 0, below `range_min`).

    Examples
    --------
    >>> base_labels([1.0, np.inf, 0.0, np.nan, 12.0], no_echo=10.0).tolist()
    [1, 4, 0, 0, 4]
    """
    values = np.asarray(ranges, dtype=np.float64)
    labels = np.full(values.shape, SOLID, dtype=np.uint8)
    labels[~(values >= range_min) | (values <= 0.0)] = INVALID
    labels[values >= no_echo] = NO_RETURN
    return labels
