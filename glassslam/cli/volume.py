"""`glassslam volume`: a 3D map from a recording with ultrasonic points and a known trajectory."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from glassslam.errors import UsageError

if TYPE_CHECKING:
    from glassslam.records import Record, Trajectory
    from glassslam.sources import SourceOptions
    from glassslam.sources.recording import Recording as OpenRecording
    from glassslam.sources.sonarfile import SonarFile
    from glassslam.volume.mapper import Volume

EXAMPLES = """\
  glassslam volume run.bag --trajectory run-map/trajectory.tum
  glassslam volume run.bag --trajectory run-map/trajectory.tum -o run-3d --band 0.1 1.8
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
Resolution = Annotated[float, typer.Option(min=0.001, metavar="M", help="Edge of a voxel, m.")]
BandOption = Annotated[
    tuple[float, float],
    typer.Option("--band", metavar="LOW HIGH", help="Heights that become the 2D map, m above the base."),
]
LidarHeight = Annotated[float, typer.Option(metavar="M", help="Height of the lidar above the base, m.")]
PoolOption = Annotated[
    Literal["bayes", "iop", "lop", "liop"],
    typer.Option("--pool", help="How the measurements of the two sensors are joined."),
]
RuleOption = Annotated[
    Literal["max", "pool"],
    typer.Option("--projection", help="What becomes of a column of voxels in the map."),
]
SonarTopic = Annotated[
    str | None, typer.Option("--sonar-topic", metavar="TOPIC", help="Topic of the ultrasonic points.")
]
Json = Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace earlier results.")]


def volume(
    recording: Recording,
    trajectory: TrajectoryFile = None,
    output: Output = None,
    resolution: Resolution = 0.05,
    band: BandOption = (0.1, 1.8),
    lidar_height: LidarHeight = 0.2,
    pool: PoolOption = "bayes",
    projection: RuleOption = "max",
    sonar_topic: SonarTopic = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> int:
    """Build a 3D map from a 2D lidar and a 3D ultrasonic sensor along a trajectory that is known.

    DIR then holds volume.npz, volume.bt (OctoMap), volume.ply, volume.png, slices.png, and the heights of
    the band projected on a 2D map, volume_map.yaml and volume_map.pgm.
    """
    from glassslam.outputs import read_tum, write_map  # noqa: PLC0415  (loads numpy)
    from glassslam.sources import SourceOptions  # noqa: PLC0415
    from glassslam.volume.files import check_folder, write_volume  # noqa: PLC0415
    from glassslam.volume.mapper import VolumeOptions, build_volume  # noqa: PLC0415  (loads kernels)
    from glassslam.volume.projection import project  # noqa: PLC0415

    if not band[0] < band[1]:
        raise UsageError(
            f"--band {band[0]:g} {band[1]:g}: no height lies between", "give the lower one first"
        )
    target = output or _default_directory(recording)
    check_folder(target, overwrite=overwrite)
    poses = _standing() if trajectory is None else read_tum(trajectory)
    options = VolumeOptions(resolution=resolution, lidar_height=lidar_height, pool=pool)
    source, records, laser_pose, dropped = _records(recording, SourceOptions(sonar_topic=sonar_topic))
    built = build_volume(records, poses, options, laser_pose)
    _check_seen(built, recording)
    seen_from_above = project(built.fused, band, projection)
    written = write_volume(
        built.fused,
        target,
        band=band,
        also=lambda folder: write_map(seen_from_above, folder / "volume_map.yaml"),
        overwrite=overwrite,
    )
    summary = _summary(built, {**dropped, **built.dropped}, written)
    summary["damage"] = [damage.text for damage in source.damage]
    _show(summary, json)
    return 3 if summary["dropped"] or summary["damage"] else 0


def _records(
    path: Path, options: "SourceOptions"
) -> tuple["OpenRecording | SonarFile", "Iterable[Record]", tuple[float, float, float], dict[str, int]]:
    """The source, its records, pose of the laser, and what is dropped while they are read."""
    from glassslam.errors import NoScansError  # noqa: PLC0415
    from glassslam.sources import open_recording  # noqa: PLC0415
    from glassslam.sources.sonarfile import open_sonar  # noqa: PLC0415

    dropped: dict[str, int] = {}
    try:
        source = open_recording(path, options)
    except NoScansError:

        def drop(reason: str) -> None:
            dropped[reason] = dropped.get(reason, 0) + 1

        file = open_sonar(path, options)
        return file, file.records(drop), (0.0, 0.0, 0.0), dropped
    return source, source.records(), source.info.base_from_laser, source.dropped


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
    return {
        **built.counts,
        "dropped": {reason: count for reason, count in dropped.items() if count},
        "resolution": built.fused.resolution,
        "nodes": memory.nodes,
        "leaves": memory.leaves,
        "occupied_voxels": len(built.fused.occupied().voxels()),
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
        f"{summary['leaves']} leaves, {summary['bytes'] / 1e6:.1f} MB",
        *(f"dropped: {count} x {reason}" for reason, count in summary["dropped"].items()),
        *(f"damage: {text}" for text in summary["damage"]),
        *(f"wrote {path}" for path in summary["written"]),
    ]
    emit("".join(f"{line}\n" for line in lines))
