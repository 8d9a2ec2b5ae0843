"""`glassslam inspect`: what is in a recording, and what `map` would use."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from glassslam.cli.map import PointsTopic, Sonar, SonarRing, SonarTopic, Strict

if TYPE_CHECKING:
    from glassslam.sources.report import (
        OdometryReport,
        RecordingReport,
        ScanReport,
        TransformReport,
    )
    from glassslam.sources.sonarreport import SonarReport, StampReport

EXAMPLES = """\
  glassslam inspect run.bag
  glassslam inspect rosbag2_2026_02_02/            a ROS 2 directory
  glassslam inspect run.clf.gz --json              for scripts
  glassslam inspect run.bag --sonar sonar.txt      with sonar from a second file
"""

Rows = Iterator[tuple[str, str]]

Recordings = Annotated[
    list[Path],
    typer.Argument(
        metavar="RECORDING...",
        help="ROS 1 or 2 bag (file or directory), mcap, CARMEN or Player log; several follow each other.",
        show_default=False,
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print the report as JSON.")]


def inspect(
    recordings: Recordings,
    sonar: Sonar = None,
    sonar_topic: SonarTopic = None,
    points_topic: PointsTopic = None,
    sonar_ring: SonarRing = None,
    strict: Strict = False,
    json: Json = False,
) -> int:
    """Show topics, times, scan geometry, silent beams, intensities, sonar, frames, and what map would use."""
    from glassslam.cli.terminal import emit, emit_rich  # noqa: PLC0415
    from glassslam.sources import SourceOptions  # noqa: PLC0415  (loads numpy)
    from glassslam.sources.inspection import inspect_recording  # noqa: PLC0415

    wishes = tuple(sonar_topic) if sonar_topic else None
    points = tuple(points_topic) if points_topic else None
    options = SourceOptions(
        sonar=sonar, sonar_topic=wishes, sonar_ring=sonar_ring, points_topic=points, strict=strict
    )
    report = inspect_recording(recordings, options)
    if json:
        from json import dumps  # noqa: PLC0415

        emit(dumps(report.to_dict(), indent=2, allow_nan=False) + "\n")
    else:
        emit_rich(_topics(report), "", _facts(report))
    return 3 if report.damage else 0


def _topics(report: "RecordingReport") -> Table:
    table = Table(box=None, padding=(0, 2, 0, 0))
    for name in ("topic", "type"):
        table.add_column(name, overflow="fold")
    for name in ("count", "Hz"):
        table.add_column(name, justify="right")
    for topic in report.topics:
        table.add_row(topic.name, topic.msgtype, str(topic.count), f"{topic.rate:.1f}")
    return table


def _facts(report: "RecordingReport") -> Table:
    table = Table(box=None, show_header=False, padding=(0, 2, 0, 0))
    table.add_column(style="bold")
    table.add_column(overflow="fold")
    for name, value in rows(report):
        table.add_row(name, value)
    return table


def rows(report: "RecordingReport") -> Rows:
    """Everything but the topics, as pairs of name and value."""
    yield "recording", f"{report.format}, {report.size / 1e6:.1f} MB, {report.duration:.1f} s"
    for scan in report.scans:
        yield from _scan_rows(scan)
    for odometry in report.odometry:
        yield from _odometry_rows(odometry)
    for imu in report.imus:
        yield f"imu {imu.topic}", f"frame {imu.frame_id or '(none)'}, {_times(imu.stamps)}"
        yield "", f"yaw rate mean {imu.yaw_rate_mean:.4f}, extreme {imu.yaw_rate_extreme:.3f} rad/s"
    for sonar in report.sonars:
        yield from _sonar_rows(sonar)
    for number, edge in enumerate(report.transforms):
        yield "" if number else "frames", _transform(edge)
    for damage in report.damage:
        yield "damage", damage.text
    for reason, count in report.dropped.items():
        yield "dropped", f"{count} x {reason}"
    for warning in report.warnings:
        yield "warning", warning
    yield from _plan_rows(report)


def _scan_rows(scan: "ScanReport") -> Rows:
    yield f"scans {scan.topic}", f"frame {scan.frame_id or '(none)'}, {_times(scan.stamps)}"
    low, high = scan.beams
    beams = f"{low}" if low == high else f"{low} to {high}"
    first, step = math.degrees(scan.angle_min[0]), math.degrees(scan.angle_increment[0])
    view = math.degrees(scan.field_of_view)
    changes = f", changes {scan.geometry_changes} times" if scan.geometry_changes else ""
    yield "", f"{beams} beams from {first:.2f} deg, step {step:.4f} deg, view {view:.1f} deg{changes}"
    if scan.time_increment[1]:
        yield "", f"{scan.time_increment[1] * 1e6:.2f} us between beams"
    yield "", f"header limits {scan.range_min:g} to {scan.range_max:g} m; no echo: {_no_echo(scan)}"
    yield "", ", ".join(f"{share:.1%} {name.replace('_', ' ')}" for name, share in scan.shares.items())
    if not math.isnan(scan.percentiles[1]):
        near, middle, far = scan.percentiles
        yield "", f"ranges 5 / 50 / 95 %: {near:.2f} / {middle:.2f} / {far:.2f} m"
    yield "", f"intensities: {_intensities(scan)}"


def _no_echo(scan: "ScanReport") -> str:
    if scan.no_echo is None:
        return "not seen"
    limit = "" if math.isinf(scan.no_echo) else f", from {scan.limit:.2f} m on"
    return f"{scan.no_echo:.3f} m{limit}" if math.isfinite(scan.no_echo) else "inf"


def _intensities(scan: "ScanReport") -> str:
    intensity = scan.intensity
    if intensity.verdict == "none":
        return "none"
    span = f"{intensity.minimum:g} to {intensity.maximum:g}"
    return f"{intensity.verdict}, {span}, {intensity.share_at_maximum:.1%} at the maximum"


def _odometry_rows(odometry: "OdometryReport") -> Rows:
    frames = f"{odometry.frames}, " if odometry.frames else ""
    yield f"odometry {odometry.topic}", f"{frames}{_times(odometry.stamps)}"
    yield "", f"path {odometry.path_length:.1f} m, turning {odometry.turning:.1f} rad"


def _sonar_rows(sonar: "SonarReport") -> Rows:
    kind = "sonar" if sonar.sonars else "points"
    yield f"{kind} {_listed(sonar.topics)}", _times(sonar.stamps)
    if sonar.sonars:
        limits = f"limits {sonar.range_min:g} to {sonar.limit:g} m"
        yield "", f"{sonar.sonars} sonars, ring {sonar.ring}, {limits}"
        shares = sonar.shares
        repeats = f"each measures every {sonar.cycle:.2f} s" if sonar.cycle else "each message measures"
        yield "", f"{repeats}; {shares['not_new']:.1%} of the ranges are not new"
        yield "", f"of the new ones {shares['echo']:.1%} echo, {shares['no_echo']:.1%} no echo"
    else:
        yield "", f"3D points, {sonar.points_per_message:.1f} a message"
    if not math.isnan(sonar.percentiles[1]):
        near, middle, far = sonar.percentiles
        yield "", f"distances 5 / 50 / 95 %: {near:.2f} / {middle:.2f} / {far:.2f} m"


def _listed(topics: tuple[str, ...]) -> str:
    """All topics, or the first and the last of many."""
    return ", ".join(topics) if len(topics) < 4 else f"{topics[0]} ... {topics[-1]} ({len(topics)} topics)"


def _times(stamps: "StampReport") -> str:
    parts = [f"{stamps.count} messages", f"every {stamps.period * 1e3:.1f} ms"]
    if stamps.backward:
        parts.append(f"{stamps.backward} stamps step back (by up to {stamps.largest_step_back:.3f} s)")
    if stamps.equal:
        parts.append(f"{stamps.equal} stamps repeat")
    if stamps.gaps:
        parts.append(f"{stamps.gaps} gaps (up to {stamps.longest_gap:.2f} s)")
    if max(abs(stamps.offset_min), abs(stamps.offset_max)) > 1e-3:
        low, high = stamps.offset_min * 1e3, stamps.offset_max * 1e3
        parts.append(f"recorded {stamps.offset * 1e3:.0f} ms after the stamp ({low:.0f} to {high:.0f})")
    return ", ".join(parts)


def _transform(edge: "TransformReport") -> str:
    x, y, z = (round(value, 3) + 0.0 for value in edge.position)
    roll, pitch, yaw = (round(math.degrees(angle), 1) + 0.0 for angle in edge.rotation)
    kind = "moving" if edge.moved else "static" if edge.static else "fixed"
    return (
        f"{edge.parent} -> {edge.child} ({kind}, {edge.count} x {edge.topic}):"
        f" {x:.3f} {y:.3f} {z:.3f} m, {roll:.1f} {pitch:.1f} {yaw:.1f} deg"
    )


def _plan_rows(report: "RecordingReport") -> Rows:
    plan = report.plan
    if plan.problem:
        yield "map would stop", plan.problem
        if plan.hint:
            yield "", plan.hint
        return
    x, y, yaw = plan.base_from_laser
    yield "map would use", f"scans {plan.scan_topic}, odometry {plan.odom_topic or 'none'}"
    if sweeps := tuple(topic for topic in plan.sonar_topics if topic not in plan.points_topics):
        yield "", f"sonar {_listed(sweeps)}" + (plan.sonar_ring and f", ring {plan.sonar_ring}")
    if plan.points_topics:
        height = "not known" if plan.laser_height is None else f"{plan.laser_height:.3f} m above the base"
        yield "", f"3D points {_listed(plan.points_topics)}, height of the laser {height}"
    imu = f"imu {plan.imu_topic or 'none'}"
    yield "", f"{imu}, laser at x {x:.3f} y {y:.3f} m, yaw {math.degrees(yaw):.2f} deg on the robot"
