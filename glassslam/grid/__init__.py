"""Probability grids and the submaps made of them."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from glassslam.grid.probability_grid import OddsModel, ProbabilityGrid
    from glassslam.grid.submap import ActiveSubmaps, Submap

_HOMES = {
    "ActiveSubmaps": "glassslam.grid.submap",
    "OddsModel": "glassslam.grid.odds",
    "ProbabilityGrid": "glassslam.grid.probability_grid",
    "Submap": "glassslam.grid.submap",
}

__all__ = ["ActiveSubmaps", "OddsModel", "ProbabilityGrid", "Submap"]


def __getattr__(name: str) -> Any:
    """Import the kernels only when a grid is made: naming an `OddsModel` needs no numba."""
    if name in _HOMES:
        from importlib import import_module  # noqa: PLC0415

        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
