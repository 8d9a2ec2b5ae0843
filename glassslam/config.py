"""Typed, frozen, validated configuration; Cartographer's parameter names where the meaning is the same."""

import difflib
from pathlib import Path
from typing import Any, Self

import yaml
from pydantic import BaseModel, ValidationError

from glassslam.errors import ConfigError
from glassslam.parameters.base import Section, Solver
from glassslam.parameters.glass import GlassConfig, GlassWallConfig
from glassslam.parameters.slam import (
    FilterConfig,
    GridConfig,
    LocalConfig,
    LoopClosureConfig,
    MapConfig,
    MotionFilterConfig,
    OptimizationConfig,
    SensorConfig,
    SubmapConfig,
)
from glassslam.parameters.sonar import FusionConfig, ScanFilterConfig, SonarConfig, SonarGlassConfig
from glassslam.parameters.volume import VolumeConfig
from glassslam.regularfile import regular
from glassslam.yamlmodel import expected
from glassslam.yamltext import parse_yaml, unreadable

__all__ = [
    "Config",
    "FilterConfig",
    "FusionConfig",
    "GlassConfig",
    "GlassWallConfig",
    "GridConfig",
    "LocalConfig",
    "LoopClosureConfig",
    "MapConfig",
    "MotionFilterConfig",
    "OptimizationConfig",
    "ScanFilterConfig",
    "SensorConfig",
    "Solver",
    "SonarConfig",
    "SonarGlassConfig",
    "SubmapConfig",
    "VolumeConfig",
]


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
            text = regular(path).read_text(encoding="utf-8")
            data = parse_yaml(text)
        except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
            raise ConfigError(f"cannot read configuration {path}: {unreadable(error)}") from error
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


def _names(model: type[BaseModel], location: tuple[Any, ...]) -> list[str]:
    for part in location:
        annotation = model.model_fields[part].annotation if part in model.model_fields else None
        if not (isinstance(annotation, type) and issubclass(annotation, BaseModel)):
            return []
        model = annotation
    return list(model.model_fields)


def _suggestion(model: type[BaseModel], location: tuple[Any, ...]) -> str:
    known, wrong = _names(model, location[:-1]), str(location[-1])
    elsewhere = _homes(model, wrong)
    close = elsewhere or difflib.get_close_matches(wrong, known, n=1)
    return f"did you mean {' or '.join(map(repr, close))}?" if close else f"known here: {', '.join(known)}"


def _homes(model: type[BaseModel], name: str, section: str = "") -> list[str]:
    """Full names of all parameters and sections that are called so, wherever they are."""
    homes = []
    for part, field in model.model_fields.items():
        place, inner = f"{section}{part}", field.annotation
        if part == name:
            homes.append(place)
        if isinstance(inner, type) and issubclass(inner, BaseModel):
            homes += _homes(inner, name, f"{place}.")
    return homes


def _explain(model: type[BaseModel], error: ValidationError, origin: str) -> ConfigError:
    first = error.errors()[0]
    location = tuple(first["loc"])
    name = ".".join(str(part) for part in location)
    if first["type"] == "extra_forbidden":
        return ConfigError(f"{origin}: unknown parameter {name!r}", _suggestion(model, location))
    if first["type"] == "value_error":  # raised by our own checks, which quote what they found
        return ConfigError(f"{origin}: {name}: {first['ctx']['error']}")
    return ConfigError(f"{origin}: {name}: {expected(first)}", f"found {first['input']!r:.60}")
