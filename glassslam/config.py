"""Typed, frozen, validated configuration; Cartographer's parameter names where the meaning is the same."""

import difflib
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from glassslam.errors import ConfigError

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Probability = Annotated[float, Field(gt=0, lt=1)]
Count = Annotated[int, Field(ge=1)]


class Section(BaseModel):
    """One frozen group of parameters; unknown names are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", validate_default=True)


class SensorConfig(Section):
    """What is taken from the lidar and how its silent beams are read."""

    min_range: NonNegative = 0.0
    """Nearest range used, m; the sensor's own limit applies as well."""
    max_range: Positive = 30.0
    """Farthest range used as a hit, m."""
    missing_data_ray_length: NonNegative = 5.0
    """Free space cleared by a beam without echo, m."""


class Config(Section):
    """Everything that decides a map, apart from the recording itself."""

    sensor: SensorConfig = SensorConfig()

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
            data = yaml.safe_load(text)
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
    return ConfigError(f"{origin}: {name}: {first['msg']}", f"found {first['input']!r:.60}")


Solver = Literal["lm", "casadi"]
