"""Parameters of sonars and of their fusion with the lidar."""

from typing import Annotated, Literal

from pydantic import Field

from glassslam.parameters.base import Count, NonNegative, Positive, Probability, Section


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
