"""Kernels of the max grids that bound the scores of branch and bound (Hess et al. 2016, section V)."""

import numpy as np
from numpy.typing import NDArray

from glassslam.accelerate import kernel
from glassslam.grid.kernels import Cells
from glassslam.records import Float32Array

Bytes = NDArray[np.uint8]


@kernel
def _larger(a: Bytes, b: Bytes, out: Bytes) -> None:
    """Elementwise maximum; a function of its own so that the compiler takes many cells at a time."""
    for k in range(out.size):
        out[k] = max(a[k], b[k])


@kernel
def max_over_windows(source: Bytes, shift: int, out: Bytes) -> None:
    """Maxima over windows of twice the edge, from a grid of maxima over windows of edge `shift`.

    out[y, x] = max of source at the four corners (y or y + shift, x or x + shift), cut at the border.
    """
    rows, columns = source.shape
    both = np.empty(columns + shift, dtype=np.uint8)
    for y in range(rows):
        _larger(source[y], source[min(y + shift, rows - 1)], both[:columns])
        both[columns:] = both[columns - 1]
        _larger(both[:columns], both[shift:], out[y])


@kernel
def quantise(cells: Cells, scores: Float32Array, factor: int, pad: int, out: Bytes) -> None:
    """Scores of a cell grid as bytes, the maximum of each factor x factor block, `pad` zeros around."""
    rows, columns = cells.shape
    for y in range(rows):
        for x in range(columns):
            value = cells[y, x]
            if value:
                byte = np.uint8(scores[value] * 255.0 + 0.5)
                r, c = y // factor + pad, x // factor + pad
                out[r, c] = max(out[r, c], byte)
