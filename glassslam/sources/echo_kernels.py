"""Kernels over the packed echoes of a multi-echo scan: `n` times (`m`, then `m` floats), twice."""

import numpy as np
from numpy.typing import NDArray

from glassslam.accelerate import kernel
from glassslam.records import Float32Array

FIRST = 0
LAST = 1
STRONGEST = 2


@kernel
def _skip_echoes(words: NDArray[np.uint32], position: int) -> int:
    """Position after a sequence of beams that starts with their number; -1 when cut off."""
    if position < 0 or position >= words.size:
        return -1
    beams = int(np.int64(words[position]))
    position += 1
    for _ in range(beams):
        if position >= words.size:
            return -1
        position += 1 + int(np.int64(words[position]))
    return position if position <= words.size else -1


@kernel
def count_beams(words: NDArray[np.uint32]) -> tuple[int, int]:
    """Number of beams with ranges and of beams with intensities; (-1, -1) when the data is cut off."""
    second = _skip_echoes(words, 0)
    if _skip_echoes(words, second) < 0:
        return -1, -1
    return int(np.int64(words[0])), int(np.int64(words[second]))


@kernel
def pick_echoes(
    words: NDArray[np.uint32],
    values: Float32Array,
    mode: int,
    ranges: Float32Array,
    intensities: Float32Array,
) -> None:
    """Write one echo of each beam; `words` and `values` are the same memory, checked by `count_beams`.

    The strongest echo is the first where intensities do not belong to the beams one by one.
    """
    position, strength = 1, _skip_echoes(words, 0) + 1
    paired = ranges.size == intensities.size
    for beam in range(ranges.size):
        echoes = int(np.int64(words[position]))
        chosen = echoes - 1 if mode == LAST else 0
        if paired:
            strengths = int(np.int64(words[strength]))
            if mode == STRONGEST:
                for k in range(1, min(echoes, strengths)):
                    if values[strength + 1 + k] > values[strength + 1 + chosen]:
                        chosen = k
            intensities[beam] = values[strength + 1 + chosen] if 0 <= chosen < strengths else 0.0
            strength += 1 + strengths
        ranges[beam] = values[position + 1 + chosen] if echoes > 0 else np.inf
        position += 1 + echoes
    if not paired:
        intensities[:] = 0.0
