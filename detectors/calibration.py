"""What is known of one sensor's answer to walls and panes, as plain data."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from typing import Any, Self

from detectors.diffuse import DiffuseCurve


@dataclass(frozen=True, slots=True)
class PaneModel:
    """Intensity of a pane against the angle to its normal, in units of the diffuse level.

    level = haze * exp(-decay * |angle|), and within a fraction of a degree of the normal the mirror peak.

    Attributes
    ----------
    haze : float
        Level at the normal beside the mirror peak.
    decay : float
        Fall of the logarithm of the level, 1/rad.
    peak : float
        Median level of the brightest beam within 1.5 deg of the normal.
    """

    haze: float = 0.8
    decay: float = 6.5
    peak: float = 4.5


@dataclass(frozen=True, slots=True)
class Calibration:
    """Intensity calibration of a lidar.

    Attributes
    ----------
    sensor : str
        Name of the sensor or of the recording it was made from.
    diffuse : DiffuseCurve
        Intensity of matte surfaces.
    beams : int
        Beams of a scan; 0: it varies.
    angle_increment : float
        Step between beams, rad.
    range_min, range_max : float
        Limits of the sensor, m.
    no_echo : float or None
        Range written for beams without echo, m; None: not known.
    floor, saturation : float
        Weakest and strongest intensity that the sensor reports; 0 and +inf when not known.
    informative : bool
        Whether intensities tell surfaces apart at all.
    detector : str
        The detector that suits the sensor: "calibrated_peak", "narrow_return" or "off".
    thresh, grad : float
        Thresholds of `intensity_peak`, unit of the sensor.
    width : int
        Width of `intensity_peak`, beams.
    faint : float
        Level, in units of the diffuse one, below which the shoulder of a pane is faint.
    weakest_decay : float
        Least decay of a pane's lobe, 1/rad.
    pane : PaneModel
        Lobe of the panes that were seen.
    date : str
        Day of the recording, ISO 8601; empty when not known.
    evidence : mapping
        What the figures rest on: recordings, numbers of beams, rates and their intervals. Plain values only.
    """

    sensor: str
    diffuse: DiffuseCurve
    beams: int = 0
    angle_increment: float = 0.0
    range_min: float = 0.0
    range_max: float = float("inf")
    no_echo: float | None = None
    floor: float = 0.0
    saturation: float = float("inf")
    informative: bool = True
    detector: str = "calibrated_peak"
    thresh: float = 0.0
    grad: float = 0.0
    width: int = 0
    faint: float = 0.45
    weakest_decay: float = 2.5
    pane: PaneModel = field(default_factory=PaneModel)
    date: str = ""
    evidence: Mapping[str, Any] = field(default_factory=dict)

    @property
    def intensity_scale(self) -> float:
        """Diffuse level at 1 m, unit of the sensor."""
        return float(self.diffuse.level(1.0))

    def to_dict(self) -> dict[str, Any]:
        """Plain lists, numbers and strings, ready for YAML; `from_dict` takes them back."""
        values = asdict(self)
        values["diffuse"]["ranges"] = list(self.diffuse.ranges)
        values["diffuse"]["levels"] = list(self.diffuse.levels)
        values["evidence"] = dict(self.evidence)
        return {"intensity_scale": self.intensity_scale, **values}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Build a calibration from plain data.

        Parameters
        ----------
        values : mapping
            As `to_dict` gives them; what is missing keeps its default.

        Raises
        ------
        ValueError
            A name is unknown, a needed one is missing, or a value does not fit.
        """
        given = dict(values)
        given.pop("intensity_scale", None)
        try:
            diffuse = dict(given.pop("diffuse"))
            diffuse["ranges"] = tuple(float(r) for r in diffuse["ranges"])
            diffuse["levels"] = tuple(float(v) for v in diffuse["levels"])
            pane = PaneModel(**given.pop("pane", {}))
            return cls(diffuse=DiffuseCurve(**diffuse), pane=pane, **given)
        except KeyError as error:
            raise ValueError(f"a calibration needs {error.args[0]!r}") from None
        except TypeError as error:
            known = ", ".join(f.name for f in fields(cls))
            raise ValueError(f"not a calibration: {error}; known names are {known}") from None

    def mismatch(self, beams: int, angle_increment: float) -> str:
        """Say why a recording is not of this sensor, or nothing when it may be.

        Parameters
        ----------
        beams : int
            Beams of its scans.
        angle_increment : float
            Step between them, rad.
        """
        if self.angle_increment and abs(abs(angle_increment) / self.angle_increment - 1.0) > 0.02:
            return (
                f"the calibration of {self.sensor} is for steps of {self.angle_increment:.6f} rad, "
                f"the recording has {abs(angle_increment):.6f}"
            )
        if self.beams and beams > 1.02 * self.beams:
            return f"the calibration of {self.sensor} is for {self.beams} beams, the recording has {beams}"
        return ""
