"""How good a trajectory is: against true relations and against a reference trajectory."""

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
    "PoseErrors",
    "RelationErrors",
    "Relations",
    "Spread",
    "absolute_trajectory_error",
    "align",
    "associate",
    "evaluate_relations",
    "poses_at",
    "read_relations",
    "relative_pose_error",
]
