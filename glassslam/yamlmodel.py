"""YAML files read into frozen, validated models, with one-line errors that name the place."""

import difflib
import types
import typing
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydantic import BaseModel, ValidationError

from glassslam.errors import ConfigError
from glassslam.yamltext import parse_yaml

_M = TypeVar("_M", bound=BaseModel)


def load_yaml_model(path: str | Path, model: type[_M]) -> _M:
    """Read one YAML mapping and validate it as `model`.

    Raises
    ------
    ConfigError
        The file cannot be read, is no mapping, or holds an unknown, missing or unfit value.
    """
    try:
        data = parse_yaml(Path(path).read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        cause = error.strerror if isinstance(error, OSError) else str(error).splitlines()[0]
        raise ConfigError(f"cannot read {path}: {cause}") from error
    return validate_model(data, model, origin=str(path))


def validate_model(data: Any, model: type[_M], origin: str) -> _M:
    """Validate plain data as `model`; `origin` opens the error text.

    Raises
    ------
    ConfigError
        The data is no mapping, or holds an unknown, missing or unfit value.
    """
    if not isinstance(data, dict):
        raise ConfigError(f"{origin}: expected a mapping, found {type(data).__name__}")
    try:
        return model.model_validate(data)
    except ValidationError as error:
        raise _explain(model, error, origin) from error


def _explain(model: type[BaseModel], error: ValidationError, origin: str) -> ConfigError:
    first = error.errors()[0]
    location = first["loc"]
    place = ".".join(str(part) for part in location)
    if first["type"] == "extra_forbidden":
        known = _names(model, location[:-1])
        close = difflib.get_close_matches(str(location[-1]), known, n=1)
        hint = f"did you mean {close[0]!r}?" if close else f"known here: {', '.join(known)}"
        return ConfigError(f"{origin}: unknown name {place!r}", hint)
    message = first["msg"].removeprefix("Value error, ")
    hint = "" if first["type"] in {"missing", "value_error"} else f"found {first['input']!r:.60}"
    return ConfigError(f"{origin}: {place}: {message}" if place else f"{origin}: {message}", hint)


def _names(model: type[BaseModel], location: tuple[int | str, ...]) -> list[str]:
    """Field names of the model found at `location`; list indices and mapping keys are stepped over."""
    for part in location:
        if isinstance(part, str) and part in model.model_fields:
            inner = _model_in(model.model_fields[part].annotation)
            if inner is None:
                return []
            model = inner
    return list(model.model_fields)


def _model_in(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and not isinstance(annotation, types.GenericAlias):
        return annotation if issubclass(annotation, BaseModel) else None
    inner = (_model_in(argument) for argument in typing.get_args(annotation))
    return next((found for found in inner if found is not None), None)
