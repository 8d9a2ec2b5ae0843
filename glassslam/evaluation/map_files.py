"""Maps to compare, read from map_server files or plain pictures."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glassslam.errors import OutputError, UsageError
from glassslam.outputs import map_server
from glassslam.outputs.labels import GLASS, read_labels
from glassslam.outputs.table import read_text
from glassslam.slam.result import OccupancyMap
from glassslam.yamltext import parse_yaml

_PICTURES = frozenset({".pgm", ".png"})


def read_map(path: str | Path, resolution: float | None = None) -> OccupancyMap:
    """Read a map_server map or a plain picture of one.

    Parameters
    ----------
    path : str or Path
        A YAML file of map_server, a directory with `map.yaml`, or a PGM or PNG picture.
    resolution : float, optional
        Edge of a cell of a picture, m; a YAML file states its own.

    Returns
    -------
    OccupancyMap
        Probability 1 where occupied, 0 where free, NaN where unknown. A picture has its lower left corner in
        the origin and the thresholds map_server assumes.

    Raises
    ------
    UsageError
        The resolution of a picture is missing or not positive, or one is given for a YAML file.
    OutputError
        A file cannot be read, a value is missing or unfit, the map is turned against its axes, or its mode
        is raw.
    """
    location = Path(path)
    if location.suffix.lower() in _PICTURES:
        return _picture(location, resolution)
    if resolution is not None:
        raise UsageError(f"{path} states its own resolution", "leave --resolution out")
    description = location / "map.yaml" if location.is_dir() else location
    grid = map_server.read_map(description)
    if _mode(description) == "raw":
        raise OutputError(f"{description}: mode raw has no thresholds", "save the map in trinary mode")
    return grid


def read_glass_cells(path: str | Path) -> NDArray[np.bool_] | None:
    """Cells of glass of a map, from the picture of classes beside it; None where there is none.

    The classes of `X.yaml` are in `X.labels.png`, those of the `map.yaml` of a run in `labels.png`.

    Raises
    ------
    OutputError
        The picture cannot be read or shows other colours.
    """
    location = Path(path) / "map.yaml" if Path(path).is_dir() else Path(path)
    places = [location.with_suffix(".labels.png")]
    if location.name == "map.yaml":
        places.append(location.with_name("labels.png"))
    found = next((place for place in places if place.is_file()), None)
    return None if found is None else read_labels(found) == GLASS


def _mode(location: Path) -> Any:
    return parse_yaml(read_text(location, OutputError)).get("mode", "trinary")


def _picture(location: Path, resolution: float | None) -> OccupancyMap:
    if resolution is None:
        raise UsageError(f"{location} does not state its resolution", "give --resolution, metres per cell")
    if not 0.0 < resolution < np.inf:
        raise UsageError(f"a resolution of {resolution:g} m makes no map", "give a positive number")
    return map_server.read_picture(location, resolution)
