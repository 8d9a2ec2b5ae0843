"""Ray casting against the surfaces of a floor plan."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from glassslam.records import FloatArray
from glassslam.simulation import raycast_kernels as kernels

_CELL = 0.5


@dataclass(frozen=True, slots=True)
class Hits:
    """What rays met.

    Attributes
    ----------
    distance : ndarray of float64, shape (n,)
        Metres along the ray, inf where it meets nothing.
    segment : ndarray of int64, shape (n,)
        Index of the segment met, -1 for none.
    cosine : ndarray of float64, shape (n,)
        Cosine of the angle between ray and surface normal, in [0, 1]; 0 for none.
    """

    distance: FloatArray
    segment: NDArray[np.int64]
    cosine: FloatArray


@dataclass(frozen=True, slots=True)
class SegmentGrid:
    """Segments sorted into square cells, so that a ray looks only at those on its way.

    Attributes
    ----------
    segments : ndarray of float64, shape (n, 4)
        End points, m.
    corner : ndarray of float64, shape (2,)
        Lower left corner of the cells, m.
    cell : float
        Edge of a cell, m.
    columns, rows : int
        Number of cells along x and y.
    first : ndarray of int64, shape (columns * rows + 1,)
        Start of each cell's list in `members`.
    members : ndarray of int64
        Indices of segments, cell by cell.
    """

    segments: FloatArray
    corner: FloatArray
    cell: float
    columns: int
    rows: int
    first: NDArray[np.int64]
    members: NDArray[np.int64]

    @classmethod
    def build(cls, segments: FloatArray, cell: float = _CELL) -> Self:
        """Sort segments of shape (n, 4) into cells of the given edge, m."""
        points = segments.reshape(-1, 2)
        corner = points.min(axis=0) - 0.5 * cell
        columns, rows = (int(n) for n in np.ceil((points.max(axis=0) - corner) / cell + 0.5))
        lists: list[list[int]] = [[] for _ in range(columns * rows)]
        for index, segment in enumerate(segments):
            for place in _touched(segment, corner, cell, columns):
                lists[place].append(index)
        counts = np.array([len(members) for members in lists])
        return cls(
            segments=np.ascontiguousarray(segments),
            corner=corner,
            cell=cell,
            columns=columns,
            rows=rows,
            first=np.concatenate(([0], np.cumsum(counts))).astype(np.int64),
            members=np.array([index for members in lists for index in members], dtype=np.int64),
        )

    def cast(self, origins: FloatArray, angles: FloatArray, beyond: FloatArray | float = 0.0) -> Hits:
        """First surface each ray meets.

        Parameters
        ----------
        origins : ndarray of float64, shape (n, 2)
            Where the rays start, world frame, m.
        angles : ndarray of float64, shape (n,)
            Their directions, rad.
        beyond : float or ndarray of float64, shape (n,)
            Only hits farther along the ray than this count, m: a beam that has passed a pane goes on.
        """
        n = angles.size
        hits = Hits(np.empty(n), np.empty(n, dtype=np.int64), np.empty(n))
        start = np.ascontiguousarray(np.broadcast_to(np.asarray(beyond, dtype=np.float64), (n,)))
        kernels.cast(
            np.ascontiguousarray(origins, dtype=np.float64), np.ascontiguousarray(angles, dtype=np.float64),
            start, self.segments, self.corner, self.cell, self.columns, self.rows, self.first, self.members,
            hits.distance, hits.segment, hits.cosine,
        )  # fmt: skip
        return hits


def clearance(points: FloatArray, segments: FloatArray) -> FloatArray:
    """Distance from each point (n, 2) to the nearest of the segments (m, 4), m."""
    out = np.empty(len(points))
    kernels.clearance(np.ascontiguousarray(points), np.ascontiguousarray(segments), out)
    return out


def _touched(segment: FloatArray, corner: FloatArray, cell: float, columns: int) -> list[int]:
    """Flat indices of the cells whose slightly enlarged square the segment crosses."""
    margin = 1e-6
    a, b = (segment[:2] - corner) / cell, (segment[2:] - corner) / cell
    low = np.floor(np.minimum(a, b) - margin).astype(int)
    high = np.floor(np.maximum(a, b) + margin).astype(int)
    rows, along = np.arange(low[1], high[1] + 1), np.arange(low[0], high[0] + 1)
    i, j = np.tile(along, rows.size), np.repeat(rows, along.size)
    normal = np.array([-(b - a)[1], (b - a)[0]])
    centre = (i + 0.5 - a[0]) * normal[0] + (j + 0.5 - a[1]) * normal[1]
    inside = np.abs(centre) <= (0.5 + margin) * np.abs(normal).sum()
    return [int(index) for index in (j * columns + i)[inside]]
