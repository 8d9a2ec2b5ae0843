"""Kernel of the checksum of write-ahead logs."""

import numpy as np
from numpy.typing import NDArray

from glassslam.accelerate import kernel


@kernel
def wal_checksum(words: NDArray[np.uint32], first: int, second: int) -> tuple[int, int]:
    """The two sums of a write-ahead log, carried on over more words ("WAL-mode File Format", section 4.2).

    Parameters
    ----------
    words : ndarray of uint32, shape (2 m,)
        What is summed up.
    first, second : int
        The sums so far.
    """
    for k in range(0, words.size, 2):
        first = (first + int(words[k]) + second) & 0xFFFFFFFF
        second = (second + int(words[k + 1]) + first) & 0xFFFFFFFF
    return first, second
