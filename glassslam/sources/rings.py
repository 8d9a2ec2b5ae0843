"""Rings of sonars described in YAML: those shipped, and those of a user."""

import difflib
from pathlib import Path
from typing import Annotated, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from glassslam.errors import UsageError
from glassslam.records import SonarRing
from glassslam.yamlmodel import load_yaml_model

Number = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]

_FOLDER = Path(__file__).resolve().parent / "rings"


class RingFile(BaseModel):
    """A ring as its file describes it; unknown names are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    what: str = ""
    """The robot, in words."""
    field_of_view_deg: Annotated[float, Field(gt=0.0, le=180.0)]
    """Full opening angle of a cone, deg."""
    range_min: Annotated[float, Field(ge=0.0, allow_inf_nan=False)] = 0.0
    """Shorter ranges are no readings, m."""
    range_max: Positive
    """Ranges from here on mean that nothing answered, m."""
    sonars: Annotated[tuple[tuple[Number, Number, Number], ...], Field(min_length=1)]
    """x, y (m) and heading (deg) of every sonar in the base frame, in the order of the messages."""

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.range_min >= self.range_max:
            raise ValueError("range_min must be below range_max")
        return self

    def ring(self, name: str) -> SonarRing:
        """The ring as a record."""
        poses = np.array(self.sonars, dtype=np.float64)
        poses[:, 2] = np.radians(poses[:, 2])
        field_of_view = float(np.radians(self.field_of_view_deg))
        return SonarRing(poses, field_of_view, self.range_min, self.range_max, name)


def ring_names() -> tuple[str, ...]:
    """Names of the shipped rings."""
    return tuple(sorted(path.stem for path in _FOLDER.glob("*.yaml")))


def load_ring(name: str | Path) -> SonarRing:
    """A shipped ring by its name, or one described in a YAML file.

    Parameters
    ----------
    name : str or Path
        One of `ring_names`, or the path of a file.

    Raises
    ------
    UsageError
        The name is not known.
    ConfigError
        The file cannot be read, or describes no ring.
    """
    text = str(name)
    if text in ring_names():
        return load_yaml_model(_FOLDER / f"{text}.yaml", RingFile).ring(text)
    path = Path(name)
    if path.suffix in {".yaml", ".yml"} or path.is_file():
        return load_yaml_model(path, RingFile).ring(path.stem)
    close = difflib.get_close_matches(text, ring_names(), n=1)
    known = f"known are {', '.join(ring_names())}, or name a YAML file"
    raise UsageError(f"unknown sonar ring {text!r}", f"did you mean {close[0]!r}?" if close else known)
