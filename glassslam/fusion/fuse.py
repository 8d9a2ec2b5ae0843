"""Every rule that joins a lidar map and a sonar map, by name.

walls        glass walls fitted to what lidar and sonar say together; needs the run, see `fusion.listener`
overlay      end points of the sonars as a second layer (Zhang et al., approach B)
attach       occupied cells of the sonar map attached to the lidar map (pi-map, basic fusion)
pessimistic  the sensor that says occupied most (study of the Gates building)
minmax       the surest sensor on the side of the mean (the same study)
lop, liop    linear and logarithmic pool, weighted; iop, bayes: independent pool and Bayes filter
rsf_glass    Revisit Scan Fusion, only rays that meet glass (pi-map)
rsf_all      Revisit Scan Fusion, all rays (pi-map)
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray

from glassslam.config import FusionConfig
from glassslam.errors import UsageError
from glassslam.fusion.common_grid import on_common_grid
from glassslam.fusion.layers import attach, end_point_layer, minmax, pessimistic, stacked
from glassslam.fusion.pools import bayes_pool, independent_pool, linear_pool, logarithmic_pool
from glassslam.fusion.revisit import Variant, revisit_scan_fusion
from glassslam.records import FloatArray
from glassslam.slam.result import OccupancyMap
from glassslam.sonar.sweeps import SonarSweeps

METHODS: tuple[str, ...] = tuple(
    name for name in get_args(FusionConfig.model_fields["method"].annotation) if name != "walls"
)
"""Names of the rules that join two finished maps."""

_NEED_SWEEPS = ("overlay", "rsf_glass", "rsf_all")
_Decision: TypeAlias = tuple[NDArray[np.floating], NDArray[np.uint8] | None]


@dataclass(frozen=True, slots=True)
class FusedMap:
    """A lidar map and a sonar map joined.

    Attributes
    ----------
    map : OccupancyMap
        The fused map, on a grid that covers both.
    source : ndarray of uint8, shape (rows, columns), or None
        1 where the lidar decided, 2 where the sonar did, 3 where both agree, 0 where neither; None for
        pools, in which no one decides.
    """

    map: OccupancyMap
    source: NDArray[np.uint8] | None


def fuse(
    method: str,
    lidar_map: OccupancyMap,
    sonar_map: OccupancyMap,
    sweeps: SonarSweeps | None = None,
    config: FusionConfig | None = None,
) -> FusedMap:
    """Join a lidar map and a sonar map by the rule of that name.

    Parameters
    ----------
    method : str
        One of `METHODS`.
    lidar_map, sonar_map : OccupancyMap
        Maps of the same frame, on any grids.
    sweeps : SonarSweeps, optional
        Readings and poses; `overlay`, `rsf_glass` and `rsf_all` need them.
    config : FusionConfig, optional
        Parameters of the rules.

    Raises
    ------
    UsageError
        No such rule, or a rule that needs sweeps without them.
    GridError
        Weights that are all 0.
    """
    config = config or FusionConfig()
    if method not in METHODS:
        raise UsageError(f"no fusion named {method!r}", f"choose from {', '.join(METHODS)}")
    if method in _NEED_SWEEPS:
        if sweeps is None:
            raise UsageError(f"fusion {method!r} needs the sonar sweeps", "give them with their poses")
        return _along_rays(method, lidar_map, sonar_map, sweeps, config)
    lidar, sonar = on_common_grid([lidar_map, sonar_map])
    return _result(lidar, _cell_rules(config)[method](stacked([lidar, sonar])))


def _along_rays(
    method: str, lidar_map: OccupancyMap, sonar_map: OccupancyMap, sweeps: SonarSweeps, config: FusionConfig
) -> FusedMap:
    if method == "overlay":
        lidar, layer = on_common_grid([lidar_map, end_point_layer(sweeps, config)])
        laid = attach(lidar.probability, layer.probability, config.overlay_min_occupancy)
        return _result(lidar, laid)
    lidar, sonar = on_common_grid([lidar_map, sonar_map])
    variant: Variant = "glass" if method == "rsf_glass" else "all"
    return _result(lidar, revisit_scan_fusion(lidar, sonar, sweeps, config, variant))


def _cell_rules(config: FusionConfig) -> dict[str, Callable[[FloatArray], _Decision]]:
    """Rules that need nothing but the opinions (2, rows, columns) of lidar and sonar."""
    weights = (config.lidar_weight, config.sonar_weight)
    return {
        "attach": lambda p: attach(
            p[0].astype(np.float32), p[1].astype(np.float32), config.occupied_threshold
        ),
        "pessimistic": pessimistic,
        "minmax": minmax,
        "lop": lambda p: (linear_pool(p, weights), None),
        "liop": lambda p: (logarithmic_pool(p, weights), None),
        "iop": lambda p: (independent_pool(p), None),
        "bayes": lambda p: (bayes_pool(p, config.prior), None),
    }


def _result(grid: OccupancyMap, decision: _Decision) -> FusedMap:
    probability, source = decision
    return FusedMap(OccupancyMap(probability.astype(np.float32), grid.resolution, grid.origin), source)
