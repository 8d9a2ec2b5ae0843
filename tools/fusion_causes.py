"""Why the rows of the fusion table stand as they do: one experiment for each question, on the hallway of pi-map.

weights     what the probabilities of the lidar map do to the gain of Revisit Scan Fusion
regions     where the mean square error comes from, and what a perfect sonar map could mend of it
truth       what the bow of the map against the straight plan costs, even a perfect map
poses       why FG comes last: poses of the nodes alone, with and without correction, with and without filling
algorithms  what the sonar maps paste onto the lidar map: how many cells, and how many of them on a wall

python tools/fusion_causes.py --data DATA                  all of them
python tools/fusion_causes.py --data DATA regions poses    some of them
"""

import argparse
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from fusion_rows import (
    ALGORITHMS,
    CARTOGRAPHER,
    LIDAR,
    OURS,
    RSF_ALL,
    VARIANTS,
    Mapped,
    Recorded,
    Row,
    changed,
    hallway,
    mapped,
)
from fusion_table import true_hallway
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table
from scipy import ndimage

from glassslam.errors import GlassSlamError
from glassslam.evaluation import evaluate_image
from glassslam.evaluation.image import PIMAP_UNKNOWN
from glassslam.evaluation.image_cells import classes_of, cut_out, drawn_anew, region_of
from glassslam.fusion.fuse import fuse
from glassslam.geometry import inverse, transform_points
from glassslam.records import FloatArray, RangeRing
from glassslam.slam.result import OccupancyMap
from glassslam.slam.trajectory import PoseTracks, Trajectory
from glassslam.sonar.mapping import build_sonar_map
from glassslam.sonar.poses import PoseKind
from glassslam.sonar.sweeps import SonarSweeps, placed_sweeps
from glassslam.sources import SourceOptions, open_recording

WEIGHTS = ((0.8, 0.33), (0.7, 0.4), (0.65, 0.4), (0.6, 0.45), (0.599, 0.48), (0.55, 0.49))
_GREYS = np.array([PIMAP_UNKNOWN, 254, 0, 0], dtype=np.int64)
_UNKNOWN, _FREE, _WALL, _GLASS = range(4)
_PERFECT = "RSF+All, perfect sonar map"


def weights(of: Recorded) -> Table:
    """Rows of three maps by the probabilities that the lidar map is drawn with."""
    table = _table(
        "lidar map drawn with", "hit, miss", "lidar", "RSF+All", "ours", "RSF+All gains: SSIM, NCC"
    )
    for hit, miss in WEIGHTS:
        one = mapped(of, (f"map.hit_probability={hit}", f"map.miss_probability={miss}"))
        lidar, rsf, ours = (one.row(grid) for grid in (one.lidar, *_fused(one, (RSF_ALL, OURS))))
        gains = f"{rsf.errors.ssim - lidar.errors.ssim:+.3f} {rsf.errors.ncc - lidar.errors.ncc:+.3f}"
        table.add_row(f"{hit}, {miss}", *(_figures(row) for row in (lidar, rsf, ours)), gains)
    return table


def regions(of: Recorded) -> Table:
    """Shares of the mean square error by where the truth, bowed, has what; and a perfect sonar map."""
    one = mapped(of, bowed=True)
    sweeps = _sweeps(of, _tracks(one), "FGfit")
    maps = {LIDAR: one.lidar, **dict(zip((RSF_ALL, OURS), _fused(one, (RSF_ALL, OURS)), strict=True))}
    maps[_PERFECT] = fuse("rsf_all", one.lidar, _perfect(one), sweeps, one.base.fusion).map
    table = _table(
        "mean square error by region (truth bowed as the map is)", "map", "all", *_REGIONS, "image"
    )
    for name, grid in maps.items():
        mine, true, places = _cells(one, grid)
        error = (_GREYS[mine] - _GREYS[true]) ** 2 / mine.size
        parts = (f"{error[inside].sum():.0f}" for inside in _by_region(true, places))
        table.add_row(name, f"{error.sum():.0f}", *parts, _figures(one.row(grid)))
    return table


_REGIONS = ("2 cells from walls", "3 cells from glass", "free inside", "behind the long glass", "elsewhere")


