"""`glassslam volume`: a 3D map from a recording with ultrasonic points and a known trajectory."""

import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from glassslam.cli.map import Assignments, ConfigFile, LaserPose
from glassslam.errors import UsageError

if TYPE_CHECKING:
    from glassslam.api import ProgressCallback
    from glassslam.records import Record, RecordingInfo, Trajectory
    from glassslam.sources import SourceOptions
    from glassslam.sources.recording import Recording as OpenRecording
    from glassslam.sources.sonarfile import SonarFile
    from glassslam.volume.mapper import Volume

EXAMPLES = """\
  glassslam volume run.bag --trajectory run-map/trajectory.tum
  glassslam volume run.bag --trajectory run-map/trajectory.tum -o run-3d --band 0.1 1.8
  glassslam volume run.bag --trajectory truth.tum --config run-map/config.yaml --set volume.pool=lop
  glassslam volume still.bag                     a robot that stands
"""

Recording = Annotated[
    Path,
    typer.Argument(metavar="BAG", help="Scans and ultrasonic points, or points only.", show_default=False),
]
TrajectoryFile = Annotated[
    Path | None,
    typer.Option("--trajectory", metavar="TUM", help="Poses of the base [default: it stands at the origin]."),
]
Output = Annotated[
    Path | None,
    typer.Option("--output", "-o", metavar="DIR", help="Results directory [default: NAME-volume]."),
]
Resolution = Annotated[
    float | None, typer.Option(min=0.005, max=1.0, metavar="M", help="Edge of a voxel, m [default: 0.05].")
]
BandOption = Annotated[
    tuple[float, float] | None,
    typer.Option(
        "--band",
        metavar="LOW HIGH",
        help="Heights that become the 2D map, m above the base [default: 0.1 1.8].",
    ),
]
LidarHeight = Annotated[
    float | None,
    typer.Option(metavar="M", help="Height of the lidar above the base, m [default: as recorded, or 0.2]."),
]
PoolOption = Annotated[
    Literal["bayes", "iop", "lop", "liop"] | None,
    typer.Option("--pool", help="How the measurements of the two sensors are joined [default: bayes]."),
]
RuleOption = Annotated[
    Literal["max", "pool"] | None,
    typer.Option("--projection", help="What becomes of a column of voxels in the map [default: max]."),
]
PointsTopic = Annotated[
    list[str] | None,
    typer.Option(
        "--points-topic",
        "--sonar-topic",
        metavar="TOPIC",
        help="Topic of the ultrasonic points; may be repeated.",
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace earlier results.")]


def volume(
    recording: Recording,
    trajectory: TrajectoryFile = None,
    output: Output = None,
    config: ConfigFile = None,
    assignments: Assignments = None,
    resolution: Resolution = None,
    band: BandOption = None,
    lidar_height: LidarHeight = None,
    pool: PoolOption = None,
    projection: RuleOption = None,
    points_topic: PointsTopic = None,
    laser_pose: LaserPose = None,
    overwrite: Overwrite = False,
    json: Json = False,
    quiet: Quiet = False,
) -> int:
    """Build a 3D map from a 2D lidar and a 3D ultrasonic sensor along a trajectory that is known.

    DIR then holds volume.npz, volume.bt (OctoMap), volume.ply, volume.png, slices.png, and the heights of
    the band projected on a 2D map, volume_map.yaml and volume_map.pgm. All parameters are in the section
    volume of the configuration; some have an option of their own.
    """
    from glassslam.cli.settings import check_not_root, parse_pose, resolve_config  # noqa: PLC0415
    from glassslam.outputs import read_tum  # noqa: PLC0415  (loads numpy)
    from glassslam.outputs.lock import locked  # noqa: PLC0415
    from glassslam.sources import SourceOptions  # noqa: PLC0415
    from glassslam.volume.files import check_folder  # noqa: PLC0415  (loads kernels)

    options = {"resolution": resolution, "lidar_height": lidar_height, "pool": pool, "projection": projection}
    wishes = [*_band_assignments(band), *(f"volume.{k}={v}" for k, v in options.items() if v is not None)]
    resolved = resolve_config(config, [*(assignments or ()), *wishes])
    target = output or _default_directory(recording)
    check_not_root(target)
    check_folder(target, overwrite=overwrite)
    poses = None if trajectory is None else read_tum(trajectory)
    source_options = SourceOptions(
        # rings of sonars are of no use here, and may be in the way
        sonar_topic="none" if points_topic else None,
        points_topic=tuple(points_topic) if points_topic else None,
        laser_pose=parse_pose(laser_pose),
    )
    with locked(target):
        summary = _made(recording, source_options, poses, resolved, target, overwrite=overwrite, quiet=quiet)
    if json or not quiet:
        _show(summary, json)
    return 3 if summary["dropped"] or summary["damage"] else 0


def _made(
    recording: Path,
    source_options: "SourceOptions",
    poses: "Trajectory | None",
    config: Any,
    target: Path,
    *,
    overwrite: bool,
    quiet: bool,
) -> dict[str, Any]:
    """Read, map and write; what is to be told of it."""
    from glassslam.cli.progress import progress_bar  # noqa: PLC0415
    from glassslam.cli.standing import Standing  # noqa: PLC0415
    from glassslam.outputs import write_map  # noqa: PLC0415
    from glassslam.volume.files import write_volume  # noqa: PLC0415
    from glassslam.volume.listener import plane_warnings  # noqa: PLC0415
    from glassslam.volume.mapper import build_volume  # noqa: PLC0415  (loads kernels)
    from glassslam.volume.options import volume_options  # noqa: PLC0415
    from glassslam.volume.projection import project  # noqa: PLC0415

    source, records, info, dropped = _records(recording, source_options)
    options = volume_options(config.volume, config.sensor, info.laser_height)
    robot = Standing()
    with progress_bar(quiet=quiet) as progress:
        followed = robot.watched(_followed(records, info, progress))
        built = build_volume(followed, poses or _standing(), options, info.base_from_laser)
    _check_seen(built, recording)
    heights = config.volume.band_low, config.volume.band_high
    seen_from_above = project(built.fused, heights, config.volume.projection)
    written = write_volume(
        built.fused,
        target,
        band=heights,
        also=lambda folder: write_map(seen_from_above, folder / "volume_map.yaml"),
        overwrite=overwrite,
    )
    summary = _summary(built, {**dropped, **built.dropped}, written)
    return {
        **summary,
        "lidar_height": options.lidar_height,
        "damage": [part.text for part in source.damage],
        "warnings": [
            *(robot.warnings if poses is None else ()),
            *(plane_warnings(options.lidar_height, heights) if built.counts["scans"] else ()),
        ],
    }


def _band_assignments(band: tuple[float, float] | None) -> list[str]:
    """Assignments of the heights of an option.

    Raises
    ------
    UsageError
        There is no height between them.
    """
    if band is None:
        return []
    low, high = band
    if not low < high:
        raise UsageError(f"--band {low:g} {high:g}: no height lies between", "give the lower one first")
    return [f"volume.band_low={low!r}", f"volume.band_high={high!r}"]


def _records(
    path: Path, options: "SourceOptions"
) -> tuple["OpenRecording | SonarFile", "Iterable[Record]", "RecordingInfo", dict[str, int]]:
    """The source, its records, what is known of it, and what is dropped while it is read."""
    from glassslam.errors import NoScansError  # noqa: PLC0415
    from glassslam.records import RecordingInfo  # noqa: PLC0415
    from glassslam.sources import open_recording  # noqa: PLC0415
    from glassslam.sources.sonarfile import open_sonar  # noqa: PLC0415

    dropped: dict[str, int] = {}
    try:
        source = open_recording(path, options)
    except NoScansError:

        def drop(reason: str) -> None:
            dropped[reason] = dropped.get(reason, 0) + 1

        file = open_sonar(path, options)
        begin, end = file.span
        return file, file.records(drop), RecordingInfo((str(path),), "points", end - begin, 0), dropped
    return source, source.records(), source.info, source.dropped


def _followed(
    records: "Iterable[Record]", info: "RecordingInfo", progress: "ProgressCallback | None"
) -> "Iterator[Record]":
    """The records; how far they have come is told about ten times a second."""
    from glassslam.api import Progress  # noqa: PLC0415
    from glassslam.records import LaserScan  # noqa: PLC0415

    scans, first, due = 0, None, 0.0
    for record in records:
        scans += isinstance(record, LaserScan)
        first = record.record_stamp if first is None else first
        if progress is not None and time.monotonic() >= due:
            progress(Progress("mapping", scans, max(0.0, record.record_stamp - first), info))
            due = time.monotonic() + 0.1
        yield record


def _standing() -> "Trajectory":
    import numpy as np  # noqa: PLC0415

    from glassslam.records import Trajectory  # noqa: PLC0415

    return Trajectory(np.zeros(1), np.zeros((1, 3)))


def _default_directory(recording: Path) -> Path:
    from glassslam.cli.settings import default_directory  # noqa: PLC0415

    name = default_directory([recording]).name
    return Path(f"{name.removesuffix('-map')}-volume")


def _check_seen(built: "Volume", recording: Path) -> None:
    from glassslam.errors import RecordingError  # noqa: PLC0415

    if built.counts["scans"] or built.counts["point_sets"]:
        return
    reasons = ", ".join(f"{count} x {reason}" for reason, count in built.dropped.items())
    raise RecordingError(
        f"nothing of {recording} could be placed", f"dropped: {reasons}" if reasons else "it holds no points"
    )


def _summary(built: "Volume", dropped: dict[str, int], written: list[Path]) -> dict[str, Any]:
    memory, (low, high) = built.fused.memory(), built.fused.bounds()
    occupied, free = built.fused.volumes()
    return {
        **built.counts,
        "dropped": {reason: count for reason, count in dropped.items() if count},
        "resolution": built.fused.resolution,
        "nodes": memory.nodes,
        "leaves": memory.leaves,
        "occupied_voxels": occupied,
        "free_voxels": free,
        "bytes": memory.used_bytes,
        "bounds": [[round(float(value), 6) for value in corner] for corner in (low, high)],
        "written": [str(path) for path in written],
    }


def _show(summary: dict[str, Any], as_json: bool) -> None:
    from glassslam.cli.terminal import emit  # noqa: PLC0415

    if as_json:
        from json import dumps  # noqa: PLC0415

        emit(dumps(summary, indent=2) + "\n")
        return
    low, high = summary["bounds"]
    size = " x ".join(f"{b - a:.2f}" for a, b in zip(low, high, strict=True))
    lines = [
        f"{summary['scans']} scans, {summary['points']} points of {summary['point_sets']} pings, "
        f"{summary['pairs']} pairs",
        f"{size} m, {summary['occupied_voxels']} occupied voxels of {summary['resolution']:g} m, "
        f"lidar {summary['lidar_height']:g} m above the base, "
        f"{summary['leaves']} leaves, {summary['bytes'] / 1e6:.1f} MB",
        *(f"warning: {text}" for text in summary["warnings"]),
        *(f"dropped: {count} x {reason}" for reason, count in summary["dropped"].items()),
        *(f"damage: {text}" for text in summary["damage"]),
        *(f"wrote {path}" for path in summary["written"]),
    ]
    emit("".join(f"{line}\n" for line in lines))
