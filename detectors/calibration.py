"""What is known of one sensor's answer to walls and panes, as plain data."""

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, fields
from typing import Any, Self

from detectors.beam_errors import BeamErrors
from detectors.diffuse import DiffuseCurve
from detectors.entries import flag, mapping, number, numbers, text, whole

DETECTORS = ("calibrated_peak", "narrow_return", "off")


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
        Step between beams, rad; 0: it varies.
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
    beam_errors : BeamErrors or None
        What is wrong with the bearings and ranges; None: not looked for.
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
    beam_errors: BeamErrors | None = None
    evidence: Mapping[str, Any] = field(default_factory=dict)

    @property
    def intensity_scale(self) -> float:
        """Diffuse level at 1 m, unit of the sensor."""
        return float(self.diffuse.level(1.0))

    @property
    def silent_from(self) -> float:
        """Ranges from here on mean that nothing came back, m."""
        return self.range_max if self.no_echo is None else min(self.range_max, self.no_echo)

    def to_dict(self) -> dict[str, Any]:
        """Plain lists, numbers and strings, ready for YAML; `from_dict` takes them back."""
        values = asdict(self)
        values["diffuse"]["ranges"] = list(self.diffuse.ranges)
        values["diffuse"]["levels"] = list(self.diffuse.levels)
        values["beam_errors"] = self.beam_errors.to_dict() if self.beam_errors else None
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
            A name is unknown, a needed one is missing, or a value does not fit; the entry is named.
        """
        given = mapping("a calibration", values)
        given.pop("intensity_scale", None)
        for name in ("sensor", "diffuse"):
            if name not in given:
                raise ValueError(f"a calibration needs {name!r}")
        if strange := sorted(set(given) - set(_READERS)):
            known = ", ".join(f.name for f in fields(cls))
            raise ValueError(f"not a calibration: there is no {strange[0]!r}; known names are {known}")
        return cls(**{name: _READERS[name](name, value) for name, value in given.items()})

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


def _diffuse(name: str, value: Any) -> DiffuseCurve:
    given = mapping(name, value)
    for needed in ("ranges", "levels"):
        if needed not in given:
            raise ValueError(f"a calibration needs '{name}.{needed}'")
    ranges, levels = (numbers(f"{name}.{part}", given.pop(part)) for part in ("ranges", "levels"))
    return DiffuseCurve(ranges, levels, **_positive(name, given, ("incidence_exponent", "spread")))


def _pane(name: str, value: Any) -> PaneModel:
    return PaneModel(**_positive(name, mapping(name, value), ("haze", "decay", "peak")))


def _positive(name: str, given: Mapping[str, Any], known: tuple[str, ...]) -> dict[str, float]:
    if strange := sorted(set(given) - set(known)):
        raise ValueError(
            f"not a calibration: there is no '{name}.{strange[0]}'; known are {', '.join(known)}"
        )
    return {key: number(f"{name}.{key}", value, 0.0) for key, value in given.items()}


def _number(low: float, high: float = math.inf, *, infinite: bool = False) -> Callable[[str, Any], float]:
    return lambda name, value: number(name, value, low, high, infinite=infinite)


def _no_echo(name: str, value: Any) -> float | None:
    return None if value is None else number(name, value, 0.0, infinite=True)


def _beam_errors(name: str, value: Any) -> BeamErrors | None:
    return None if value is None else BeamErrors.from_dict(name, value)


_READERS: dict[str, Callable[[str, Any], Any]] = {
    "sensor": text,
    "diffuse": _diffuse,
    "beams": whole,
    "angle_increment": _number(0.0),
    "range_min": _number(0.0),
    "range_max": _number(0.0, infinite=True),
    "no_echo": _no_echo,
    "floor": _number(0.0),
    "saturation": _number(0.0, infinite=True),
    "informative": flag,
    "detector": lambda name, value: text(name, value, DETECTORS),
    "thresh": _number(0.0),
    "grad": _number(0.0),
    "width": whole,
    "faint": _number(0.0),
    "weakest_decay": _number(0.0),
    "pane": _pane,
    "date": text,
    "beam_errors": _beam_errors,
    "evidence": mapping,
}