def _by_region(true: NDArray[np.uint8], places: FloatArray) -> list[NDArray[np.bool_]]:
    """Cells that belong to each of `_REGIONS`, the first that fits."""
    x, y = places[..., 0], places[..., 1]
    wall = ndimage.distance_transform_edt(true != _WALL) < 2.3
    glass = ndimage.distance_transform_edt(true != _GLASS) < 3.3
    behind = (true == _UNKNOWN) & (x > 3.5) & (x < 28.6) & (y > 1.2)
    masks = [wall, glass, true == _FREE, behind, np.ones(true.shape, dtype=np.bool_)]
    taken = np.zeros(true.shape, dtype=np.bool_)
    out = []
    for mask in masks:
        out.append(mask & ~taken)
        taken |= mask
    return out


def truth(of: Recorded) -> Table:
    """The straight plan as truth and the plan bowed as the walls of the map, for three maps and for the plan."""
    straight, bowed = mapped(of), mapped(of, bowed=True)
    table = _table("truth", "map", "straight", "bowed as the map")
    maps = {
        LIDAR: straight.lidar,
        **dict(zip((RSF_ALL, OURS), _fused(straight, (RSF_ALL, OURS)), strict=True)),
    }
    for name, grid in maps.items():
        table.add_row(name, _figures(straight.row(grid)), _figures(bowed.row(grid)))
    own = (0.0, 0.0, 0.0)
    errors = [
        evaluate_image(bowed.truth.grid, one.truth.grid, map_from_truth=own, unknown_grey=PIMAP_UNKNOWN)
        for one in (straight, bowed)
    ]
    table.add_row("the bowed plan itself", *(f"{e.mse:.0f} {e.ssim:.3f} {e.ncc:.3f}" for e in errors))
    return table


def poses(of: Recorded) -> Table:
    """Sonar maps pasted onto the lidar map by poses that differ in one thing at a time."""
    one = mapped(of)
    tracks = _tracks(one)
    at_nodes = np.searchsorted(tracks.local.stamps, tracks.nodes.stamps)
    local = Trajectory(tracks.nodes.stamps, tracks.local.poses[at_nodes])
    drift = np.hypot(*(tracks.local.poses - tracks.final.poses)[:, :2].T).max()
    kinds: dict[str, tuple[PoseTracks, PoseKind]] = {
        "Loc": (tracks, "Loc"),
        "Loc, nearest node": (replace(tracks, nodes=local), "FG"),
        "FG (nearest node)": (tracks, "FG"),
        "FG, between nodes": (replace(tracks, final=tracks.nodes), "FGfit"),
        "FGfit (between scans)": (tracks, "FGfit"),
    }
    best = _sweeps(of, tracks, "FGfit")
    title = f"poses; local and final ones are at most {drift:.1g} m apart"
    table = _table(title, "poses", "off FGfit: mean, largest (cm)", "MSE SSIM NCC mean")
    for name, (by, kind) in kinds.items():
        sweeps = _sweeps(of, by, kind)
        both, mine, theirs = np.intersect1d(sweeps.stamps, best.stamps, return_indices=True)
        off = 100.0 * np.hypot(*(sweeps.poses[mine, :2] - best.poses[theirs, :2]).T)
        pasted = fuse("attach", one.lidar, build_sonar_map(sweeps, one.base), None, one.base.fusion).map
        table.add_row(name, f"{off.mean():.1f} {off.max():.1f} ({both.size})", _figures(one.row(pasted)))
    return table


def algorithms(of: Recorded) -> Table:
    """What each algorithm pastes, with cones as they are and made thin."""
    one = mapped(of, bowed=True)
    sweeps = _sweeps(of, _tracks(one), "FGfit")
    thin = {"beam_width_deg": 1.0, "arc_thickness": 0.01, "arc_growth": 0.0}
    variants = [
        *((name, {"algorithm": name}) for name in ALGORITHMS),
        ("BFA, a cone of 30 deg", {"beam_width_deg": 30.0}),
        ("ICo, a cone of 1 deg", {"algorithm": "ICo", **thin}),
        ("BFA, a cone of 1 deg", thin),
        ("ICL that forgets nothing", {"algorithm": "ICL", "old_weight": 0.999, "new_weight": 0.999}),
        ("ICo that forgets nothing", {"algorithm": "ICo", "old_weight": 0.999, "new_weight": 0.999}),
    ]
    before, true, _ = _cells(one, one.lidar)
    distance = ndimage.distance_transform_edt(true < _WALL)
    table = _table("cells pasted", "map", "all", "on a wall", "1 cell off", "farther", "MSE SSIM NCC mean")
    for name, update in variants:
        config = changed(one.base, update)
        grid = fuse("attach", one.lidar, build_sonar_map(sweeps, config), None, config.fusion).map
        pasted = (_cells(one, grid)[0] >= _WALL) & (before < _WALL)
        off = distance[pasted]
        counts = (off.size, (off == 0).sum(), ((off > 0) & (off < 1.5)).sum(), (off >= 1.5).sum())
        table.add_row(name, *map(str, counts), _figures(one.row(grid)))
    return table


