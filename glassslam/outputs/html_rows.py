"""What a report says, in words: pairs of name and value for the tables of a web page."""

import math
from collections.abc import Iterator, Sequence
from pathlib import PurePath
from typing import TYPE_CHECKING, Any, TypeAlias

from glassslam.records import Damage

if TYPE_CHECKING:
    from glassslam.glass.walls import GlassWall

Report: TypeAlias = dict[str, Any]
Rows: TypeAlias = Iterator[tuple[str, str]]

_UNITS = {"translation_rms": ("m", 1.0), "rotation_rms": ("deg", math.degrees(1.0))}

WALL_COLUMNS = (
    "wall",
    "length, m",
    "observed, m",
    "probability",
    "± across, m",
    "± direction, deg",
    "observations",
    "sensors",
    "from x, y, m",
    "to x, y, m",
)


def recording_name(report: Report) -> str:
    """Base name of the recording; of several the first, and how many more there are."""
    paths = report["source"]["paths"] if report["source"] else []
    if not paths:
        return "glassslam map"
    first = PurePath(paths[0]).name or paths[0]
    return first if len(paths) == 1 else f"{first} and {len(paths) - 1} more"


def recording_rows(report: Report) -> Rows:
    """Where the records came from."""
    source = report["source"]
    if not source:
        return
    for path in source["paths"]:
        yield "file", path
    yield "format", source["format"]
    for name in ("scan", "odom", "imu"):
        yield f"{name} topic", source[f"{name}_topic"] or "none"
    for topic in source["sonar_topics"]:
        yield "points topic" if topic in source["points_topics"] else "sonar topic", topic
    if ring := source["sonar_ring"]:
        yield "sonar ring", f"{ring['name'] or 'from the recording'}: {len(ring['poses'])} sonars"
    x, y, yaw = source["base_from_laser"]
    yaw = None if yaw is None else math.degrees(yaw)
    yield "laser on the robot", f"x {_number(x, 3)} m, y {_number(y, 3)} m, yaw {_number(yaw, 2)} deg"


def recorded(report: Report) -> str:
    """Length of the recording."""
    return f"{_number(report['recording_seconds'], 1)} s recorded"


def travelled(report: Report) -> str:
    """Length of the path."""
    return f"{_number(report['distance_m'], 1)} m travelled"


def run_rows(report: Report) -> Rows:
    """What was read and used, and how it fits together."""
    scans, closures, shape = report["scans"], report["closures"], report["map"]
    width, height = (shape["resolution"] * shape[side] for side in ("columns", "rows"))
    yield "scans", f"{scans['read']} read, {scans['used']} used"
    yield from _counted("scans dropped", scans["dropped"])
    yield from _counted("messages dropped", report["messages_dropped"])
    yield "time", recorded(report)
    yield "distance", travelled(report)
    yield "map", f"{width:.1f} x {height:.1f} m, {shape['resolution']:g} m per cell"
    yield "graph", f"{report['nodes']} nodes, {report['submaps']} submaps"
    yield from _counted("constraints", report["constraints"])
    yield "loop closures", f"{closures['accepted']} accepted of {closures['tried']} tried"
    yield from _counted("closures rejected", closures["rejected"])
    for name, value in report["residuals"].items():
        if value is not None:
            yield "residual", _residual(name, value)
    if report["solver_failures"]:
        yield "solver", f"failed {report['solver_failures']} times"


def degeneracy_rows(report: Report) -> Rows:
    """Stretches the scans did not decide: what, when, where and how long."""
    for one in report["degeneracies"]:
        start, end = (_number(one[f"{side}_after_seconds"], 1) for side in ("start", "end"))
        places = (", ".join(_number(value, 1) for value in one[f"{side}_place"]) for side in ("start", "end"))
        where = "({}) to ({})".format(*places)
        yield one["kind"], f"{start} to {end} s, {where}, {_number(one['length_m'], 1)} m: {one['text']}"


def tracking_rows(report: Report) -> Rows:
    """What local SLAM and the loop closures had to do beside plain matching."""
    for name, count in report["tracking"].items():
        yield name.replace("_", " "), f"{count}"


def glass_rows(glass: dict[str, Any]) -> Rows:
    """What the detector was and what it has found."""
    yield "detector", glass["detector"]
    if glass["reason"]:
        yield "reason", glass["reason"]
    if "walls" not in glass:
        yield "found", "nothing: glass was not looked for"
        return
    yield "scheme", glass["scheme"]
    yield "walls", f"{glass['walls']}, {glass['wall_length_m']:.1f} m together"
    yield "observations", f"{glass['observations']}"
    yield "cells locked", f"{glass['locked_cells']}"
    yield "beams labelled", f"{glass['labelled_beams']}"
    yield "returns seen through glass", f"{glass['returns_seen_through']}"
    yield "returns mirrored", f"{glass['returns_mirrored']}"
    yield "ghost cells", f"{glass['ghost_cells']}"


