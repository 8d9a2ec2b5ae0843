"""The pose graph: built step by step, optimised again and again from where it stands."""

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from glassslam.errors import GraphError
from glassslam.geometry import wrap_angle
from glassslam.posegraph import levenberg_marquardt, linearise_kernels
from glassslam.posegraph.covariance import relative_covariances
from glassslam.posegraph.graph import Constraint, ConstraintKind, Loss, OptimizationReport, Solver
from glassslam.posegraph.storage import KINDS, EdgeStore, VertexStore, checked_poses
from glassslam.posegraph.structure import Structure, analyse
from glassslam.posegraph.system import Robust, System
from glassslam.records import FloatArray


class PoseGraph:
    """Planar poses and the relative poses measured between them.

    Examples
    --------
    >>> import numpy as np
    >>> from glassslam.posegraph import Constraint, PoseGraph
    >>> graph = PoseGraph()
    >>> a, b = graph.add_pose((0, 0, 0)), graph.add_pose((0.9, 0.1, 0))
    >>> graph.add_constraint(Constraint(a, b, np.array([1.0, 0.0, 0.0]), np.eye(3), "odometry"))
    0
    >>> graph.optimize().converged
    True
    >>> np.round(graph.poses[b], 6).tolist()
    [1.0, 0.0, 0.0]
    """

    def __init__(self) -> None:
        self._vertices = VertexStore()
        self._edges = EdgeStore()
        self._structure: Structure | None = None
        self._factorised: System | None = None
        self._robust = Robust()

    @property
    def poses(self) -> FloatArray:
        """Copy of the poses (x, y, theta) of all vertices, shape (n, 3), m and rad."""
        return self._vertices.poses.copy()

    @property
    def edges(self) -> EdgeStore:
        """The constraints as arrays: `ends`, `measured`, `weights`, `kinds`, `enabled`."""
        return self._edges

    @property
    def constraints(self) -> tuple[Constraint, ...]:
        """Every constraint, disabled ones included, in the order of their index."""
        return tuple(self._edges)

    def add_pose(self, pose: ArrayLike) -> int:
        """Add a vertex at `pose` (x, y, theta) and return its index.

        Raises
        ------
        GraphError
            The pose is not finite.
        """
        return self.add_poses(np.asarray(pose, dtype=np.float64)[None])

    def add_poses(self, poses: ArrayLike) -> int:
        """Add vertices at `poses`, shape (k, 3), and return the index of the first.

        Raises
        ------
        GraphError
            A pose is not finite.
        """
        self._forget()
        return self._vertices.extend(np.asarray(poses, dtype=np.float64).reshape(-1, 3))

    def set_poses(self, first: int, poses: ArrayLike) -> None:
        """Move the vertices from index `first` on to `poses`, shape (k, 3).

        Raises
        ------
        GraphError
            A pose is not finite, or there are not so many vertices.
        """
        rows = checked_poses(np.asarray(poses, dtype=np.float64).reshape(-1, 3))
        self._vertices.check(np.array([first, first + len(rows) - 1]))
        self._vertices.poses[first : first + len(rows)] = rows
        self._factorised = None

    def add_constraint(self, constraint: Constraint) -> int:
        """Add one constraint and return its index.

        Raises
        ------
        GraphError
            It names an unknown vertex, joins a vertex to itself, or is not finite.
        """
        c = constraint
        return self.add_constraints([c.a], [c.b], c.a_from_b[None], c.sqrt_information[None], c.kind)

    def add_constraints(
        self,
        a: ArrayLike,
        b: ArrayLike,
        a_from_b: ArrayLike,
        sqrt_information: ArrayLike,
        kind: ConstraintKind,
    ) -> int:
        """Add many constraints of one kind and return the index of the first.

        Parameters
        ----------
        a, b : array_like of int, shape (k,)
            Vertices.
        a_from_b : array_like, shape (k, 3)
            Measured poses of b in the frame of a, m and rad.
        sqrt_information : array_like, shape (k, 3, 3) or (3, 3)
            W with information = W^T W.
        kind : {"loop", "odometry"}
            Kind of all of them.

        Raises
        ------
        GraphError
            One names an unknown vertex, joins a vertex to itself, or is not finite.
        """
        if kind not in KINDS:
            raise GraphError(f"unknown kind of constraint {kind!r}", f"known are {', '.join(KINDS)}")
        ends = np.stack((np.asarray(a), np.asarray(b)), axis=1).astype(np.int64)
        count = len(ends)
        measured = np.asarray(a_from_b, dtype=np.float64).reshape(count, 3)
        weights = np.broadcast_to(np.asarray(sqrt_information, dtype=np.float64), (count, 3, 3))
        kinds = np.full(count, KINDS.index(kind), dtype=np.int8)
        first = self._edges.extend(ends, measured, weights, kinds, len(self._vertices))
        self._forget()
        return first

    def set_fixed(self, vertex: int, fixed: bool = True) -> None:
        """Hold a vertex where it is, or let it move again.

        In every connected part of the graph without a fixed vertex the first vertex is held.
        """
        self._vertices.check(np.array([vertex]))
        self._vertices.fixed[vertex] = fixed
        self._forget()

    def set_enabled(self, constraints: Sequence[int] | NDArray[np.int64], enabled: bool) -> None:
        """Let constraints, given by index, take part in the optimisation or not."""
        self._edges.enabled[np.asarray(constraints, dtype=np.int64)] = enabled
        self._forget()

    def residuals(self) -> FloatArray:
        """Weighted residuals of all constraints at the present poses, shape (m, 3)."""
        e = self._edges
        out = np.empty((len(e), 3))
        linearise_kernels.residuals(self._vertices.poses, e.ends, e.measured, e.weights, out)
        return out

    def optimize(
        self,
        max_iterations: int = 50,
        *,
        solver: Solver = "lm",
        loss: Loss = "huber",
        huber_scale: float = 10.0,
        tolerance: float = 1e-8,
    ) -> OptimizationReport:
        """Move the poses to the least sum of losses, starting from where they are.

        Parameters
        ----------
        max_iterations : int
            Most iterations.
        solver : {"lm", "casadi"}
            Own sparse Levenberg-Marquardt, or CasADi's interface to IPOPT on the same kernels.
        loss : {"none", "huber", "geman_mcclure"}
            Loss of the loop closures; all other constraints are quadratic.
        huber_scale : float
            Norm of the weighted residual from which a closure loses weight, for either robust loss.
        tolerance : float
            Stop when the next step promises less than this share of the cost.

        Returns
        -------
        OptimizationReport
            Iterations, costs and residuals. The same graph gives the same bytes.

        Raises
        ------
        GraphError
            Unknown solver or loss, poses so far apart that the cost is not finite, or a solution that is not
            finite; the poses are then those of before.
        """
        self._robust = Robust(loss, float(huber_scale))
        system = System(self._analysed(), self._edges, self._robust)
        poses = np.array(self._vertices.poses, dtype=np.float64)
        if not np.isfinite(system.cost(poses)):
            raise GraphError("the cost of the pose graph is not finite", "check the poses and weights")
        if solver == "lm":
            solution = levenberg_marquardt.minimise(system, poses, max_iterations, tolerance)
        elif solver == "casadi":
            from glassslam.posegraph import interior_point  # noqa: PLC0415  (imports casadi)

            solution = interior_point.minimise(system, poses, max_iterations, tolerance)
        else:
            raise GraphError(f"unknown solver {solver!r}", "known are lm, casadi")
        if not np.isfinite(solution.poses).all():
            raise GraphError("the solver found poses that are not finite", "those of before are kept")
        self._accept(solution.poses)
        norms = np.sqrt(np.sum(self.residuals() ** 2, axis=1))
        return OptimizationReport(
            solution.iterations, solution.initial_cost, solution.final_cost, solution.converged, norms
        )

    def relative_covariance(self, a: int, b: int) -> FloatArray:
        """Covariance (3, 3) of the pose of b in the frame of a; see `relative_covariances`."""
        return np.asarray(self.relative_covariances([(a, b)])[0])

    def relative_covariances(self, pairs: ArrayLike | Iterable[tuple[int, int]]) -> FloatArray:
        """Covariances of the poses of b in the frames of a, from all enabled constraints.

        Parameters
        ----------
        pairs : array_like of int, shape (k, 2)
            Vertices a and b.

        Returns
        -------
        ndarray of float64, shape (k, 3, 3)
            In units of (m, m, rad), first order at the present poses, loop closures weighted by the
            loss of the last optimisation; infinite where no constraints lead from a to b.

        Raises
        ------
        GraphError
            An unknown vertex, or constraints that leave a direction open.
        """
        wanted = np.asarray(pairs, dtype=np.int64).reshape(-1, 2)
        self._vertices.check(wanted.ravel())
        if self._factorised is None:
            self._factorised = self._undamped()
        return relative_covariances(self._factorised, self._vertices.poses, wanted)

    def _undamped(self) -> System:
        system = System(self._analysed(), self._edges, self._robust)
        system.linearise(self._vertices.poses)
        if not system.factorise(np.zeros((system.size, 3))):
            raise GraphError(
                "the constraints do not determine all poses",
                "a constraint's information has a zero direction",
            )
        return system

    def _analysed(self) -> Structure:
        if self._structure is None:
            self._structure = analyse(self._edges.ends, self._edges.enabled, self._vertices.fixed)
        return self._structure

    def _accept(self, poses: FloatArray) -> None:
        moved = self._analysed().vertex
        poses[moved, 2] = wrap_angle(poses[moved, 2])
        self._vertices.poses[:] = poses
        self._factorised = None

    def _forget(self) -> None:
        self._structure = self._factorised = None
