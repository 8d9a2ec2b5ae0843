"""From the rays of one measurement to what it says of each voxel, once."""

from dataclasses import dataclass

import numpy as np

from glassslam.errors import GridError
from glassslam.records import Float32Array, FloatArray
from glassslam.volume import ray_kernels as kernels
from glassslam.volume.octree import CENTRE
from glassslam.volume.octree_kernels import Int64Array
from glassslam.volume.sensors import InverseModel


@dataclass(frozen=True, slots=True)
class Evidence:
    """What one measurement says: every voxel once, in the order of the codes.

    Attributes
    ----------
    codes : ndarray of int64, shape (n,)
        Voxels, increasing.
    log_odds : ndarray of float32, shape (n,)
        How much more likely each is to be occupied.
    """

    codes: Int64Array
    log_odds: Float32Array

    @classmethod
    def nothing(cls) -> "Evidence":
        """The evidence of a sensor that said nothing: the padding of a missing partner."""
        return cls(np.empty(0, dtype=np.int64), np.empty(0, dtype=np.float32))


def observe(
    origin: FloatArray, echoes: FloatArray, silent: FloatArray, model: InverseModel, resolution: float
) -> Evidence:
    """Walk the rays of one measurement; a voxel is told once, and an echo wins over a ray that passes.

    Parameters
    ----------
    origin : ndarray of float64, shape (3,)
        Position of the sensor, m.
    echoes : ndarray of float64, shape (n, 3)
        Where echoes came from, m; those beyond the range of the model count as free space up to there.
    silent : ndarray of float64, shape (m, 3)
        Ends of free space without echo, m, shortened to the range of the model.
    model : InverseModel
        What a ray says.
    resolution : float
        Edge of a voxel, m.

    Raises
    ------
    GridError
        A coordinate is not finite or lies outside of the tree.
    """
    near = np.linalg.norm(echoes - origin, axis=1) <= model.max_range
    ends = np.concatenate((echoes[near], _shortened(origin, echoes[~near], model.max_range),
                           _shortened(origin, silent, model.max_range)))  # fmt: skip
    start, ends = _in_voxels(origin[None], resolution)[0], _in_voxels(ends, resolution)
    steps = np.abs(np.floor(ends) - np.floor(start)).sum(axis=1).astype(np.int64) + 1
    entries = np.empty(int(steps.sum()), dtype=np.int64)
    path = np.empty(int(steps.max(initial=0)), dtype=np.int64)
    recent = np.full(kernels.RECENT, -1, dtype=np.int64)
    count = kernels.trace_rays(start, ends, int(near.sum()), path, recent, entries)
    entries = np.sort(entries[:count])
    entries = entries[: kernels.merge_first(entries)]
    change = np.where(entries & 1, model.free_log_odds, model.occupied_log_odds)
    return Evidence(entries >> 1, change)


def joined(first: Evidence, second: Evidence) -> tuple[Int64Array, Float32Array, Float32Array]:
    """Voxels of either evidence, increasing, with what each says of them; 0 where it says nothing."""
    size = first.codes.size + second.codes.size
    codes = np.empty(size, dtype=np.int64)
    one, other = np.empty(size, dtype=np.float32), np.empty(size, dtype=np.float32)
    count = kernels.join_sorted(first.codes, first.log_odds, second.codes, second.log_odds, codes, one, other)
    return codes[:count], one[:count], other[:count]


def _shortened(origin: FloatArray, ends: FloatArray, longest: float) -> FloatArray:
    """Ends of rays that are cut at a length, m."""
    ahead = ends - origin
    length = np.linalg.norm(ahead, axis=1, keepdims=True)
    return np.asarray(origin + ahead * np.minimum(1.0, longest / np.maximum(length, longest)))


def _in_voxels(points: FloatArray, resolution: float) -> FloatArray:
    scaled = np.ascontiguousarray(points / resolution + CENTRE)
    if not ((scaled >= 0.0) & (scaled < 2 * CENTRE)).all():
        raise GridError(
            "a measurement is not finite or outside of the volume",
            f"voxels of {resolution:g} m reach {CENTRE * resolution:g} m from the origin",
        )
    return scaled
