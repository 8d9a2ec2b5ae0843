"""The volume of a run with points of a 3D ultrasonic sensor, its map, and what is reported of them."""

from pathlib import Path
from typing import Any

from glassslam.outputs.map_server import write_map
from glassslam.outputs.picture import write_picture
from glassslam.slam.result import MapResult


def write_volume_maps(result: MapResult, folder: Path) -> list[Path]:
    """Write voxels, point cloud, OctoMap file, pictures and the map of the band of heights.

    Parameters
    ----------
    result : MapResult
        The run; nothing is written where it had no points.
    folder : Path
        Where the files go.

    Returns
    -------
    list of Path
        The files written.

    Raises
    ------
    OutputError
        A picture cannot be drawn.
    OSError
        A file cannot be written.
    """
    volume = result.volume
    if volume is None:
        return []
    from glassslam.volume.files import write_files  # noqa: PLC0415  (loads kernels)

    return [
        *write_files(volume.tree, folder, volume.band),
        *write_map(volume.map, folder / "volume_map.yaml"),
        write_picture(volume.map, result.trajectory, folder / "volume_map.png"),
    ]


def describe_volume(result: MapResult) -> dict[str, Any] | None:
    """The volume in numbers, for the report; None where there were no points.

    Parameters
    ----------
    result : MapResult
        The run.
    """
    volume = result.volume
    if volume is None:
        return None
    config, (occupied, free) = volume.config, volume.tree.volumes()
    low, high = volume.tree.bounds()
    return {
        **volume.counts,
        "dropped": dict(volume.dropped),
        "resolution": volume.tree.resolution,
        "lidar_height_m": volume.lidar_height,
        "band_m": list(volume.band),
        "pool": config.pool,
        "projection": config.projection,
        "occupied_voxels": occupied,
        "free_voxels": free,
        "leaves": volume.tree.memory().leaves,
        "bounds_m": [low.tolist(), high.tolist()],
    }
