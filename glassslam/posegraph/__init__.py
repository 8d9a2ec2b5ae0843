"""Sparse pose adjustment: planar poses, relative measurements, robust sparse optimisation."""

from typing import TYPE_CHECKING, Any

from glassslam.posegraph.graph import Constraint, ConstraintKind, Loss, OptimizationReport, Solver

if TYPE_CHECKING:
    from glassslam.posegraph.pose_graph import PoseGraph

__all__ = ["Constraint", "ConstraintKind", "Loss", "OptimizationReport", "PoseGraph", "Solver"]


def __getattr__(name: str) -> Any:
    """Import the kernels only when a graph is built: naming a `Constraint` needs no numba."""
    if name == "PoseGraph":
        from glassslam.posegraph.pose_graph import PoseGraph  # noqa: PLC0415

        return PoseGraph
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
