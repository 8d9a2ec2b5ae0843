"""glass.geojson: walls and observations for other programs."""

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from glassslam.glass.layer import GlassLayer
from glassslam.glass.observations import SONAR

if TYPE_CHECKING:
    from glassslam.glass.walls import GlassWall


def write_glass(layer: GlassLayer, path: Path) -> Path:
    """Write walls (LineString) and observations (Point) in metres of the map frame.

    Every feature has `properties.kind`: "wall" or "observation"; GeoJSON proper knows degrees of
    longitude and latitude only, so programs that draw on a globe will not find them.
    """
    features = [_wall(number, wall) for number, wall in enumerate(layer.walls)]
    features += [_observation(layer, k) for k in range(len(layer.observations))]
    document = {"type": "FeatureCollection", "frame": "map", "unit": "m", "features": features}
    path.write_text(json.dumps(document, allow_nan=False, separators=(",", ":")) + "\n", encoding="utf-8")
    return path


def _feature(kind: str, geometry: str, coordinates: Any, properties: dict[str, Any]) -> dict[str, Any]:
    return {
        "type": "Feature",
        "geometry": {"type": geometry, "coordinates": coordinates},
        "properties": {"kind": kind, **properties},
    }


def _metres(point: Any) -> list[float]:
    return [round(float(value), 4) for value in point]


def _wall(number: int, wall: "GlassWall") -> dict[str, Any]:
    return _feature(
        "wall",
        "LineString",
        [_metres(wall.start), _metres(wall.end)],
        {
            "id": number,
            "length_m": round(wall.length, 4),
            "observed_length_m": round(wall.observed_length, 4),
            "observations": wall.observations,
            "sonar_observations": wall.by_sonar,
            "nodes": wall.nodes,
            "probability": round(wall.probability, 6),
            "position_sigma_m": round(wall.position_sigma, 5),
            "angle_sigma_deg": round(math.degrees(wall.angle_sigma), 4),
        },
    )


def _observation(layer: GlassLayer, k: int) -> dict[str, Any]:
    seen = layer.observations
    return _feature(
        "observation",
        "Point",
        _metres(layer.positions[k]),
        {
            "sensor": "sonar" if seen.sensor_kind[k] == SONAR else "lidar",
            "node": int(seen.node[k]),
            "normal_deg": round(math.degrees(float(layer.normals[k])), 3),
            "strength": round(float(seen.strength[k]), 4),
            "probability": round(float(seen.probability[k]), 4),
            "position_sigma_m": round(float(seen.position_sigma[k]), 5),
            "normal_sigma_deg": round(math.degrees(float(seen.normal_sigma[k])), 4),
        },
    )
