"""Where around the laser a surface is looked for."""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from glassslam.errors import UsageError
from glassslam.records import FloatArray

AHEAD = math.radians(30.0)
_TURN = 2.0 * math.pi
_HINT = "LOW:HIGH in deg, like -30:30, or X0,Y0,X1,Y1 in m, like 0.5,-1,2,1, both in the frame of the laser"


@dataclass(frozen=True, slots=True)
class Roi:
    """A range of bearings and perhaps a box, in the frame of the laser.

    Attributes
    ----------
    low, high : float
        First and last bearing, counter-clockwise, rad; at most a full turn apart.
    box : tuple of float or None
        Least and greatest x and y of the returns (x0, y0, x1, y1), m.
    """

    low: float
    high: float
    box: tuple[float, float, float, float] | None = None

    @classmethod
    def ahead(cls, yaw: float = 0.0) -> Self:
        """30 deg to both sides of a bearing, rad."""
        return cls(yaw - AHEAD, yaw + AHEAD)

    @classmethod
    def parse(cls, text: str) -> Self:
        """Region of an option: "LOW:HIGH" in deg, or "X0,Y0,X1,Y1" in m.

        Raises
        ------
        UsageError
            The text has neither form, or the region is empty.
        """
        if (bearings := _numbers(text, ":", 2)) is not None:
            low, high = (math.radians(value) for value in bearings)
            high = high if high > low else high + _TURN
            if not low < high <= low + _TURN + 1e-9:
                raise UsageError(f"--roi {text}: more than a full turn", _HINT)
            return cls(low, high)
        if (corners := _numbers(text, ",", 4)) is not None:
            x0, y0, x1, y1 = corners
            box = (min(x0, x1), min(y0, y1), max(x0, x1), max(y0, y1))
            if box[0] == box[2] or box[1] == box[3]:
                raise UsageError(f"--roi {text}: the box is empty", _HINT)
            return cls(*_bearings_of(box), box)
        raise UsageError(f"--roi {text}: no region", _HINT)

    @property
    def centre(self) -> float:
        """Middle bearing, rad."""
        return 0.5 * (self.low + self.high)

    @property
    def half_angle(self) -> float:
        """Half of the range of bearings, rad."""
        return 0.5 * (self.high - self.low)

    def covers(self, bearings: FloatArray) -> NDArray[np.bool_]:
        """Which of some bearings (rad) lie in the region."""
        turned = (bearings - self.centre + math.pi) % _TURN - math.pi
        return np.asarray(np.abs(turned) <= self.half_angle + 1e-9)

    def hide(self, ranges: FloatArray, bearings: FloatArray) -> FloatArray:
        """Ranges (m) with NaN in place of those that end outside of the region."""
        inside = self.covers(bearings)
        if self.box is not None:
            x0, y0, x1, y1 = self.box
            x, y = ranges * np.cos(bearings), ranges * np.sin(bearings)
            inside &= (x >= x0) & (x <= x1) & (y >= y0) & (y <= y1)
        return np.where(inside, ranges, np.nan)

    def __str__(self) -> str:
        if self.box is not None:
            return "in the box " + ",".join(f"{value:g}" for value in self.box)
        return f"at bearings from {math.degrees(self.low):.0f} to {math.degrees(self.high):.0f} deg"


def _numbers(text: str, separator: str, count: int) -> list[float] | None:
    parts = text.split(separator)
    if len(parts) != count:
        return None
    try:
        values = [float(part) for part in parts]
    except ValueError:
        return None
    return values if all(map(math.isfinite, values)) else None


def _bearings_of(box: tuple[float, float, float, float]) -> tuple[float, float]:
    """Bearings between which a box is seen, rad; all of them where it holds the laser."""
    x0, y0, x1, y1 = box
    if x0 <= 0.0 <= x1 and y0 <= 0.0 <= y1:
        return -math.pi, math.pi
    middle = math.atan2(0.5 * (y0 + y1), 0.5 * (x0 + x1))
    corners = [math.atan2(y, x) - middle for x in (x0, x1) for y in (y0, y1)]
    turned = [(corner + math.pi) % _TURN - math.pi for corner in corners]
    return middle + min(turned), middle + max(turned)
