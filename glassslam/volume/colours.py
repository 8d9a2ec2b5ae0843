"""Colours of heights."""

import numpy as np
from numpy.typing import NDArray

from glassslam.records import Float32Array, FloatArray

_STOPS = np.array([0.0, 0.25, 0.5, 0.75, 1.0])
# violet, blue, green, orange, red: of rising luminance up to the middle, told apart in print
_RAMP = np.array(
    [[70, 20, 120], [40, 90, 210], [20, 170, 110], [240, 170, 30], [210, 40, 40]], dtype=np.float64
)


def height_colours(heights: Float32Array | FloatArray, low: float, high: float) -> NDArray[np.uint8]:
    """Red, green and blue (..., 3) of heights (...), from violet at `low` over green to red at `high`, m."""
    share = (np.asarray(heights, dtype=np.float64) - low) / max(high - low, 1e-9)
    channels = [np.interp(share, _STOPS, _RAMP[:, k]) for k in range(3)]
    return np.rint(np.stack(channels, axis=-1)).astype(np.uint8)
