"""Typed, frozen, validated configuration; Cartographer's parameter names where the meaning is the same."""

import difflib
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator, model_validator

from glassslam.errors import ConfigError
from glassslam.yamltext import parse_yaml

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Weight = Annotated[float, Field(ge=0, le=1e6)]
Noise = Annotated[float, Field(ge=1e-6, le=1e6, allow_inf_nan=False)]
Height = Annotated[float, Field(ge=-1e4, le=1e4, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Probability = Annotated[float, Field(gt=0, lt=1)]
FreeProbability = Annotated[float, Field(gt=0, le=0.5)]
OccupiedProbability = Annotated[float, Field(ge=0.5, lt=1)]
Solver = Literal["lm", "casadi"]
Count = Annotated[int, Field(ge=1)]
Small = Annotated[float, Field(ge=-0.2, le=0.2)]


class Section(BaseModel):
    """One frozen group of parameters; unknown names are refused."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", validate_default=True, ser_json_inf_nan="constants"
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

    resolution: Positive = 0.05
    """Cell edge, m."""
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


class GlassWallConfig(Section):
    """Walls fitted from glass observations."""

    min_observations: Count = 3
    """Observations a wall rests on at least."""
    min_nodes: Count = 5
    """Different nodes that made them, at least."""
    min_probability: Probability = 0.9
    """Least probability of a wall."""
    min_excess: Positive = 2.0
    """Least ratio of the observations that fit a wall to those in its strip that would by chance."""
    distance_tolerance: Positive = 0.12
    """Largest distance of an observation from its wall, m."""
    angle_tolerance_deg: Positive = 7.0
    """Largest angle between an observed normal and that of its wall, deg."""
    max_gap: Positive = 4.0
    """Longest stretch bridged between observations, m."""
    max_mullion: Positive = 0.3
    """Widest opaque post inside a wall, m."""
    max_extension: NonNegative = 0.6
    """Longest stretch from the last observation to the frame that ends a wall, m."""
    opening_evidence: Positive = 4.0
    """Answers that glass would have given in a gap, had it been there, from which the gap is an opening."""


class GlassConfig(Section):
    """Detection of glass and what becomes of it in the map."""

    detector: Literal["auto", "off", "intensity_peak", "wang_wang", "calibrated_peak", "narrow_return"] = (
        "auto"
    )
    """How panes are found in a scan; `auto` decides by the intensities and the resolution of the scans."""
    require_intensity: bool = False
    """Whether a recording whose intensities tell nothing is an error; else it is mapped without glass."""
    scheme: Literal["off", "local", "global", "lite", "anchored"] = "anchored"
    """How glass stays in the map: not at all, locked in the submaps as Weerakoon et al. do it, or following
    the pose graph."""
    sensor: str = ""
    """Name of the shipped calibration that `calibrated_peak` uses; without one it calibrates itself."""
    calibration: dict[str, Any] | None = None
    """Calibration of the lidar as `glassslam calibrate` writes it; it goes before `sensor`."""
    thresh: Positive = 3000.0
    """Least intensity of `intensity_peak` and `wang_wang`, unit of the sensor."""
    grad: Positive = 500.0
    """Least rise and fall of the intensity from beam to beam, unit of the sensor."""
    width: Count = 10
    """Largest width of an intensity peak, beams."""
    ghosts_in_matching: bool = True
    """Whether returns that the detector sees behind a pane are matched and entered into submaps. What stands
    there is real but for mirror images, and holds the robot in hallways of glass."""
    ghosts_in_map: Literal["all", "seen_through", "none"] = "seen_through"
    """What the map shows behind glass walls: all, all but mirror images, or nothing seen through them."""
    walls: GlassWallConfig = GlassWallConfig()
    """Walls fitted from the observations."""

    @field_validator("detector", "scheme", mode="before")
    @classmethod
    def _off(cls, value: Any) -> Any:
        """YAML reads a bare `off` as false."""
        return "off" if value is False else value

    @field_validator("detector", mode="before")
    @classmethod
    def _word(cls, value: Any) -> Any:
        """The word `off`, which YAML reads as false."""
        return "off" if value is False else value

    @field_validator("calibration", mode="before")
    @classmethod
    def _complete(cls, value: Any) -> Any:
        """The calibration with all its entries, so that the configuration says everything."""
        if value is None:
            return None
        from detectors.calibration import Calibration  # noqa: PLC0415  (loads numba)

        return Calibration.from_dict(value).to_dict()


class SonarGlassConfig(Section):
    """Pieces of glass told by sonars where the lidar looks through."""

    max_range: Positive = 3.0
    """Longest reading used, m."""
    min_gap: Positive = 0.25
    """How far behind the end of a sonar reading a lidar beam that passed it ends, at least, m."""
    min_passed_share: Probability = 0.75
    """Least share of the lidar beams at a piece that pass it."""
    min_readings: Count = 4
    """New readings in a row that agree on a surface, at least."""
    max_span: Positive = 0.5
    """Longest stretch of the surface that one piece is made from, m."""
    max_pause: Positive = 1.0
    """Longest time between two readings of one piece, s."""
    max_residual: Positive = 0.02
    """Largest root mean square of the readings about their surface, m."""
    max_normal_sigma_deg: Positive = 2.5
    """Pieces whose direction is known worse are left out, deg."""
    range_bias: NonNegative = 0.03
    """Error common to neighbouring readings, m: it does not average out."""
    probability: Probability = 0.9
    """That such a piece is glass rather than a thing below the plane of the lidar."""


class FusionConfig(Section):
    """How the sonar map joins the lidar map."""

    method: Literal[
        "walls",
        "overlay",
        "attach",
        "pessimistic",
        "minmax",
        "lop",
        "liop",
        "iop",
        "bayes",
        "rsf_glass",
        "rsf_all",
    ] = "walls"
    """Rule that joins the two maps; every rule is described in `glassslam.fusion.fuse`."""
    occupied_threshold: Probability = 0.65
    """P(occupied) from which a cell stops a ray of `rsf_*` and is attached by `attach`."""
    glass_gap: Positive = 0.5
    """A ray meets glass when its lidar length exceeds its sonar length by more, m (`rsf_*`)."""
    sonars: Literal["all", "sides"] = "all"
    """Sonars in use: all, or only the one that looks most nearly to each side."""
    lidar_weight: NonNegative = 0.75
    """Weight of the lidar map in `lop` and `liop`."""
    sonar_weight: NonNegative = 0.25
    """Weight of the sonar map in `lop` and `liop`."""
    prior: Probability = 0.5
    """P(occupied) before any measurement, for `bayes`."""
    overlay_resolution: Positive = 0.1
    """Cell edge of the layer of end points, m (`overlay`)."""
    overlay_max_range: Positive = 2.0
    """Longest reading entered into that layer, m (`overlay`)."""
    overlay_min_occupancy: Probability = 0.07
    """Least share of readings that end in a cell rather than pass it (`overlay`)."""


class ScanFilterConfig(Section):
    """Laser readings replaced by sonar before any SLAM."""

    enabled: bool = False
    """Whether scans are filtered at all."""
    max_range: Positive = 3.0
    """Longest sonar reading used, m."""
    max_sector_deg: Positive = 20.0
    """Largest width of the sector of laser beams that belongs to one sonar, deg."""
    max_pairing_time: Positive = 0.4
    """Oldest sonar reading that a scan is compared with, s."""
    glass_offset: NonNegative = 0.3
    """D_go: a beam looks through glass when it is longer than the sonar reading by this, m."""
    min_share: Annotated[float, Field(gt=0, le=1)] = 0.5
    """D_sl: least share of such beams in a sector."""
    min_difference: NonNegative = 0.08
    """R_sl: least weighted difference of the sector, m."""
    corner_slope: Positive = 10.0
    """C_T: change of range with angle that counts as a corner, m/rad."""


class SonarConfig(Section):
    """Maps from sonar rings, and what becomes of them."""

    algorithm: Literal["ICL", "ICo", "DS", "BFA"] = "BFA"
    """Centre line or cone with weighted means, Dempster-Shafer masses, or Bayesian update."""
    pose_kind: Literal["Loc", "PG", "FG", "FGfit"] = "FGfit"
    """Poses of the sweeps: local, partially global, final of the nearest node, or final interpolated."""
    resolution: Positive = 0.05
    """Cell edge, m."""
    max_range: Positive = 2.0
    """Longest reading entered as an obstacle, m; longer ones clear the cone up to here."""
    no_echo_free_length: NonNegative = 0.0
    """Free space cleared by a sonar without echo, m; a smooth wall seen aslant does not echo either."""
    beam_width_deg: NonNegative = 18.0
    """Full width of the cone that echoes, deg, at most the field of view of the ring; 0: all of that."""
    arc_thickness: Positive = 0.025
    """Half thickness of the occupied arc at the sensor, m; revisited rays end at its near side."""
    arc_growth: NonNegative = 0.01
    """Growth of that half thickness with the range, m/m."""
    occupied_belief: Probability = 0.6
    """Full mass of a cell in the middle of the arc; BFA takes 0.5 + half of it as P(occupied)."""
    empty_belief: Probability = 0.1
    """Empty mass of a cell on the axis before the arc; BFA takes 0.5 - half of it as P(occupied)."""
    distance_threshold: Positive = 4.0
    """N_g of ICL and ICo: range at which an obstacle is entered with 1/e, m."""
    old_weight: Probability = 0.7
    """W_a of ICL and ICo: weight of the value before."""
    new_weight: Probability = 0.3
    """W_b of ICL and ICo: weight of the value of the reading."""
    glass: SonarGlassConfig = SonarGlassConfig()
    """Glass told by sonars."""
    fusion: FusionConfig = FusionConfig()
    """How the sonar map joins the lidar map."""
    scan_filter: ScanFilterConfig = ScanFilterConfig()
    """Laser readings replaced by sonar before any SLAM."""


class VolumeConfig(Section):
    """3D maps from the lidar and the points of 3D ultrasonic sensors."""

    resolution: Annotated[float, Field(ge=0.005, allow_inf_nan=False)] = 0.05
    """Edge of a voxel, m."""
    lidar_height: Height | None = None
    """Height of the plane of the lidar above the base, m; without one that of the recording, or else 0.2."""
    band_low: Height = 0.1
    """Lowest height that goes into the 2D map and the pictures, m above the base."""
    band_high: Height = 1.8
    """Highest of them, m above the base."""
    projection: Literal["max", "pool"] = "max"
    """What becomes of a column of voxels: its most occupied one decides, or all that are known."""
    pool: Literal["bayes", "iop", "lop", "liop"] = "bayes"
    """How the measurements of the two sensors at one time are joined."""
    lidar_weight: NonNegative = 1.0
    """Weight of the lidar in `lop` and `liop`."""
    ultrasonic_weight: NonNegative = 1.0
    """Weight of the ultrasonic sensor in `lop` and `liop`."""
    max_pairing_time: NonNegative = 0.05
    """Largest difference of the stamps of two measurements at one time, s."""
    lidar_free: FreeProbability = 0.4
    """P(occupied) of a voxel before the return of a beam."""
    lidar_occupied: OccupiedProbability = 0.7
    """P(occupied) of the voxel of that return."""
    lidar_max_range: Positive = 20.0
    """The lidar says nothing farther away, m."""
    ultrasonic_free: FreeProbability = 0.4
    """P(occupied) of a voxel before an echo."""
    ultrasonic_occupied: OccupiedProbability = 0.7
    """P(occupied) of the voxel of that echo."""
    ultrasonic_max_range: Positive = 4.0
    """The ultrasonic sensor says nothing farther away, m."""
    ultrasonic_half_angle_deg: Annotated[float, Field(gt=0, le=180)] = 90.0
    """Echoes farther from the axis of the sensor are not believed, deg."""
    min_probability: Annotated[float, Field(gt=0, lt=0.5)] = 0.1192
    """Least P(occupied) of a voxel."""
    max_probability: Annotated[float, Field(gt=0.5, lt=1)] = 0.971
    """Largest P(occupied) of a voxel."""
    occupied_threshold: Probability = 0.5
    """P(occupied) from which a voxel counts as occupied; below it is free."""

    @model_validator(mode="after")
    def _orders(self) -> Self:
        """Refuse bounds in the wrong order, and weights that are all zero."""
        if not self.band_low < self.band_high:
            low, high = self.band_low, self.band_high
            raise ValueError(f"no height lies between band_low {low:g} and band_high {high:g} m")
        if not self.min_probability < self.occupied_threshold < self.max_probability:
            raise ValueError("occupied_threshold does not lie between min_probability and max_probability")
        if self.lidar_weight == self.ultrasonic_weight == 0.0:
            raise ValueError("lidar_weight and ultrasonic_weight are both 0")
        return self


class Config(Section):
    """Everything that decides a map, apart from the recording itself."""

    sensor: SensorConfig = SensorConfig()
    filter: FilterConfig = FilterConfig()
    local: LocalConfig = LocalConfig()
    motion_filter: MotionFilterConfig = MotionFilterConfig()
    submap: SubmapConfig = SubmapConfig()
    loop_closure: LoopClosureConfig = LoopClosureConfig()
    optimization: OptimizationConfig = OptimizationConfig()
    map: MapConfig = MapConfig()
    glass: GlassConfig = GlassConfig()
    sonar: SonarConfig = SonarConfig()
    volume: VolumeConfig = VolumeConfig()

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read a YAML file; parameters it does not name keep their defaults.

        Raises
        ------
        ConfigError
            The file cannot be read, is no mapping, or holds an unknown or unfit value.
        """
        try:
            text = Path(path).read_text(encoding="utf-8")
            data = parse_yaml(text)
        except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
            raise ConfigError(f"cannot read configuration {path}: {_first_line(error)}") from error
        return cls.from_mapping({} if data is None else data, origin=str(path))

    @classmethod
    def from_mapping(cls, data: Any, origin: str = "configuration") -> Self:
        """Validate nested plain data, with a spelling hint for unknown names.

        Raises
        ------
        ConfigError
            The data is no mapping, or holds an unknown or unfit value.
        """
        if not isinstance(data, dict):
            raise ConfigError(f"{origin}: expected a mapping of sections, found {type(data).__name__}")
        try:
            return cls.model_validate(data)
        except ValidationError as error:
            raise _explain(cls, error, origin) from error

    def dump(self) -> str:
        """The complete configuration as YAML."""
        return yaml.safe_dump(self.model_dump(mode="json"), sort_keys=False)


def _first_line(error: BaseException) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]


def _names(model: type[BaseModel], location: tuple[Any, ...]) -> list[str]:
    for part in location:
        annotation = model.model_fields[part].annotation if part in model.model_fields else None
        if not (isinstance(annotation, type) and issubclass(annotation, BaseModel)):
            return []
        model = annotation
    return list(model.model_fields)


def _explain(model: type[BaseModel], error: ValidationError, origin: str) -> ConfigError:
    first = error.errors()[0]
    location = tuple(first["loc"])
    name = ".".join(str(part) for part in location)
    if first["type"] == "extra_forbidden":
        known = _names(model, location[:-1])
        close = difflib.get_close_matches(str(location[-1]), known, n=1)
        hint = f"did you mean {close[0]!r}?" if close else f"known here: {', '.join(known)}"
        return ConfigError(f"{origin}: unknown parameter {name!r}", hint)
    if first["type"] == "value_error":  # raised by our own checks, which quote what they found
        return ConfigError(f"{origin}: {name}: {first['ctx']['error']}")
    return ConfigError(f"{origin}: {name}: {first['msg']}", f"found {first['input']!r:.60}")
