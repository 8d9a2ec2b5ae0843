"""Revisit Scan Fusion: a second scan, in the maps, decides between the sensors (pi-map, section III-C)."""

from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from glassslam.config import FusionConfig
from glassslam.fusion.revisit_kernels import LIDAR, revisit
from glassslam.geometry import wrap_angle
from glassslam.records import Float32Array, SonarRing
from glassslam.slam.result import OccupancyMap
from glassslam.sonar.sweeps import SonarSweeps

Variant: TypeAlias = Literal["glass", "all"]
FREE, OCCUPIED = 0.1, 0.9
"""P(occupied) of the cells that a ray writes."""


def side_sonars(ring: SonarRing) -> NDArray[np.int64]:
    """Numbers of the two sonars that look most nearly to the left and to the right, shape (2,)."""
    yaw = np.asarray(ring.poses, dtype=np.float64)[:, 2]
    sides = [np.abs(wrap_angle(yaw - side)).argmin() for side in (0.5 * np.pi, -0.5 * np.pi)]
    return np.array(sides, dtype=np.int64)


def revisit_scan_fusion(
    lidar_map: OccupancyMap,
    sonar_map: OccupancyMap,
    sweeps: SonarSweeps,
    config: FusionConfig,
    variant: Variant = "all",
) -> tuple[Float32Array, NDArray[np.uint8]]:
    """Lidar and sonar map joined along the rays of the sonars at every sweep.

    The fused map starts as the lidar map. Where the lidar ray is longer than the sonar ray by more than
    `glass_gap` the sonar ray is written, its end occupied and the cells before it free; otherwise, with
    the variant `all`, the lidar ray. Unlike in the paper a ray that nothing stops in its map is not
    written: the border of an image is no obstacle.

    Parameters
    ----------
    lidar_map, sonar_map : OccupancyMap
        Maps on one grid (see `on_common_grid`).
    sweeps : SonarSweeps
        Ring and poses; the ranges are not looked at.
    config : FusionConfig
        Thresholds, and which sonars are revisited.
    variant : {"glass", "all"}
        Whether only rays that meet glass are written, or all.

    Returns
    -------
    probability : ndarray of float32, shape (rows, columns)
        P(occupied) of the fused map.
    source : ndarray of uint8, shape (rows, columns)
        1 where the lidar decided, 2 where the sonar did, 0 where neither looked.
    """
    fused = np.array(lidar_map.probability, dtype=np.float32)
    source = np.where(np.isnan(fused), 0, LIDAR).astype(np.uint8)
    chosen = side_sonars(sweeps.ring) if config.sonars == "sides" else np.arange(len(sweeps.ring.poses))
    rays = sweeps.sensors[:, chosen].reshape(-1, 3).copy()
    rays[:, :2] = (rays[:, :2] - np.asarray(lidar_map.origin)) / lidar_map.resolution
    threshold = np.float32(config.occupied_threshold)
    revisit(
        rays, lidar_map.probability >= threshold, sonar_map.probability >= threshold,
        config.glass_gap / lidar_map.resolution, variant == "all", FREE, OCCUPIED,
        np.empty((sum(fused.shape), 2), dtype=np.int64), fused, source,
    )  # fmt: skip
    return fused, source
