"""The report of a run: everything counted and timed, as plain data for JSON."""

import math
import platform
import resource
import sys
import time
from collections import Counter
from dataclasses import asdict, dataclass
from importlib import metadata
from typing import Any

import numpy as np

from glassslam.outputs.sonar_maps import describe_sonar
from glassslam.outputs.volume_maps import describe_volume
from glassslam.records import Trajectory
from glassslam.slam.result import MapResult, RunStatistics

_LEAST_STEP = 0.05
_REPORTED_PACKAGES = ("glassslam", "numpy", "scipy", "numba", "casadi")


@dataclass(frozen=True, slots=True)
class Usage:
    """What a run has cost.

    Attributes
    ----------
    wall, cpu : float
        Elapsed time, and processor time of all threads, s.
    peak_memory_mb : float
        Largest resident memory of the process so far, MB (1e6 bytes).
    """

    wall: float
    cpu: float
    peak_memory_mb: float


class Stopwatch:
    """Measures what the process uses from here on.

    Examples
    --------
    >>> from glassslam.outputs import Stopwatch
    >>> Stopwatch().read().wall >= 0.0
    True
    """

    def __init__(self) -> None:
        self._wall, self._cpu = time.monotonic(), time.process_time()

    def read(self) -> Usage:
        """Times since the start of the watch, and the peak memory of the process."""
        return Usage(time.monotonic() - self._wall, time.process_time() - self._cpu, peak_memory_mb())


def peak_memory_mb() -> float:
    """Largest resident memory of this process so far, MB (1e6 bytes)."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak * (1.0 if sys.platform == "darwin" else 1024.0) / 1e6


def distance_travelled(trajectory: Trajectory) -> float:
    """Length of the path in steps of 5 cm or more, m: the noise of a robot that stands is no travel.

    Parameters
    ----------
    trajectory : Trajectory
        Poses in their order.
    """
    total, last = 0.0, (math.nan, math.nan)
    for x, y in trajectory.poses[:, :2].tolist():
        step = math.hypot(x - last[0], y - last[1])
        if not step < _LEAST_STEP:  # the first one is no number
            total += 0.0 if math.isnan(step) else step
            last = x, y
    return total


def real_time_factor(statistics: RunStatistics, wall: float) -> float:
    """Recorded seconds processed per second of elapsed time."""
    return statistics.recording_seconds / max(wall, 1e-9)


def build_report(result: MapResult, usage: Usage | None = None) -> dict[str, Any]:
    """Everything known of a run as nested plain data; only "stages" and "resources" differ between runs.

    Parameters
    ----------
    result : MapResult
        The finished run.
    usage : Usage, optional
        Cost of the whole run; left out of the report when not known.

    Returns
    -------
    dict
        Ready for JSON: numbers that are not finite have become None.
    """
    statistics, rows, columns = result.statistics, *result.map.probability.shape
    report: dict[str, Any] = {
        "source": asdict(result.info) if result.info else None,
        "scans": {
            "read": statistics.scans_read,
            "used": statistics.scans_used,
            "dropped": dict(statistics.scans_dropped),
        },
        "messages_dropped": dict(statistics.messages_dropped),
        "damage": [asdict(damage) for damage in statistics.damage],
        "recording_seconds": statistics.recording_seconds,
        "distance_m": distance_travelled(result.trajectory),
        "nodes": statistics.nodes,
        "submaps": statistics.submaps,
        "closures": {
            "tried": statistics.closures_tried,
            "accepted": statistics.closures_accepted,
            "rejected": dict(statistics.closures_rejected),
        },
        "constraints": dict(sorted(Counter(constraint.kind for constraint in result.constraints).items())),
        "solver_failures": statistics.solver_failures,
        "residuals": dict(statistics.residuals),
        "tracking": dict(statistics.tracking),
        "degeneracies": _degeneracies(result),
        "map": {
            "resolution": result.map.resolution,
            "rows": rows,
            "columns": columns,
            "origin": list(result.map.origin),
        },
        "glass": _glass(result),
        "sonar": describe_sonar(result),
        "volume": describe_volume(result),
        "warnings": list(statistics.warnings),
        "versions": versions(),
        "stages": {name: asdict(stage) for name, stage in statistics.stages.items()},
    }
    if usage:
        report["resources"] = {
            "wall_seconds": usage.wall,
            "cpu_seconds": usage.cpu,
            "peak_memory_mb": usage.peak_memory_mb,
            "real_time_factor": real_time_factor(statistics, usage.wall),
        }
    return _plain(report)  # type: ignore[no-any-return]


def _degeneracies(result: MapResult) -> list[dict[str, Any]]:
    """Stretches a reader should know of; times from the first scan beside the stamps."""
    stamps = result.trajectory.stamps
    first = float(stamps[0]) if len(stamps) else 0.0
    return [
        {
            "kind": one.kind,
            "first_scan": one.first_scan,
            "last_scan": one.last_scan,
            "start": one.start,
            "end": one.end,
            "start_after_seconds": one.start - first,
            "end_after_seconds": one.end - first,
            "start_place": list(one.start_place),
            "end_place": list(one.end_place),
            "length_m": one.length,
            "text": one.text,
        }
        for one in result.statistics.degeneracies
    ]


def _glass(result: MapResult) -> dict[str, Any]:
    """Glass in numbers; where it was not looked for, the reason alone."""
    chosen = {
        "detector": result.statistics.glass_detector,
        "reason": result.statistics.glass_reason,
    }
    if result.glass is None:
        return chosen
    from glassslam.glass.ghosts import MIRRORED, SEEN_THROUGH  # noqa: PLC0415  (loads numba)

    layer, ghosts = result.glass, result.glass.ghosts
    return {
        **chosen,
        "scheme": result.config.glass.scheme,
        "walls": len(layer.walls),
        "wall_length_m": sum(wall.length for wall in layer.walls),
        "observations": len(layer.observations),
        "locked_cells": len(layer.locked_cells),
        "labelled_beams": 0 if layer.beams is None else len(layer.beams),
        "returns_seen_through": 0 if ghosts is None else ghosts.count(SEEN_THROUGH),
        "returns_mirrored": 0 if ghosts is None else ghosts.count(MIRRORED),
        "ghost_cells": len(layer.ghost_cells),
    }


def versions() -> dict[str, str]:
    """Versions of Python and of the packages whose numbers decide a map."""
    found = {"python": platform.python_version()}
    for name in _REPORTED_PACKAGES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = "unknown"
    return found


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value