EXPERIMENTS: dict[str, Callable[[Recorded], Table]] = {
    "weights": weights, "regions": regions, "truth": truth, "poses": poses, "algorithms": algorithms,
}  # fmt: skip


def _table(title: str, *headings: str) -> Table:
    table = Table(title=title)
    for heading in headings:
        table.add_column(heading, justify="left" if heading == headings[0] else "right")
    return table


def _figures(row: Row) -> str:
    return f"{row.errors.mse:.0f} {row.errors.ssim:.3f} {row.errors.ncc:.3f} {row.mean:.3f}"


def _fused(one: Mapped, names: Sequence[str]) -> list[OccupancyMap]:
    return [one.fused(VARIANTS[name]) for name in names]


def _tracks(one: Mapped) -> PoseTracks:
    return one.run.result().tracks


def _sweeps(of: Recorded, tracks: PoseTracks, kind: PoseKind) -> SonarSweeps:
    source = open_recording([of.bag], SourceOptions(sonar=of.sonar, laser_pose=of.laser_pose))
    ring = source.info.sonar_ring
    if ring is None:
        raise GlassSlamError(f"{of.bag} holds no sonar")
    records = [record for record in source.records() if isinstance(record, RangeRing)]
    return placed_sweeps(records, ring, tracks, kind)


def _perfect(one: Mapped) -> OccupancyMap:
    """The truth as a map of sonars that make no mistake, in the cells of the lidar map."""
    rows, columns = one.lidar.probability.shape
    drawn = drawn_anew(
        classes_of(one.truth.grid, None, "the truth"), one.truth.grid, np.array(one.motion),
        one.lidar, np.zeros(2, dtype=np.int64), (rows, columns),
    )  # fmt: skip
    probability = np.where(drawn >= _WALL, 0.9, 0.1).astype(np.float32)
    return replace(one.lidar, probability=probability)


def _cells(one: Mapped, grid: OccupancyMap) -> tuple[NDArray[np.uint8], NDArray[np.uint8], FloatArray]:
    """Classes of a map and of the truth in the region compared, and its places in the frame of the plan."""
    motion = np.array(one.motion)
    true_classes = classes_of(one.truth.grid, one.truth.glass, "the truth")
    low, shape = region_of(grid, one.truth.grid, true_classes, motion)
    mine = cut_out(classes_of(grid, None, "the map"), grid, low, shape)
    true = drawn_anew(true_classes, one.truth.grid, motion, grid, low, shape)
    rows, columns = np.indices(shape)
    cells = np.stack((columns + low[0], rows + low[1]), axis=-1).reshape(-1, 2) + 0.5
    places = transform_points(inverse(motion), np.asarray(grid.origin) + cells * grid.resolution)
    return mine, true, places.reshape(*shape, 2)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the program."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path, metavar="DIR", required=True, help="holds pimap/scene4.bag")
    parser.add_argument("experiments", nargs="*", metavar="EXPERIMENT", help=", ".join(EXPERIMENTS))
    words = parser.parse_args(arguments)
    if unknown := set(words.experiments) - set(EXPERIMENTS):
        parser.error(f"no experiment named {sorted(unknown)[0]}; choose from {', '.join(EXPERIMENTS)}")
    try:
        with tempfile.TemporaryDirectory() as scratch:
            one = hallway(words.data, true_hallway(Path(scratch)))
            for name in words.experiments or EXPERIMENTS:
                Console(width=180).print(EXPERIMENTS[name](one))
    except GlassSlamError as error:
        print(f"error: {error.message}" + (f" ({error.hint})" if error.hint else ""), file=sys.stderr)
        return error.exit_code
    return 0


if __name__ == "__main__":
    sys.exit(main())
