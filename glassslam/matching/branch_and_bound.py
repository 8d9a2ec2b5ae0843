"""Loop-closure search: a scan against a finished grid by branch and bound (Hess et al. 2016, section V)."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glassslam.grid.probability_grid import ProbabilityGrid, point_array
from glassslam.matching.pyramid_kernels import max_over_windows, quantise
from glassslam.matching.search_kernels import branch_and_bound, discretise
from glassslam.records import Float32Array, FloatArray


@dataclass(frozen=True, slots=True)
class SearchMatch:
    """What a correlative search found.

    Attributes
    ----------
    pose : ndarray of float64, shape (3,)
        Pose of the scan in the frame of the grid, m and rad; on the raster of the search.
    score : float
        Mean occupancy score of the cells the points fall into, in [0, 1]; see `occupancy_scores`.
    """

    pose: FloatArray
    score: float


def occupancy_scores(table: Float32Array) -> Float32Array:
    """Score in [0, 1] of every cell value: 0 up to P(occupied) = 0.35 and when unknown, 1 from 0.65 on.

    A wall passed at speed is hit a few times only; scoring probabilities themselves would rank a
    true match there below a wrong one along a well-observed wall.
    """
    scores = np.clip((table - 0.35) / 0.3, 0.0, 1.0)
    scores[0] = 0.0
    return np.asarray(scores, dtype=np.float32)


class BranchAndBoundMatcher:
    """Search of scans in one finished grid.

    Parameters
    ----------
    grid : ProbabilityGrid
        The grid; later changes to it are not seen.
    max_linear_window : float
        Largest half width of a search, m.
    coarsening : int
        Cells of the grid in one search cell, along each axis.

    Examples
    --------
    >>> import numpy as np
    >>> wall = np.stack((np.linspace(-2, 2, 200), np.full(200, 1.52)), axis=1)
    >>> corner = np.concatenate((wall, np.stack((np.full(100, 2.02), np.linspace(-1, 1.5, 100)), axis=1)))
    >>> grid = ProbabilityGrid(0.05)
    >>> for _ in range(20):
    ...     grid.insert(np.zeros(2), corner, np.empty((0, 2)))
    >>> match = BranchAndBoundMatcher(grid).match(corner, np.array([0.8, -0.5, 0.1]), 1.5, 0.3, 0.5)
    >>> bool(np.abs(match.pose).max() < 0.1)
    True
    """

    def __init__(self, grid: ProbabilityGrid, max_linear_window: float = 7.0, coarsening: int = 2) -> None:
        self.cell = grid.resolution * coarsening
        self.origin = grid.origin.copy()
        self._reach = math.ceil(max_linear_window / self.cell)
        depth = max(self._reach, 1).bit_length()
        self._pad = 2 * self._reach + (1 << depth)
        rows, columns = (-(-n // coarsening) for n in grid.cells.shape)
        self._shape = (rows, columns)
        shape = (rows + 2 * self._pad, columns + 2 * self._pad)
        levels = np.zeros((depth, *shape), dtype=np.uint8)
        quantise(grid.cells, occupancy_scores(grid.table), coarsening, self._pad, levels[0])
        for h in range(1, depth):
            max_over_windows(levels[h - 1], 1 << (h - 1), levels[h])
        self._stride = shape[1]
        self._levels: NDArray[np.uint8] = levels.reshape(depth, -1)

    @property
    def max_linear_window(self) -> float:
        """Largest half width of a search, m."""
        return self._reach * self.cell

    @property
    def nbytes(self) -> int:
        """Memory held by the max grids."""
        return int(self._levels.nbytes)

    def match(
        self,
        points: FloatArray,
        guess: FloatArray,
        linear_window: float,
        angular_window: float,
        min_score: float,
    ) -> SearchMatch | None:
        """Best pose within a window around a guess.

        Parameters
        ----------
        points : ndarray of float64, shape (n, 2)
            The scan in its own frame, m.
        guess : ndarray of float64, shape (3,)
            Pose of the scan in the frame of the grid, m and rad.
        linear_window, angular_window : float
            Half widths of the window, m and rad; the linear one at most that of the matcher.
        min_score : float
            Poses scoring less are not looked for.

        Returns
        -------
        SearchMatch or None
            None when no pose in the window scores `min_score`.
        """
        points = point_array(points)
        if len(points) == 0:
            return None
        farthest = float(np.sqrt((points**2).sum(axis=1).max()))
        step = self.cell / max(farthest, 4 * self.cell)
        half = math.ceil(angular_window / step)
        count = 2 * half + 1
        window = min(math.ceil(linear_window / self.cell), self._reach)
        index = np.empty((count, len(points)), dtype=np.int32)
        lengths = np.empty(count, dtype=np.int64)
        corner = guess[:2] - self.origin
        discretise(
            points, corner[0], corner[1], guess[2] - half * step, step, count, 1.0 / self.cell,
            *self._shape, self._pad, self._reach + (1 << (len(self._levels) - 1)), index, lengths,
        )  # fmt: skip
        start = max(window, 1).bit_length() - 1
        found = np.zeros(3, dtype=np.int64)
        # scores are whole numbers; those of `min_score` itself count
        threshold = math.ceil(min_score * 255.0 * len(points) - 1e-6) - 1
        best = branch_and_bound(self._levels, self._stride, index, lengths, window, start, threshold, found)
        if best <= threshold:
            return None
        pose = np.array(
            [
                guess[0] + found[1] * self.cell,
                guess[1] + found[2] * self.cell,
                guess[2] + (found[0] - half) * step,
            ]
        )
        return SearchMatch(pose, best / (255.0 * len(points)))
