"""How good a run is: its trajectory against relations or a reference, its glass against true panes."""

from glassslam.evaluation.glass import (
    GlassCellErrors,
    GlassErrors,
    GlassWithin,
    evaluate_glass,
    evaluate_glass_cells,
)
from glassslam.evaluation.glass_lines import read_glass_walls, read_true_glass
from glassslam.evaluation.image import ImageErrors, align_maps, evaluate_image
from glassslam.evaluation.lookup import poses_at
from glassslam.evaluation.map_files import read_glass_cells, read_map
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
    "GlassCellErrors",
    "GlassErrors",
    "GlassWithin",
    "ImageErrors",
    "PoseErrors",
    "RelationErrors",
    "Relations",
    "Spread",
    "absolute_trajectory_error",
    "align",
    "align_maps",
    "associate",
    "evaluate_glass",
    "evaluate_glass_cells",
    "evaluate_image",
    "evaluate_relations",
    "poses_at",
    "read_glass_cells",
    "read_glass_walls",
    "read_map",
    "read_relations",
    "read_true_glass",
    "relative_pose_error",
]
