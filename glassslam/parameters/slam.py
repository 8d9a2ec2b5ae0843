"""Parameters of the sensor, of SLAM and of the map."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from glassslam.parameters.base import (
    Cell,
    Count,
    Noise,
    NonNegative,
    Positive,
    Probability,
    Section,
    Small,
    Solver,
    Weight,
)


class SensorConfig(Section):
    """What is taken from the lidar and how its silent beams are read."""

    min_range: NonNegative = 0.0
    """Nearest range used, m; the sensor's own limit applies as well."""
    max_range: Positive = 30.0
    """Farthest range used as a hit, m."""
    missing_data_ray_length: NonNegative = 5.0
    """Free space cleared by a beam without echo, m."""
    bearing_cosine: Small = 0.0
    """Beams announced at angle t point to t + this * cos(t), rad; `estimate_beam_errors` tells it."""
    bearing_sine: Small = 0.0
    """The same with sin(t), rad."""
    lateral_offset: Small = 0.0
    """Distance by which beams pass the axis of the lidar on the left, m; lidars that triangulate have it."""
    range_offset: Small = 0.0
    """What is added to every range with an echo, m."""

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        """Refuse limits that leave no range."""
        if not self.min_range < self.max_range:
            low, high = self.min_range, self.max_range
            raise ValueError(f"no range lies between min_range {low:g} and max_range {high:g} m")
        return self


class FilterConfig(Section):
    """Thinning of the returns (voxel filters)."""

    voxel_filter_size: NonNegative = 0.025
    """Edge of the voxels that keep one return each, m."""
    adaptive_max_length: Positive = 0.5
    """Largest voxel of the second thinning, for matching only, m."""
    adaptive_min_num_points: Count = 250
    """The second thinning leaves at least this many returns."""


class LocalConfig(Section):
    """Matching of a scan against the active submap."""

    occupied_space_weight: Annotated[float, Field(ge=1e-6, le=1e6)] = 1.0
    """Weight of the root mean square of 1 - P(occupied) at the returns."""
    translation_weight: Weight = 0.5
    """Weight of the odometry's translation, 1/m after 1 m of travel; falls with the root of the travel."""
    rotation_weight: Weight = 0.33
    """Weight of the odometry's rotation, 1/rad after 1 rad of turning; falls with its root."""
    max_num_iterations: Count = 20
    """Most evaluations of one match."""
    min_num_points: Count = 10
    """Scans with fewer returns keep their predicted pose."""
    correlative_search: Literal["when_doubtful", "always", "never"] = "when_doubtful"
    """Whether a real-time correlative search backs the gradient matching."""
    search_linear_window: Positive = 0.2
    """Half width of that search, m."""
    search_angular_window_deg: Positive = 20.0
    """Half width of that search, deg."""
    solver: Solver = "lm"
    """The project's Levenberg-Marquardt loop, or CasADi's sqpmethod on the same kernel."""


class MotionFilterConfig(Section):
    """A scan becomes a node after this much motion or time."""

    max_distance: NonNegative = 0.2
    """Travel, m."""
    max_angle_deg: NonNegative = 1.0
    """Turn, deg."""
    max_time: Positive = 5.0
    """Time, s."""


class GridConfig(Section):
    """A probability grid."""

    resolution: Cell = 0.05
    """Cell edge, at most 1 m."""
    hit_probability: Annotated[float, Field(gt=0.5, lt=1)] = 0.55
    """P(occupied) after one return."""
    miss_probability: Annotated[float, Field(gt=0, lt=0.5)] = 0.49
    """P(occupied) after one ray through."""


class SubmapConfig(GridConfig):
    """The submaps scans are matched against."""

    num_range_data: Count = 90
    """Nodes after which the next submap starts; a submap holds twice as many."""


class LoopClosureConfig(Section):
    """Search for places visited before."""

    enabled: bool = True
    """Whether loops are closed at all."""
    min_node_gap: Count = 100
    """A node closes loops with submaps that ended at least this many nodes before it."""
    sampling_stride: Count = 5
    """Nodes between two searches in the same submap."""
    max_searches_per_submap: Count = 4
    """Searches in one submap between two optimisations."""
    max_linear_window: Positive = 15.0
    """Largest half width of a search, m; the uncertainty of the graph sets the actual one."""
    max_angular_window_deg: Positive = 30.0
    """Largest half width of a search, deg."""
    min_score: Probability = 0.5
    """Least score of branch and bound."""
    max_residual: Probability = 0.55
    """Largest root mean square of 1 - P(occupied) after refinement."""
    neighbourhood: NonNegative = 4.0
    """Travel before and after a node whose scans are matched together with its own, m."""
    translation_noise: Noise = 0.05
    """Least standard deviation of a closure, m."""
    rotation_noise: Noise = 0.01
    """Least standard deviation of a closure, rad."""


class OptimizationConfig(Section):
    """The pose graph (sparse pose adjustment)."""

    optimize_every_n_nodes: Count = 90
    """Nodes between two rounds of search and optimisation."""
    odometry_translation_noise: Noise = 0.015
    """Standard deviation of the step between consecutive nodes of local SLAM, m."""
    odometry_rotation_noise: Noise = 0.003
    """Standard deviation of that step, rad."""
    huber_scale: Positive = 1.5
    """Norm of a closure's weighted residual from which it loses weight."""
    max_closure_residual: Positive = 3.0
    """Closures with a larger weighted residual after optimisation are taken out."""
    max_num_iterations: Count = 50
    """Most iterations of one optimisation."""
    solver: Solver = "lm"
    """The project's sparse Levenberg-Marquardt, or CasADi's interface to IPOPT."""


class MapConfig(GridConfig):
    """The map that is written."""

    hit_probability: Annotated[float, Field(gt=0.5, lt=1)] = 0.8
    miss_probability: Annotated[float, Field(gt=0, lt=0.5)] = 0.33
