"""Glass as line segments: the files that hold it, and distances from it."""

import itertools
import json
import math
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from glassslam.errors import EvaluationError
from glassslam.records import FloatArray
from glassslam.regularfile import regular

Segments: TypeAlias = FloatArray
"""Start and end points, shape (n, 2, 2), m."""

_FARTHEST = 1e5  # m: what lies farther away is no building, and would be sampled every centimetre
_TRUE_KINDS = frozenset({"wall", "glass"})
_FOUND_KINDS = frozenset({"wall"})


def read_true_glass(path: str | Path) -> list[Segments]:
    """Read true panes, each a polyline.

    Parameters
    ----------
    path : str or Path
        GeoJSON whose LineStrings with `properties.kind` `wall` or `glass` are panes, in m; or JSON of
        lines `x = a * y + b` by run (`runs.NAME[].x_of_y`, `y_from`, `y_to`, and `mullions_y`, where
        one pane ends and the next begins).

    Returns
    -------
    list of ndarray of float64, shape (n, 2, 2)
        Segments of every pane, m; empty where the truth is that there is no glass.

    Raises
    ------
    EvaluationError
        The file cannot be read, is of neither form, or holds a pane that is no line.
    """
    content = _read_json(path)
    if isinstance(content, dict) and "runs" in content:
        return _panes_of_runs(content["runs"], path)
    return _lines(content, path, _TRUE_KINDS)


def read_glass_walls(path: str | Path) -> list[Segments]:
    """Read the walls of a `glass.geojson`, which are its LineStrings with `properties.kind` `wall`.

    Raises
    ------
    EvaluationError
        The file cannot be read, is no GeoJSON, or holds a wall that is no line.
    """
    return _lines(_read_json(path, "it is written by map when a glass detector is on"), path, _FOUND_KINDS)


def midpoints(segments: Segments, step: float) -> tuple[FloatArray, FloatArray]:
    """Middles of the pieces of at most `step` (m) that segments consist of, and their lengths.

    Returns
    -------
    points : ndarray of float64, shape (m, 2)
        Middles, m.
    lengths : ndarray of float64, shape (m,)
        Lengths of the pieces, m.
    """
    points, lengths = [np.empty((0, 2))], [np.empty(0)]
    for start, end in segments:
        length = float(np.hypot(*(end - start)))
        count = max(1, math.ceil(length / step))
        share = (np.arange(count) + 0.5) / count
        points.append(start + share[:, None] * (end - start))
        lengths.append(np.full(count, length / count))
    return np.concatenate(points), np.concatenate(lengths)


def distances(points: FloatArray, segments: Segments) -> FloatArray:
    """Distance of points (m, 2) from the nearest segment, m; infinite where there is no segment."""
    nearest = np.full(len(points), np.inf)
    for start, end in segments:
        along = end - start
        squared = float(along @ along)
        offset = points - start
        share = np.clip(offset @ along / squared, 0.0, 1.0) if squared > 0.0 else np.zeros(len(points))
        gap = offset - share[:, None] * along
        np.minimum(nearest, np.hypot(gap[:, 0], gap[:, 1]), out=nearest)
    return nearest


def _read_json(path: str | Path, hint: str = "") -> Any:
    try:
        return json.loads(regular(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise EvaluationError(f"cannot read {path}: {error.strerror}", hint) from error
    except (ValueError, RecursionError) as error:
        raise EvaluationError(f"{path} is no JSON", "glass is read from GeoJSON") from error


def _lines(content: Any, path: str | Path, kinds: frozenset[str]) -> list[Segments]:
    features = content.get("features") if isinstance(content, dict) else None
    if not isinstance(features, list):
        raise EvaluationError(f"{path} is no GeoJSON", "expected a FeatureCollection of lines")
    described = [(_kind(feature), feature) for feature in features]
    if features and all(kind is None for kind, _ in described):
        names = " or ".join(sorted(kinds))
        raise EvaluationError(f"no feature of {path} has properties.kind", f"glass has kind {names}")
    return [
        _segments(feature, f"feature {number} of {path}")
        for number, (kind, feature) in enumerate(described, start=1)
        if kind in kinds
    ]


def _kind(feature: Any) -> str | None:
    properties = feature.get("properties") if isinstance(feature, dict) else None
    kind = properties.get("kind") if isinstance(properties, dict) else None
    return kind if isinstance(kind, str) else None


def _segments(feature: dict[str, Any], name: str) -> Segments:
    geometry = feature.get("geometry")
    if not isinstance(geometry, dict) or geometry.get("type") != "LineString":
        raise EvaluationError(f"{name} is glass but no LineString")
    coordinates = geometry.get("coordinates")
    points = _points(coordinates) if isinstance(coordinates, list) else None
    if points is None or len(points) < 2:
        raise EvaluationError(f"{name} is no line of finite coordinates", "expected [[x, y], ...] in m")
    return np.array(list(itertools.pairwise(points)))


def _points(coordinates: list[Any]) -> FloatArray | None:
    """Planar part of the coordinates, shape (n, 2); None where they are no points."""
    try:
        points = np.array([position[:2] for position in coordinates], dtype=np.float64)
    except (TypeError, ValueError, IndexError, KeyError, OverflowError):
        return None
    sound = points.ndim == 2 and points.shape[1] == 2 and bool((np.abs(points) < _FARTHEST).all())
    return points if sound else None


def _panes_of_runs(runs: Any, path: str | Path) -> list[Segments]:
    if not isinstance(runs, dict) or len(runs) != 1:
        count = len(runs) if isinstance(runs, dict) else "no"
        raise EvaluationError(f"{path} holds the glass of {count} runs", "expected that of one run")
    name, lines = next(iter(runs.items()))
    try:
        return [pane for line in lines for pane in _panes_of_line(line)]
    except (TypeError, ValueError, KeyError, OverflowError) as error:
        raise EvaluationError(
            f"run {name} of {path} has a line that cannot be read",
            "expected x_of_y [a, b], y_from, y_to and mullions_y, in m",
        ) from error


def _panes_of_line(line: Any) -> list[Segments]:
    slope, offset = (float(value) for value in line["x_of_y"])
    borders = [float(y) for y in (line["y_from"], *line.get("mullions_y", ()), line["y_to"])]
    points = np.array([(slope * y + offset, y) for y in sorted(borders)])
    if not (np.abs(points) < _FARTHEST).all():
        raise ValueError
    return [points[None, k : k + 2] for k in range(len(points) - 1)]
