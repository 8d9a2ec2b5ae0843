"""Maps for map_server and nav2: `map.yaml` beside a trinary `map.pgm`."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from glassslam.errors import GridError, OutputError
from glassslam.outputs.image_file import read_image
from glassslam.outputs.table import read_text
from glassslam.records import Float32Array
from glassslam.slam.result import OccupancyMap
from glassslam.yamltext import parse_yaml

OCCUPIED_THRESH = 0.65
FREE_THRESH = 0.196
OCCUPIED, UNKNOWN, FREE = 0, 205, 254
_FINEST, _COARSEST, _FARTHEST = 1e-3, 1e3, 1e9


def trinary_image(grid: OccupancyMap) -> NDArray[np.uint8]:
    """Grey levels of a map as map_server wants them: 0 occupied, 205 unknown, 254 free.

    Parameters
    ----------
    grid : OccupancyMap
        Probabilities; NaN is unknown.

    Returns
    -------
    ndarray of uint8, shape (rows, columns)
        An image: row 0 is the highest y.
    """
    image = np.full(grid.probability.shape, UNKNOWN, dtype=np.uint8)
    image[grid.probability > OCCUPIED_THRESH] = OCCUPIED
    image[grid.probability < FREE_THRESH] = FREE
    return image[::-1]


def write_map(grid: OccupancyMap, path: str | Path) -> list[Path]:
    """Write a map for map_server: the YAML file and, beside it, the image it names.

    Parameters
    ----------
    grid : OccupancyMap
        The map.
    path : str or Path
        The YAML file; the image takes its name with the suffix .pgm.

    Returns
    -------
    list of Path
        The two files written.

    Raises
    ------
    GridError
        The map has no cells.
    OSError
        A file cannot be written.
    """
    description, image = Path(path), Path(path).with_suffix(".pgm")
    if grid.probability.size == 0:
        raise GridError("the map has no cells", "was there any scan with a range in it?")
    pixels = trinary_image(grid)
    image.write_bytes(b"P5\n%d %d\n255\n" % pixels.shape[::-1] + pixels.tobytes())
    # Written by hand: YAML 1.1 writers turn 5e-05 into a string that nav2 cannot read back as a number.
    description.write_text(
        f"image: {image.name}\nmode: trinary\nresolution: {grid.resolution:.9f}\n"
        f"origin: [{grid.origin[0]:.9f}, {grid.origin[1]:.9f}, 0.0]\n"
        f"negate: 0\noccupied_thresh: {OCCUPIED_THRESH}\nfree_thresh: {FREE_THRESH}\n",
        encoding="ascii",
    )
    return [description, image]


def read_map(path: str | Path) -> OccupancyMap:
    """Read a trinary map_server map by the rules of nav2.

    Parameters
    ----------
    path : str or Path
        The YAML file, or the directory that holds `map.yaml`.

    Returns
    -------
    OccupancyMap
        Probability 1 where occupied, 0 where free, NaN where unknown.

    Raises
    ------
    OutputError
        A file cannot be read, a value is missing or unfit, or the map is turned against its axes.
    """
    location = Path(path) / "map.yaml" if Path(path).is_dir() else Path(path)
    fields = _read_fields(location)
    shade = _read_image(location.parent / str(fields["image"])) / 255.0
    occupied = shade if fields.get("negate") else 1.0 - shade
    x, y, yaw = fields["origin"]
    if not math.isclose(yaw, 0.0, abs_tol=1e-9):
        raise OutputError(f"{location}: the map is turned by {yaw} rad", "only maps with yaw 0 can be read")
    probability = _trinary(occupied, fields["free_thresh"], fields["occupied_thresh"])
    return OccupancyMap(probability, fields["resolution"], (x, y))


def read_picture(path: str | Path, resolution: float) -> OccupancyMap:
    """Read a picture of a map, with the thresholds of map_server and its lower left corner in the origin.

    Parameters
    ----------
    path : str or Path
        PGM, PNG, or what else OpenCV reads.
    resolution : float
        Edge of a cell, m.

    Raises
    ------
    OutputError
        The file cannot be read or is no picture.
    """
    occupied = 1.0 - _read_image(Path(path)) / 255.0
    return OccupancyMap(_trinary(occupied, FREE_THRESH, OCCUPIED_THRESH), resolution, (0.0, 0.0))


def _trinary(occupied: NDArray[np.float64], free: float, full: float) -> Float32Array:
    """Probabilities, row 0 at the lowest y, of an image of occupancies."""
    probability = np.full(occupied.shape, np.nan, dtype=np.float32)
    probability[occupied < free] = 0.0
    probability[occupied > full] = 1.0
    return probability[::-1].copy()


def _read_fields(location: Path) -> dict[str, Any]:
    try:
        fields = parse_yaml(read_text(location, OutputError))
    except yaml.YAMLError as error:
        raise OutputError(f"{location} is not YAML: {str(error).splitlines()[0]}") from error
    if not isinstance(fields, dict) or not fields.get("image"):
        raise OutputError(f"{location} describes no map", "expected the YAML file of a map_server map")
    try:
        for name in ("resolution", "occupied_thresh", "free_thresh"):
            fields[name] = float(fields[name])
        x, y, yaw = (float(value) for value in fields["origin"])
    except (KeyError, TypeError, ValueError) as error:
        raise OutputError(f"{location}: a value is missing or no number: {error}") from error
    if not _FINEST <= fields["resolution"] <= _COARSEST:
        hint = f"expected {_FINEST:g} to {_COARSEST:g} m per cell"
        raise OutputError(f"{location}: the resolution is {fields['resolution']:g} m", hint)
    if not all(abs(value) < _FARTHEST for value in (x, y, yaw)):
        raise OutputError(f"{location}: the origin lies at {x:g}, {y:g}, turned by {yaw:g}")
    return {**fields, "origin": (x, y, yaw)}


def _read_image(location: Path) -> NDArray[np.float64]:
    return read_image(location).astype(np.float64)
