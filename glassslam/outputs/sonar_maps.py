"""Maps of the sonars, of lidar and sonar together, and what is reported of them."""

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glassslam.errors import OutputError
from glassslam.outputs.map_server import write_map
from glassslam.outputs.picture import write_picture
from glassslam.slam.result import MapResult

# blue, green, red: neither, lidar, sonar, both
_COLOURS = np.array([[205, 205, 205], [200, 130, 60], [60, 150, 240], [110, 170, 60]], dtype=np.uint8)


def write_sonar_maps(result: MapResult, folder: Path) -> list[Path]:
    """Write the sonar map, the fused map and, where the rule tells, who decided each of its cells.

    Parameters
    ----------
    result : MapResult
        The run; nothing is written where it had no sonar.
    folder : Path
        Where the files go.
    """
    if result.sonar is None:
        return []
    written: list[Path] = []
    for name, grid in (("sonar_map", result.sonar.sonar_map), ("fused_map", result.sonar.fused_map)):
        written += write_map(grid, folder / f"{name}.yaml")
        written.append(write_picture(grid, result.trajectory, folder / f"{name}.png"))
    if result.sonar.source is not None:
        written.append(write_sources(result.sonar.source, folder / "source_map.png"))
    return written


def describe_sonar(result: MapResult) -> dict[str, Any] | None:
    """What the sonars did, in numbers, for the report; None where there were none.

    Parameters
    ----------
    result : MapResult
        The run.
    """
    sonar, config = result.sonar, result.config.sonar
    if sonar is None:
        return None
    cone = sonar.cone
    is_measured = not math.isnan(cone.width)
    return {
        "sweeps": sonar.sweeps,
        "algorithm": config.algorithm,
        "pose_kind": config.pose_kind,
        "fusion": config.fusion.method,
        "cone": {
            "used_deg": math.degrees(sonar.cone_width),
            "measured_deg": math.degrees(cone.width) if is_measured else None,
            "between_deg": [math.degrees(cone.low), math.degrees(cone.high)] if is_measured else None,
            "readings": cone.readings,
            "bias_m": cone.bias if is_measured else None,
            "spread_m": cone.spread if is_measured else None,
        },
    }


def write_sources(source: NDArray[np.uint8], path: Path) -> Path:
    """Write who decided each cell (row 0 at the lowest y), highest y on top.

    Cells of the lidar are blue, of the sonar orange, of both green, of neither grey.
    """
    import cv2  # noqa: PLC0415  (only pictures need it)

    encoded, data = cv2.imencode(".png", _COLOURS[source[::-1]])
    if not encoded:
        raise OutputError(f"the map of {source.shape} cells cannot be drawn as PNG")
    path.write_bytes(data.tobytes())
    return path
