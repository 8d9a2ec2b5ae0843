"""What is wrong with the beams of a lidar, as plain data."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Final, Self

from detectors.entries import mapping, number, numbers, whole

NAMES: Final = ("bearing_cosine", "bearing_sine", "lateral_offset", "range_offset")
"""The errors, named as `sensor.*` of the configuration names them."""
LARGEST: Final = 0.2
"""Larger errors, rad or m, are those of no lidar."""
SIGNIFICANT: Final = 3.0
"""Errors of so many standard deviations are not there by chance."""


@dataclass(frozen=True, slots=True)
class BeamErrors:
    """What is wrong with the beams of a lidar, in its own frame, as `sensor.*` of the configuration takes it.

    A beam announced at angle t with range r truly points to t + bearing_cosine * cos(t) +
    bearing_sine * sin(t), starts `lateral_offset` to the left of the axis of rotation, and has the range
    r + range_offset.

    Attributes
    ----------
    bearing_cosine, bearing_sine : float
        First harmonic of the bearing error, rad: the encoder disc turns off its centre.
    lateral_offset : float
        Distance by which beams pass the axis of rotation on the left, m: lidars that triangulate.
    range_offset : float
        What is missing from the ranges, m.
    sigma : tuple of float
        Standard deviations of the four, rad and m, from how much stretches of the recording disagree.
    walls : int
        Walls used; fewer than a hundred tell little.
    bend_before, bend_after : float
        Median distance of a wall's returns from a straight line without and with the correction, m.
    """

    bearing_cosine: float
    bearing_sine: float
    lateral_offset: float
    range_offset: float
    sigma: tuple[float, float, float, float]
    walls: int
    bend_before: float
    bend_after: float

    @property
    def settings(self) -> dict[str, float]:
        """The errors as values of the section `sensor` of the configuration."""
        return {name: getattr(self, name) for name in NAMES}

    @property
    def significant(self) -> tuple[str, ...]:
        """Names of the errors of three standard deviations or more."""
        values = zip(NAMES, self.settings.values(), self.sigma, strict=True)
        return tuple(name for name, value, sigma in values if abs(value) >= SIGNIFICANT * sigma)

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and lists, ready for YAML; `from_dict` takes them back."""
        return asdict(self) | {"sigma": list(self.sigma)}

    @classmethod
    def from_dict(cls, name: str, value: Any) -> Self:
        """Build the errors from plain data.

        Parameters
        ----------
        name : str
            Of the entry, for error texts.
        value : mapping
            As `to_dict` gives it, complete.

        Raises
        ------
        ValueError
            A name is unknown or missing, or a value does not fit; the entry is named.
        """
        given = mapping(name, value)
        _check_names(name, given)
        errors = {key: number(f"{name}.{key}", given[key], -LARGEST, LARGEST) for key in NAMES}
        bends = {key: number(f"{name}.{key}", given[key], 0.0) for key in _BENDS}
        walls = whole(f"{name}.walls", given["walls"])
        return cls(**errors, **bends, sigma=_deviations(f"{name}.sigma", given["sigma"]), walls=walls)


_BENDS = ("bend_before", "bend_after")
_ENTRIES = (*NAMES, "sigma", "walls", *_BENDS)


def _check_names(name: str, given: Mapping[str, Any]) -> None:
    if strange := sorted(set(given) - set(_ENTRIES)):
        raise ValueError(
            f"not a calibration: there is no '{name}.{strange[0]}'; known are {', '.join(_ENTRIES)}"
        )
    for needed in _ENTRIES:
        if needed not in given:
            raise ValueError(f"a calibration needs '{name}.{needed}'")


def _deviations(name: str, value: Any) -> tuple[float, float, float, float]:
    values = numbers(name, value)
    if len(values) != len(NAMES):
        raise ValueError(f"{name} has {len(values)} numbers, not {len(NAMES)}")
    cosine, sine, lateral, offset = (number(f"{name}[{k}]", v, 0.0) for k, v in enumerate(values))
    return cosine, sine, lateral, offset
