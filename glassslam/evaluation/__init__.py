"""How good a run is: its trajectory against relations or a reference, its glass against true panes."""

from glassslam.evaluation.glass import GlassErrors, GlassWithin, evaluate_glass
from glassslam.evaluation.glass_lines import read_glass_walls, read_true_glass
from glassslam.evaluation.lookup import poses_at
from glassslam.evaluation.relations import (
    RelationErrors,
    Relations,
    Spread,
    evaluate_relations,
    read_relations,
)
from glassslam.evaluation.trajectory import (
    ErrorSummary,
    PoseErrors,
    absolute_trajectory_error,
    align,
    associate,
    relative_pose_error,
)

__all__ = [
    "ErrorSummary",
    "GlassErrors",
    "GlassWithin",
    "PoseErrors",
    "RelationErrors",
    "Relations",
    "Spread",
    "absolute_trajectory_error",
    "align",
    "associate",
    "evaluate_glass",
    "evaluate_relations",
    "poses_at",
    "read_glass_walls",
    "read_relations",
    "read_true_glass",
    "relative_pose_error",
]
