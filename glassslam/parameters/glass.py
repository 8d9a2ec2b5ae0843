"""Parameters of the search for glass."""

from typing import Any, Literal

from pydantic import field_validator

from glassslam.parameters.base import Count, NonNegative, Positive, Probability, Section


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
