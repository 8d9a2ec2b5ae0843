"""Two sensors' opinions of the same voxels made one (section 2.3 of the lidar and 3D ultrasonic fusion)."""

from typing import Literal, TypeAlias, get_args

import numpy as np

from glassslam.errors import GridError
from glassslam.fusion.pools import linear_pool, logarithmic_pool
from glassslam.records import Float32Array
from glassslam.volume.evidence import Evidence, joined
from glassslam.volume.octree import Octree
from glassslam.volume.odds import probabilities

Pool: TypeAlias = Literal["bayes", "iop", "lop", "liop"]


def pooled(
    first: Float32Array, second: Float32Array, pool: Pool = "bayes", weights: tuple[float, float] = (1.0, 1.0)
) -> Float32Array:
    """Log odds of two opinions given as log odds; who knows nothing says 0.

    `bayes` and `iop` add them (equations 7 and 15: with even prior odds the same); `lop` and `liop` are the
    weighted pools of the probabilities (equations 4 and 6).

    Parameters
    ----------
    first, second : ndarray of float32, shape (n,)
        Log odds of being occupied.
    pool : {"bayes", "iop", "lop", "liop"}
        How they are joined.
    weights : tuple of float
        Trust in each, for `lop` and `liop`; only their ratio matters.

    Raises
    ------
    GridError
        No such pool, or weights that are negative, not finite or both zero.

    Examples
    --------
    >>> import numpy as np
    >>> agreed = pooled(np.array([0.847], np.float32), np.array([0.847], np.float32))
    >>> round(float(1 / (1 + np.exp(-agreed[0]))), 3)
    0.845
    """
    check_pool(pool, weights)
    if pool in {"bayes", "iop"}:
        return np.asarray(first + second, dtype=np.float32)
    opinions = np.stack((probabilities(first), probabilities(second))).astype(np.float64)
    joint = linear_pool(opinions, weights) if pool == "lop" else logarithmic_pool(opinions, weights)
    return np.asarray(np.log(joint) - np.log1p(-joint), dtype=np.float32)


def check_pool(pool: str, weights: tuple[float, float]) -> None:
    """Refuse a pool that does not exist and weights that make no sense.

    Raises
    ------
    GridError
        See `pooled`.
    """
    if pool not in get_args(Pool):
        raise GridError(f"there is no pool {pool!r}", f"known: {', '.join(get_args(Pool))}")
    linear_pool(np.full(2, 0.5), weights)


def fuse_volumes(
    first: Octree, second: Octree, pool: Pool = "bayes", weights: tuple[float, float] = (1.0, 1.0)
) -> Octree:
    """Pool two finished maps voxel by voxel; unknown voxels of one map say nothing.

    Raises
    ------
    GridError
        The maps have voxels of different size.
    """
    if first.resolution != second.resolution:
        raise GridError(
            f"voxels of {first.resolution:g} m cannot be fused with those of {second.resolution:g} m",
            "map both with one resolution",
        )
    codes, one, other = joined(_voxels(first), _voxels(second))
    fused = Octree(first.resolution, first.clamp)
    fused.add_sorted(codes, pooled(one, other, pool, weights))
    return fused


def _voxels(tree: Octree) -> Evidence:
    voxels = tree.leaves().voxels()
    return Evidence(voxels.codes, voxels.log_odds)
