"""Reading whitespace-separated tables of numbers, with the line at fault in every complaint."""

import math
from pathlib import Path

import numpy as np

from glassslam.errors import GlassSlamError
from glassslam.records import FloatArray
from glassslam.regularfile import regular

_LARGEST = 1e100
"""Larger numbers are no measurements, and have no square."""


def read_text(path: str | Path, error: type[GlassSlamError]) -> str:
    """Content of a UTF-8 text file.

    Raises
    ------
    GlassSlamError
        Of the given kind, when the file cannot be read or is no text.
    """
    try:
        return regular(path).read_text(encoding="utf-8")
    except OSError as cause:
        raise error(f"cannot read {path}: {cause.strerror}") from cause
    except UnicodeDecodeError as cause:
        raise error(f"{path} is not a text file", f"byte {cause.start} is no UTF-8") from cause


def parse_numbers(fields: list[str], where: str, error: type[GlassSlamError]) -> list[float]:
    """Finite numbers of one line.

    Raises
    ------
    GlassSlamError
        Of the given kind, when a field is no finite number.
    """
    numbers = []
    for field in fields:
        try:
            number = float(field)
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            raise error(f"{where}: {field!r:.40} is not a finite number")
        if abs(number) > _LARGEST:
            raise error(f"{where}: {field!r:.40} is out of all proportion")
        numbers.append(number)
    return numbers


def read_table(path: str | Path, columns: tuple[str, ...], error: type[GlassSlamError]) -> FloatArray:
    """Rows of a text table, shape (n, len(columns)); what follows a # is a comment.

    Raises
    ------
    GlassSlamError
        Of the given kind, when the file cannot be read, is empty, or a line does not hold the columns.
    """
    rows = []
    for number, line in enumerate(read_text(path, error).splitlines(), start=1):
        fields = line.partition("#")[0].split()
        if not fields:
            continue
        where = f"{path}, line {number}"
        if len(fields) != len(columns):
            expected = " ".join(columns)
            raise error(f"{where}: {len(fields)} columns", f"expected {len(columns)}: {expected}")
        rows.append(parse_numbers(fields, where, error))
    if not rows:
        raise error(f"{path} holds no data", f"expected lines of: {' '.join(columns)}")
    return np.array(rows, dtype=np.float64)
