"""Entries of plain data checked one by one, so that a wrong one is named."""

import math
from collections.abc import Mapping, Sequence
from typing import Any


def number(
    name: str, value: Any, low: float = -math.inf, high: float = math.inf, *, infinite: bool = False
) -> float:
    """The value as a number from `low` to `high`.

    Raises
    ------
    ValueError
        It is no number, not finite unless that is allowed, or out of its limits.
    """
    _need(isinstance(value, int | float) and not isinstance(value, bool), f"{name} is no number", value)
    result = float(value)
    _need(not math.isnan(result) and (infinite or math.isfinite(result)), f"{name} is not finite", value)
    _need(low <= result <= high, f"{name} is not {_limits(low, high)}", value)
    return result


def whole(name: str, value: Any) -> int:
    """The value as a whole number of 0 or more.

    Raises
    ------
    ValueError
        It is none.
    """
    fits = isinstance(value, int) and not isinstance(value, bool) and value >= 0
    _need(fits, f"{name} is no whole number of 0 or more", value)
    return int(value)


def text(name: str, value: Any, known: Sequence[str] = ()) -> str:
    """The value as a text, one of those known where these are listed.

    Raises
    ------
    ValueError
        It is none.
    """
    _need(isinstance(value, str), f"{name} is no text", value)
    _need(not known or value in known, f"{name} is not one of {', '.join(known)}", value)
    return str(value)


def flag(name: str, value: Any) -> bool:
    """The value as yes or no.

    Raises
    ------
    ValueError
        It is neither.
    """
    _need(isinstance(value, bool), f"{name} is neither true nor false", value)
    return bool(value)


def mapping(name: str, value: Any) -> dict[str, Any]:
    """The value as a mapping from names.

    Raises
    ------
    ValueError
        It is none.
    """
    fits = isinstance(value, Mapping) and all(isinstance(key, str) for key in value)
    _need(fits, f"{name} is no mapping of names", value)
    return dict(value)


def numbers(name: str, value: Any) -> tuple[float, ...]:
    """The value as a sequence of finite numbers.

    Raises
    ------
    ValueError
        It is none.
    """
    fits = isinstance(value, Sequence) and not isinstance(value, str)
    _need(fits, f"{name} is no list of numbers", value)
    return tuple(number(f"{name}[{k}]", entry) for k, entry in enumerate(value))


def _need(condition: bool, complaint: str, value: Any) -> None:
    if not condition:
        raise ValueError(f"{complaint}: {value!r:.40}")


def _limits(low: float, high: float) -> str:
    return f"{low:g} or more" if math.isinf(high) else f"from {low:g} to {high:g}"
