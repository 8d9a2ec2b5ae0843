"""Kernel that reads the numbers of a text line."""

import numpy as np
from numpy.typing import NDArray

from glassslam.accelerate import kernel
from glassslam.records import FloatArray

# Powers of ten up to here and integers up to 2^53 are exact in float64: so is the rounding of their quotient,
# and a number comes out as the standard library would read it.
_EXACT_POWERS = 10.0 ** np.arange(19)
_MOST_DIGITS = 18
_EXACT_INTEGER = 2**53


@kernel
def parse_decimals(text: NDArray[np.uint8], start: int, out: FloatArray) -> int:
    """Read plain decimal numbers separated by blanks into `out`; returns how many.

    Stops at the first token that is anything else (a word, an exponent, too many digits), or when `out`
    is full.
    """
    position, count = start, 0
    while count < out.size:
        while position < text.size and (text[position] == 32 or text[position] == 9):
            position += 1
        negative = position < text.size and text[position] == 45
        if negative:
            position += 1
        mantissa, digits, decimals, point = 0, 0, 0, False
        while position < text.size:
            symbol = int(text[position])
            if 48 <= symbol <= 57:
                mantissa = mantissa * 10 + (symbol - 48)
                digits += 1
                decimals += point
            elif symbol == 46 and not point:
                point = True
            else:
                break
            position += 1
        at_end = position >= text.size or text[position] in (32, 9, 10, 13)
        if digits == 0 or digits > _MOST_DIGITS or mantissa > _EXACT_INTEGER or not at_end:
            return count
        value = mantissa / _EXACT_POWERS[decimals]
        out[count] = -value if negative else value
        count += 1
    return count
