"""Lines of text logs, packed or not."""

import gzip
from collections.abc import Iterator
from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import NDArray

from glassslam.records import Float32Array
from glassslam.sources.failures import reading
from glassslam.sources.formats import GZIP_MAGIC, Piece


def text_lines(piece: Piece) -> Iterator[bytes]:
    """Lines of a text log, packed with gzip or not.

    Raises
    ------
    RecordingError
        The file cannot be read or unpacked to its end.
    """
    with reading(piece.path, piece.format), _open(piece.path) as file:
        yield from file


def single(values: NDArray[np.float64]) -> Float32Array:
    """Values of a text in single precision; what does not fit becomes infinite, as no sensor means it."""
    with np.errstate(over="ignore"):
        return values.astype(np.float32)


def _open(path: Path) -> IO[bytes]:
    with path.open("rb") as file:
        packed = file.read(2) == GZIP_MAGIC
    return gzip.open(path, "rb") if packed else path.open("rb")  # type: ignore[return-value]
