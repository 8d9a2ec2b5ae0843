"""YAML files read into frozen, validated models, with one-line errors that name the place."""

import difflib
import types
import typing
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydantic import BaseModel, ValidationError

from glassslam.errors import ConfigError
from glassslam.regularfile import regular
from glassslam.yamltext import parse_yaml, unreadable

_M = TypeVar("_M", bound=BaseModel)

_WORDS = (
    ("expected a whole number", ("int_parsing", "int_type", "int_from_float", "int_parsing_size")),
    ("expected a number", ("float_parsing", "float_type")),
    ("expected true or false", ("bool_parsing", "bool_type")),
    ("expected a text", ("string_type",)),
    ("expected a list", ("list_type", "tuple_type")),
    ("expected a mapping of names to values", ("model_type", "dict_type")),
)
_EXPECTED = {kind: text for text, kinds in _WORDS for kind in kinds}


def load_yaml_model(path: str | Path, model: type[_M]) -> _M:
    """Read one YAML mapping and validate it as `model`.

    Raises
    ------
    ConfigError
        The file cannot be read, is no mapping, or holds an unknown, missing or unfit value.
    """
    try:
        data = parse_yaml(regular(path).read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise ConfigError(f"cannot read {path}: {unreadable(error)}") from error
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


def expected(problem: Mapping[str, Any]) -> str:
    """What pydantic expects of a value, in the words of those who write YAML."""
    message: str = problem["msg"]
    return _EXPECTED.get(problem["type"], message.removeprefix("Value error, "))


def _explain(model: type[BaseModel], error: ValidationError, origin: str) -> ConfigError:
    first = error.errors()[0]
    location = first["loc"]
    place = ".".join(str(part) for part in location)
    if first["type"] == "extra_forbidden":
        known = _names(model, location[:-1])
        close = difflib.get_close_matches(str(location[-1]), known, n=1)
        hint = f"did you mean {close[0]!r}?" if close else f"known here: {', '.join(known)}"
        return ConfigError(f"{origin}: unknown name {place!r}", hint)
    message = expected(first)
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
