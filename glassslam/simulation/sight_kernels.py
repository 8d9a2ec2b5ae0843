"""Kernel of sight: the cells that rays pass on their way."""

import numpy as np
from numpy.typing import NDArray

from glassslam.accelerate import kernel
from glassslam.records import FloatArray


@kernel
def mark_rays(
    origins: FloatArray, angles: FloatArray, lengths: FloatArray, low: FloatArray, cell: float,
    seen: NDArray[np.bool_],
) -> None:  # fmt: skip
    """Mark the cells under rays, looked at every half cell; places outside the grid are passed over."""
    for k in range(angles.size):
        dx, dy = np.cos(angles[k]), np.sin(angles[k])
        for step in range(int(2.0 * lengths[k] / cell)):
            way = 0.5 * step * cell
            column = int(np.floor((origins[k, 0] + way * dx - low[0]) / cell))
            row = int(np.floor((origins[k, 1] + way * dy - low[1]) / cell))
            if 0 <= column < seen.shape[1] and 0 <= row < seen.shape[0]:
                seen[row, column] = True
