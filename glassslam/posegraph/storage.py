"""Poses and edges in arrays that grow, so that optimising walks over no Python object."""

from collections.abc import Iterator
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from glassslam.errors import GraphError
from glassslam.posegraph.graph import Constraint, ConstraintKind
from glassslam.records import FloatArray

KINDS: tuple[ConstraintKind, ...] = ("loop", "odometry")
LOOP = KINDS.index("loop")

_Scalar = TypeVar("_Scalar", bound=np.generic)


class GrowingArray(Generic[_Scalar]):
    """Rows of one shape, appended in amortised constant time."""

    def __init__(self, row_shape: tuple[int, ...], dtype: type[_Scalar]) -> None:
        self._data: NDArray[_Scalar] = np.empty((16, *row_shape), dtype=dtype)
        self._size = 0

    def extend(self, rows: NDArray[_Scalar]) -> None:
        """Append `rows`, shape (k, *row_shape)."""
        needed = self._size + len(rows)
        if needed > len(self._data):
            grown = np.empty((max(needed, 2 * len(self._data)), *self._data.shape[1:]), self._data.dtype)
            grown[: self._size] = self.view()
            self._data = grown
        self._data[self._size : needed] = rows
        self._size = needed

    def view(self) -> NDArray[_Scalar]:
        """The rows appended so far; valid until the next call of `extend`."""
        return self._data[: self._size]

    def __len__(self) -> int:
        return self._size


class VertexStore:
    """Poses of a graph and which of them are held."""

    def __init__(self) -> None:
        self._poses = GrowingArray((3,), np.float64)
        self._fixed = GrowingArray((), np.bool_)

    def __len__(self) -> int:
        return len(self._poses)

    @property
    def poses(self) -> FloatArray:
        """Poses (x, y, theta), shape (n, 3)."""
        return self._poses.view()

    @property
    def fixed(self) -> NDArray[np.bool_]:
        """Vertices held by the caller, shape (n,)."""
        return self._fixed.view()

    def extend(self, poses: FloatArray) -> int:
        """Append finite poses, shape (k, 3), and return the index of the first."""
        first = len(self)
        self._poses.extend(checked_poses(poses))
        self._fixed.extend(np.zeros(len(poses), dtype=np.bool_))
        return first

    def check(self, vertices: NDArray[np.int64]) -> None:
        """Raise GraphError unless all indices name a vertex."""
        bad = vertices[(vertices < 0) | (vertices >= len(self))]
        if bad.size:
            raise GraphError(f"no vertex {bad[0]}: the graph has {len(self)}", "indices count from 0")


class EdgeStore:
    """Every constraint of a graph, one array per property."""

    def __init__(self) -> None:
        self._ends = GrowingArray((2,), np.int64)
        self._measured = GrowingArray((3,), np.float64)
        self._weights = GrowingArray((3, 3), np.float64)
        self._kinds = GrowingArray((), np.int8)
        self._enabled = GrowingArray((), np.bool_)

    def __len__(self) -> int:
        return len(self._kinds)

    def extend(
        self,
        ends: NDArray[np.int64],
        measured: FloatArray,
        weights: FloatArray,
        kinds: NDArray[np.int8],
        pose_count: int,
    ) -> int:
        """Append checked edges and return the index of the first."""
        _check(ends, measured, weights, pose_count)
        first = len(self)
        self._ends.extend(ends)
        self._measured.extend(measured)
        self._weights.extend(weights)
        self._kinds.extend(kinds)
        self._enabled.extend(np.ones(len(kinds), dtype=np.bool_))
        return first

    @property
    def ends(self) -> NDArray[np.int64]:
        """Vertices a and b of every edge, shape (n, 2)."""
        return self._ends.view()

    @property
    def measured(self) -> FloatArray:
        """Measured poses a_from_b, shape (n, 3)."""
        return self._measured.view()

    @property
    def weights(self) -> FloatArray:
        """Square roots of the information matrices, shape (n, 3, 3)."""
        return self._weights.view()

    @property
    def kinds(self) -> NDArray[np.int8]:
        """Index into `KINDS` of every edge, shape (n,)."""
        return self._kinds.view()

    @property
    def enabled(self) -> NDArray[np.bool_]:
        """Whether the edge takes part in the optimisation, shape (n,)."""
        return self._enabled.view()

    def __iter__(self) -> Iterator[Constraint]:
        for (a, b), measured, weights, kind in zip(
            self.ends, self.measured, self.weights, self.kinds, strict=True
        ):
            yield Constraint(int(a), int(b), measured.copy(), weights.copy(), KINDS[kind])


def _check(ends: NDArray[np.int64], measured: FloatArray, weights: FloatArray, pose_count: int) -> None:
    bad = (ends < 0).any(axis=1) | (ends >= pose_count).any(axis=1)
    if bad.any():
        a, b = ends[bad][0]
        raise GraphError(
            f"constraint between vertices {a} and {b}, but the graph has {pose_count}",
            "add the poses before the constraints that name them",
        )
    if (ends[:, 0] == ends[:, 1]).any():
        a = int(ends[ends[:, 0] == ends[:, 1]][0, 0])
        raise GraphError(f"constraint from vertex {a} to itself", "a constraint needs two vertices")
    if not (np.isfinite(measured).all() and np.isfinite(weights).all()):
        raise GraphError(
            "constraint with a non-finite measurement or information", "leave out failed measurements"
        )


def checked_poses(poses: FloatArray) -> FloatArray:
    """The poses, when all are finite."""
    if not np.isfinite(poses).all():
        raise GraphError("pose that is not finite", "leave out poses the front end lost")
    return poses
