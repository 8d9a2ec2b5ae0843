"""A growable probability grid with odds updates (Hess et al. 2016, section IV)."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from glassslam.errors import GridError, MapSizeError
from glassslam.grid.kernels import Cells, extend_box, insert_scan
from glassslam.grid.odds import OddsModel
from glassslam.records import Float32Array, FloatArray

_MARGIN_CELLS = 48
_CROP_MARGIN_CELLS = 3  # the bicubic neighbourhood of a border cell stays inside
MOST_CELLS = 200_000_000
"""Largest grid: 700 m x 700 m in cells of 5 cm."""
_BYTES_PER_CELL = 8  # its value, the mark of the last scan, and P(occupied)
_FARTHEST_CELL = 2.0**40
_LAST_MARK = np.iinfo(np.uint16).max

_TOO_FAR = (
    "are ranges or odometry wrong? lower sensor.max_range, or raise map.resolution and submap.resolution"
)

__all__ = ["MOST_CELLS", "OddsModel", "ProbabilityGrid", "check_size", "point_array"]


def point_array(points: Any) -> FloatArray:
    """Points (n, 2) as the kernels need them; an empty sequence is no point.

    Raises
    ------
    GridError
        The shape is another one.
    """
    array = np.ascontiguousarray(points, dtype=np.float64)
    if array.size == 0:
        return np.empty((0, 2))
    if array.ndim != 2 or array.shape[1] != 2:
        raise GridError(f"points of shape {array.shape}", "give an array of shape (n, 2)")
    return array


def check_size(columns: float, rows: float, resolution: float) -> None:
    """Refuse a grid of more than `MOST_CELLS` before memory is asked for.

    Raises
    ------
    MapSizeError
        It would have more cells than that; the message tells metres and gigabytes.
    """
    if columns * rows > MOST_CELLS:
        gigabytes = columns * rows * _BYTES_PER_CELL / 1e9
        raise MapSizeError(
            f"a map of {columns * resolution:.0f} x {rows * resolution:.0f} m in cells of "
            f"{resolution:g} m would take {gigabytes:.1f} GB",
            _TOO_FAR,
        )


class ProbabilityGrid:
    """A probability grid that grows with what is entered.

    Parameters
    ----------
    resolution : float
        Cell edge, m.
    odds : OddsModel
        Update and clamp of the cells.
    silent_stop : float, optional
        P(occupied) of the cells at which rays without echo end; by default they end nowhere. Dark and far
        walls often give no echo: silence is no proof against a wall that others have seen.

    Attributes
    ----------
    origin : ndarray of float64, shape (2,)
        Lower left corner of the cell (0, 0), m; always a whole number of cells from (0, 0).
    cells : ndarray of uint16, shape (rows, columns)
        Columns run along x, rows along y; 0 is never observed, see `OddsModel.table` for the rest.
    table : ndarray of float32
        P(occupied) of every cell value, as scan matching reads it.

    Raises
    ------
    GridError
        A resolution that is not positive.

    Examples
    --------
    >>> import numpy as np
    >>> grid = ProbabilityGrid(0.05)
    >>> grid.insert(np.zeros(2), np.array([[1.0, 0.0]]), np.empty((0, 2)))
    >>> bool(grid.probability_at(np.array([[1.0, 0.0]]))[0] > 0.5)
    True
    """

    def __init__(
        self, resolution: float = 0.05, odds: OddsModel | None = None, *, silent_stop: float | None = None
    ) -> None:
        if not (np.isfinite(resolution) and resolution > 0):
            raise GridError(f"resolution of a grid is {resolution} m", "it must be positive")
        self.resolution = resolution
        self.odds = odds or OddsModel()
        self.table = self.odds.table()
        self.origin = np.zeros(2)
        self.cells: Cells = np.zeros((0, 0), dtype=np.uint16)
        self._marks: Cells = np.zeros((0, 0), dtype=np.uint16)
        self._mark = 0
        known = self.table[1:-1]
        barrier = (
            self.odds.locked + 1 if silent_stop is None else 1 + int(np.searchsorted(known, silent_stop))
        )
        self._steps = (self.odds.hit_step, self.odds.miss_step, self.odds.prior, self.odds.top, barrier)

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

        Raises
        ------
        GridError
            A coordinate that is not finite, an array of another shape, or a grid that would be larger than
            `MOST_CELLS`, which then stays as it is.
        """
        sensor, hits, free_ends = point_array([sensor])[0], point_array(hits), point_array(free_ends)
        self._contain(sensor, hits, free_ends)
        if self._mark == _LAST_MARK:
            self._marks[:] = 0
            self._mark = 0
        self._mark += 1
        hit, miss, prior, top, barrier = self._steps
        insert_scan(
            self.cells, self._marks, np.uint16(self._mark), sensor - self.origin, hits - self.origin,
            free_ends - self.origin, 1.0 / self.resolution, hit, miss, prior, top, barrier,
        )  # fmt: skip

    def lock(self, points: FloatArray) -> None:
        """Occupy the cells of points for good: neither returns nor rays change them afterwards.

        Parameters
        ----------
        points : ndarray of float64, shape (n, 2)
            Points in the frame of the grid, m.

        Raises
        ------
        GridError
            A coordinate that is not finite, or an array of another shape.
        """
        points = point_array(points)
        if len(points) == 0:
            return
        self._contain(points[0], points, points[:0])
        index = np.floor((points - self.origin) / self.resolution).astype(np.int64)
        self.cells[index[:, 1], index[:, 0]] = self.odds.locked

    def finish(self) -> None:
        """Crop to the observed cells and drop what only insertion needs."""
        self._marks = np.zeros((0, 0), dtype=np.uint16)
        rows, columns = np.flatnonzero(self.cells.any(axis=1)), np.flatnonzero(self.cells.any(axis=0))
        if rows.size == 0:
            return
        first = np.array([columns[0], rows[0]]) - _CROP_MARGIN_CELLS
        last = np.array([columns[-1], rows[-1]]) + 1 + _CROP_MARGIN_CELLS
        low, high = np.maximum(first, 0), np.minimum(last, self.cells.shape[::-1])
        inside = self.cells[low[1] : high[1], low[0] : high[0]]
        # a copy even where nothing is cut: a view would keep the large grid alive
        self.cells = _padded(inside, low - first, last - high)
        self.origin = self._corner_moved_by(first)

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
        box = np.concatenate((sensor, sensor))
        finite = extend_box(hits, box) & extend_box(free_ends, box) & bool(np.isfinite(sensor).all())
        if not finite:
            raise GridError("scan with a coordinate that is not finite", "leave out invalid beams")
        if max(map(abs, box.tolist())) > _FARTHEST_CELL * self.resolution:
            raise GridError(f"scan with a coordinate of {np.abs(box).max():.3g} m", _TOO_FAR)
        if self.cells.size == 0:
            self.origin = np.floor(sensor / self.resolution) * self.resolution
        if self._marks.shape != self.cells.shape:  # finished before
            self._marks, self._mark = np.zeros_like(self.cells), 0
        first = np.floor((box[:2] - self.origin) / self.resolution).astype(np.int64)
        last = np.floor((box[2:] - self.origin) / self.resolution).astype(np.int64)
        size = np.array(self.cells.shape[::-1])
        before = np.where(first < 2, _MARGIN_CELLS - np.minimum(first, 0), 0)
        after = np.where(last >= size - 2, np.maximum(_MARGIN_CELLS + last - size, 0), 0)
        if before.any() or after.any():
            columns, rows = (size + before + after).tolist()
            check_size(columns, rows, self.resolution)
            self.cells = _padded(self.cells, before, after)
            self._marks = _padded(self._marks, before, after)
            self.origin = self._corner_moved_by(-before)

    def _corner_moved_by(self, columns_and_rows: NDArray[np.int64]) -> FloatArray:
        """Origin moved by whole cells, the same bits whatever way the grid came to its size."""
        corner = np.rint(self.origin / self.resolution) + columns_and_rows
        return np.asarray(corner * self.resolution)


def _padded(cells: Cells, before: NDArray[np.int64], after: NDArray[np.int64]) -> Cells:
    """Copy of cells with unknown ones around; (columns, rows) before and after."""
    size = cells.shape[::-1] + before + after
    out = np.zeros((size[1], size[0]), dtype=np.uint16)
    out[before[1] : before[1] + cells.shape[0], before[0] : before[0] + cells.shape[1]] = cells
    return out
