"""The table at the end of a run."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.table import Table

from glassslam.cli.progress import speed
from glassslam.cli.terminal import emit_rich
from glassslam.records import Damage

_TOLD_METRES = 0.1


def show_summary(report: dict[str, Any], written: Sequence[Path]) -> None:
    """Print what a run has found and cost, and the files it has written.

    Parameters
    ----------
    report : dict
        As made by `glassslam.outputs.build_report`.
    written : sequence of Path
        The files.
    """
    table = Table(box=None, show_header=False, padding=(0, 2, 0, 0))
    table.add_column(style="bold")
    table.add_column()
    for name, value in summary_rows(report):
        table.add_row(name, value)
    emit_rich(table, "", *(f"wrote {path}" for path in written))


def summary_rows(report: dict[str, Any]) -> list[tuple[str, str]]:
    """Lines of the summary as pairs of name and value."""
    scans, closures, shape = report["scans"], report["closures"], report["map"]
    width, height = (shape["resolution"] * shape[side] for side in ("columns", "rows"))
    rows = [
        ("scans", f"{scans['read']} read, {scans['used']} used, {_dropped(scans['dropped'])}"),
        *_unread(report["messages_dropped"]),
        *_damage(report["damage"]),
        ("recorded", f"{report['recording_seconds']:.1f} s, {report['distance_m']:.1f} m travelled"),
        ("map", f"{width:.1f} x {height:.1f} m, {shape['resolution']:g} m per cell"),
        ("graph", f"{report['nodes']} nodes, {report['submaps']} submaps"),
        ("loop closures", f"{closures['accepted']} of {closures['tried']} tried{_rejected(closures)}"),
    ]
    rows += _uncertain(report["degeneracies"])
    rows.append(("glass", _glass(report["glass"])))
    rows += _volume(report["volume"])
    rows += [("residual", f"{name} {value:.4g}") for name, value in _numbers(report["residuals"])]
    rows += [
        ("time", f"{name} {stage['wall']:.2f} s ({stage['cpu']:.2f} s CPU)")
        for name, stage in report["stages"].items()
    ]
    if resources := report.get("resources"):
        wall, cpu = resources["wall_seconds"], resources["cpu_seconds"]
        rows.append(("total", f"{wall:.2f} s ({cpu:.2f} s CPU), {speed(report['recording_seconds'], wall)}"))
        rows.append(("peak memory", f"{resources['peak_memory_mb']:.0f} MB"))
    return rows + [("warning", text) for text in report["warnings"]]


def _uncertain(stretches: list[dict[str, Any]]) -> list[tuple[str, str]]:
    """Stretches the scans did not decide, counted by kind in the order in which they first come."""
    if not stretches:
        return []
    parts = []
    for kind in dict.fromkeys(one["kind"] for one in stretches):
        lengths = [one["length_m"] for one in stretches if one["kind"] == kind]
        metres = sum(length or 0.0 for length in lengths)
        parts.append(f"{len(lengths)} x {kind}" + (f" ({metres:.1f} m)" if metres >= _TOLD_METRES else ""))
    return [("uncertain", f"{', '.join(parts)}; see report")]


def _glass(glass: dict[str, Any]) -> str:
    why = f" ({glass['reason']})" if glass["reason"] else ""
    if "walls" not in glass:
        return f"not looked for{why}"
    walls = f"{glass['walls']} wall{'s' * (glass['walls'] != 1)} of {glass['wall_length_m']:.1f} m"
    seen_by = "sonar" if glass["detector"] == "off" else glass["detector"]
    return f"{walls}, {glass['observations']} observations by {seen_by}{why}"


def _volume(volume: dict[str, Any] | None) -> list[tuple[str, str]]:
    if volume is None:
        return []
    low, high = volume["band_m"]
    voxels = f"{volume['occupied_voxels']} occupied and {volume['free_voxels']} free voxels"
    return [
        ("volume", f"{volume['points']} points of {volume['point_sets']} pings, {voxels}"),
        ("", f"map of {low:g} to {high:g} m, lidar {volume['lidar_height_m']:g} m above the base"),
        *(("", f"left out: {count} x {reason}") for reason, count in volume["dropped"].items()),
    ]


def _numbers(values: dict[str, float | None]) -> list[tuple[str, float]]:
    return [(name, value) for name, value in values.items() if value is not None]


def _dropped(reasons: dict[str, int]) -> str:
    total = sum(reasons.values())
    detail = ", ".join(f"{count} x {reason}" for reason, count in reasons.items() if count)
    return f"{total} dropped ({detail})" if total else "none dropped"


def _unread(reasons: dict[str, int]) -> list[tuple[str, str]]:
    return [("unreadable", f"{count} x {reason}") for reason, count in reasons.items() if count]


def _damage(parts: list[dict[str, Any]]) -> list[tuple[str, str]]:
    return [("damage", Damage(**part).text) for part in parts]


def _rejected(closures: dict[str, Any]) -> str:
    detail = ", ".join(f"{count} x {reason}" for reason, count in closures["rejected"].items() if count)
    return f"; rejected: {detail}" if detail else ""