def sonar_rows(sonar: Report | None) -> Rows:
    """What the sonars have seen, and how it was joined with the lidar."""
    if sonar is None:
        return
    yield "sweeps", f"{sonar['sweeps']}"
    yield "sonar map", f"{sonar['algorithm']}, poses {sonar['pose_kind']}"
    yield "joined by", sonar["fusion"]
    cone = sonar["cone"]
    yield "cone", f"{cone['used_deg']:.0f} deg"
    if cone["measured_deg"] is None:
        yield "cone as measured", f"not known: the map explains {cone['readings']} readings only"
        return
    low, high = cone["between_deg"]
    measured = f"{cone['measured_deg']:.0f} deg ({low:.0f} to {high:.0f}), from {cone['readings']} readings"
    yield "cone as measured", measured
    yield (
        "ranges",
        f"{100.0 * cone['bias_m']:+.1f} cm of the lidar's, spread {100.0 * cone['spread_m']:.1f} cm",
    )


def volume_rows(volume: Report | None) -> Rows:
    """What the 3D ultrasonic sensors have added."""
    if volume is None:
        return
    (low, high), edge = volume["band_m"], volume["resolution"]
    yield "points", f"{volume['points']} of {volume['point_sets']} pings"
    yield "scans", f"{volume['scans']}, {volume['pairs']} of them paired with a ping"
    yield from _counted("left out", volume["dropped"])
    size = " x ".join(_number(b - a, 1) for a, b in zip(*volume["bounds_m"], strict=True))
    yield "size", f"{size} m, {edge:g} m per voxel"
    yield "voxels", f"{volume['occupied_voxels']} occupied, {volume['free_voxels']} free"
    yield "plane of the lidar", f"{volume['lidar_height_m']:g} m above the base"
    yield "heights in the map", f"{low:g} to {high:g} m above the base, by {volume['projection']}"
    yield "joined by", volume["pool"]


def cost_rows(report: Report) -> Rows:
    """Times and memory: all that differs between two runs on the same input."""
    for name, stage in report["stages"].items():
        yield name, f"{stage['wall']:.2f} s ({stage['cpu']:.2f} s CPU)"
    if resources := report.get("resources"):
        wall, cpu = resources["wall_seconds"], resources["cpu_seconds"]
        yield "total", f"{wall:.2f} s ({cpu:.2f} s CPU), {resources['real_time_factor']:.1f}x real time"
        yield "peak memory", f"{resources['peak_memory_mb']:.0f} MB"


def alarms(report: Report) -> list[str]:
    """Damage of the recording and warnings, one line each."""
    return [*(f"damage: {Damage(**part).text}" for part in report["damage"]), *report["warnings"]]


def wall_cells(walls: Sequence["GlassWall"]) -> Iterator[tuple[str, ...]]:
    """One row of `WALL_COLUMNS` for every wall, in the order of glass.geojson."""
    for number, wall in enumerate(walls):
        yield (
            f"{number}",
            f"{wall.length:.2f}",
            f"{wall.observed_length:.2f}",
            f"{wall.probability:.3f}",
            f"{wall.position_sigma:.3f}",
            f"{math.degrees(wall.angle_sigma):.2f}",
            f"{wall.observations}",
            _sensors(wall),
            "{:.2f}, {:.2f}".format(*wall.start),
            "{:.2f}, {:.2f}".format(*wall.end),
        )


def _sensors(wall: "GlassWall") -> str:
    lidar = wall.observations - wall.by_sonar
    seen = ((lidar, "lidar"), (wall.by_sonar, "sonar"))
    return ", ".join(f"{name} {count}" for count, name in seen if count) or "none"


def _number(value: float | None, digits: int) -> str:
    """A number of the report, in which those that JSON does not know are None."""
    return "?" if value is None else f"{value:.{digits}f}"


def _residual(name: str, value: float) -> str:
    for ending, (unit, factor) in _UNITS.items():
        if name.endswith(ending):
            return f"{name.replace('_', ' ')} {value * factor:.4g} {unit}"
    return f"{name.replace('_', ' ')} {value:.4g}"


def _counted(name: str, counts: dict[str, int]) -> Rows:
    for reason, count in counts.items():
        if count:
            yield name, f"{count} x {reason}"
