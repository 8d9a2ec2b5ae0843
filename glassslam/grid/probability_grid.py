"""A growable probability grid with odds updates (Hess et al. 2016, section IV; METHODS.md, section 0)."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glassslam.grid.kernels import LOG_ODDS_STEP, insert_scan
from glassslam.records import Float32Array, FloatArray

_MARGIN_CELLS = 48
_LAST_MARK = np.iinfo(np.uint16).max


def log_odds(probability: float) -> float:
    """Natural logarithm of p / (1 - p)."""
    return math.log(probability / (1.0 - probability))


@dataclass(frozen=True, slots=True)
class OddsModel:
    """How observations change a cell.

    Attributes
    ----------
    hit_probability, miss_probability : float
        P(occupied) after one return in, or one ray through, a cell of even odds.
    lower_probability, upper_probability : float
        Clamp of the cells.
    unknown_probability : float
        What a cell never observed reads as in scan matching.
    """

    hit_probability: float = 0.55
    miss_probability: float = 0.49
    lower_probability: float = 0.12
    upper_probability: float = 0.98
    unknown_probability: float = 0.5

    @property
    def hit_step(self) -> int:
        """Change of a cell value by a hit."""
        return round(log_odds(self.hit_probability) / LOG_ODDS_STEP)

    @property
    def miss_step(self) -> int:
        """Change of a cell value by a miss."""
        return round(log_odds(self.miss_probability) / LOG_ODDS_STEP)

    @property
    def prior(self) -> int:
        """Cell value of even odds."""
        return 1 + round(-log_odds(self.lower_probability) / LOG_ODDS_STEP)

    @property
    def top(self) -> int:
        """Largest cell value."""
        span = log_odds(self.upper_probability) - log_odds(self.lower_probability)
        return 1 + round(span / LOG_ODDS_STEP)

    def table(self) -> Float32Array:
        """P(occupied) of every cell value, shape (top + 1,); entry 0 is that of unknown cells."""
        odds = log_odds(self.lower_probability) + LOG_ODDS_STEP * np.arange(self.top)
        known = 1.0 / (1.0 + np.exp(-odds))
        return np.concatenate(([self.unknown_probability], known)).astype(np.float32)


class ProbabilityGrid:
    """A probability grid that grows with what is entered.

    Parameters
    ----------
    resolution : float
        Cell edge, m.
    odds : OddsModel
        Update and clamp of the cells.

    Examples
    --------
    >>> import numpy as np
    >>> grid = ProbabilityGrid(0.05)
    >>> grid.insert(np.zeros(2), np.array([[1.0, 0.0]]), np.empty((0, 2)))
    >>> bool(grid.probability_at(np.array([[1.0, 0.0]]))[0] > 0.5)
    True
    """

    def __init__(self, resolution: float = 0.05, odds: OddsModel | None = None) -> None:
        self.resolution = resolution
        self.odds = odds or OddsModel()
        self.table = self.odds.table()
        self.origin = np.zeros(2)
        self.cells: NDArray[np.uint16] = np.zeros((0, 0), dtype=np.uint16)
        self._marks: NDArray[np.uint16] = np.zeros((0, 0), dtype=np.uint16)
        self._mark = 0
        self._steps = (self.odds.hit_step, self.odds.miss_step, self.odds.prior, self.odds.top)

    def insert(self, sensor: FloatArray, hits: FloatArray, free_ends: FloatArray) -> None:
        """Enter one scan, each cell once, hits before misses.

        Parameters
        ----------
        sensor : ndarray of float64, shape (2,)
            Position of the sensor in the frame of the grid, m.
        hits : ndarray of float64, shape (n, 2)
            Returns in the frame of the grid, m.
        free_ends : ndarray of float64, shape (m, 2)
            Ends of the free space of beams without echo, m.
        """
        self._contain(sensor, hits, free_ends)
        if self._mark == _LAST_MARK:
            self._marks[:] = 0
            self._mark = 0
        self._mark += 1
        hit, miss, prior, top = self._steps
        insert_scan(
            self.cells, self._marks, np.uint16(self._mark), sensor - self.origin, hits - self.origin,
            free_ends - self.origin, 1.0 / self.resolution, hit, miss, prior, top,
        )  # fmt: skip

    def finish(self) -> None:
        """Crop to the observed cells and drop what only insertion needs."""
        rows, columns = np.flatnonzero(self.cells.any(axis=1)), np.flatnonzero(self.cells.any(axis=0))
        self._marks = np.zeros((0, 0), dtype=np.uint16)
        if rows.size == 0:
            return
        margin = 3  # the bicubic neighbourhood of a border cell stays inside
        r0, c0 = int(rows[0]) - margin, int(columns[0]) - margin
        r1, c1 = int(rows[-1]) + 1 + margin, int(columns[-1]) + 1 + margin
        cropped = np.zeros((r1 - r0, c1 - c0), dtype=np.uint16)
        inside = self.cells[max(r0, 0) : r1, max(c0, 0) : c1]
        top, left = max(-r0, 0), max(-c0, 0)
        cropped[top : top + inside.shape[0], left : left + inside.shape[1]] = inside
        self.cells = cropped
        self.origin = self.origin + np.array([c0, r0]) * self.resolution

    def probability(self) -> Float32Array:
        """P(occupied) of all cells, shape (rows, columns); NaN where never observed."""
        table = self.table.copy()
        table[0] = np.nan
        return np.asarray(table[self.cells])

    def probability_at(self, points: FloatArray) -> Float32Array:
        """P(occupied) at points (n, 2) in the frame of the grid, shape (n,); NaN where never observed."""
        index = np.floor((points - self.origin) / self.resolution).astype(np.int64)
        rows, columns = self.cells.shape
        inside = (index >= 0).all(axis=1) & (index[:, 0] < columns) & (index[:, 1] < rows)
        out = np.full(len(points), np.nan, dtype=np.float32)
        values = self.cells[index[inside, 1], index[inside, 0]]
        out[inside] = np.where(values == 0, np.nan, self.table[values])
        return out

    def _contain(self, sensor: FloatArray, hits: FloatArray, free_ends: FloatArray) -> None:
        """Grow until all points lie inside with a margin for the bicubic neighbourhood."""
        low, high = sensor.copy(), sensor.copy()
        for points in (hits, free_ends):
            if len(points):
                np.minimum(low, points.min(axis=0), out=low)
                np.maximum(high, points.max(axis=0), out=high)
        if self.cells.size == 0:
            self.origin = np.floor(sensor / self.resolution) * self.resolution
        first = np.floor((low - self.origin) / self.resolution).astype(np.int64)
        last = np.floor((high - self.origin) / self.resolution).astype(np.int64)
        rows, columns = self.cells.shape
        before = np.where(first < 2, _MARGIN_CELLS - np.minimum(first, 0), 0)
        after = np.where(last >= np.array([columns, rows]) - 2, _MARGIN_CELLS + last - [columns, rows], 0)
        after = np.maximum(after, 0)
        if before.any() or after.any():
            self._grow(before, after)

    def _grow(self, before: NDArray[np.int64], after: NDArray[np.int64]) -> None:
        widths = ((int(before[1]), int(after[1])), (int(before[0]), int(after[0])))
        self.cells = np.pad(self.cells, widths)
        self._marks = np.pad(self._marks, widths)
        self.origin = self.origin - before * self.resolution
