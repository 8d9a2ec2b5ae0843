"""Why the rows of the fusion table stand as they do: experiments on the hallway of pi-map.

weights     what the probabilities of the lidar map do to the gain of Revisit Scan Fusion
regions     where the mean square error comes from, and what a perfect sonar map could mend of it
revisit     Revisit Scan Fusion with one thing changed at a time
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
from typing import Any

import numpy as np
from fusion_regions import REGIONS, by_region, compared_cells, perfect_sonar_map
from fusion_rows import (
    ALGORITHMS,
    LIDAR,
    OURS,
    RSF_ALL,
    VARIANTS,
    Mapped,
    Recorded,
    Row,
    changed,
    finished,
    hallway,
    mapped,
)
from fusion_table import true_hallway
from rich.console import Console
from rich.table import Table
from scipy import ndimage

from glassslam.errors import GlassSlamError
from glassslam.evaluation.image import PIMAP_UNKNOWN
from glassslam.evaluation.image_cells import PANE, SOLID
from glassslam.finished import FinishedRun
from glassslam.fusion.fuse import fuse
from glassslam.records import Trajectory
from glassslam.slam.result import OccupancyMap
from glassslam.slam.trajectory import PoseTracks
from glassslam.sonar.mapping import build_sonar_map
from glassslam.sonar.poses import PoseKind
from glassslam.sonar.sweeps import SonarSweeps, placed_sweeps

WEIGHTS = ((0.8, 0.33), (0.7, 0.4), (0.65, 0.4), (0.6, 0.45), (0.599, 0.48), (0.55, 0.49))
_GREYS = np.array([PIMAP_UNKNOWN, 254, 0, 0], dtype=np.int64)
_PERFECT = "RSF+All, perfect sonar map"


def weights(of: Recorded, run: FinishedRun) -> Table:
    """Rows of three maps by the probabilities that the lidar map is drawn with."""
    table = _table(
        "lidar map drawn with", "hit, miss", "lidar", "RSF+All", "ours", "RSF+All gains: SSIM, NCC"
    )
    for hit, miss in WEIGHTS:
        one = mapped(of, run, (f"map.hit_probability={hit}", f"map.miss_probability={miss}"))
        lidar, rsf, ours = (one.row(grid) for grid in (one.lidar, *_fused(one, (RSF_ALL, OURS))))
        gains = f"{rsf.errors.ssim - lidar.errors.ssim:+.3f} {rsf.errors.ncc - lidar.errors.ncc:+.3f}"
        table.add_row(f"{hit}, {miss}", *(_figures(row) for row in (lidar, rsf, ours)), gains)
    return table


def regions(of: Recorded, run: FinishedRun) -> Table:
    """Shares of the mean square error by where the truth, bowed, has what; and a perfect sonar map."""
    one = mapped(of, run, bowed=True)
    sweeps = _sweeps(run, run.result().tracks, "FGfit")
    maps = {LIDAR: one.lidar, **dict(zip((RSF_ALL, OURS), _fused(one, (RSF_ALL, OURS)), strict=True))}
    maps[_PERFECT] = fuse("rsf_all", one.lidar, perfect_sonar_map(one), sweeps, one.base.fusion).map
    table = _table("mean square error by region (truth bowed as the map is)", "map", "all", *REGIONS, "image")
    for name, grid in maps.items():
        mine, true, places = compared_cells(one, grid)
        error = (_GREYS[mine] - _GREYS[true]) ** 2 / mine.size
        parts = (f"{error[inside].sum():.0f}" for inside in by_region(true, places))
        table.add_row(name, f"{error.sum():.0f}", *parts, _figures(one.row(grid)))
    return table


def revisit(of: Recorded, run: FinishedRun) -> Table:
    """Revisit Scan Fusion with other arcs, another threshold for glass, other sonars and other sonar maps."""
    one = mapped(of, run)
    rsf: dict[str, Any] = {"method": "rsf_all"}
    variants: dict[str, dict[str, Any]] = {
        "as it is": {},
        "arcs twice as thick": {"arc_thickness": 0.05},
        "glass from a gap of 0.25 m": {"fusion": {"glass_gap": 0.25}},
        "two sonars": {"fusion": {"sonars": "sides"}},
        "two sonars, a gap of 0.25 m": {"fusion": {"sonars": "sides", "glass_gap": 0.25}},
        "a cone of 30 deg": {"beam_width_deg": 30.0},
        **{f"sonar map by {name}": {"algorithm": name} for name in ALGORITHMS[:-1]},
    }
    table = _table("RSF+All", "variant", "MSE SSIM NCC mean", "saved: MSE SSIM NCC mean")
    for name, variant in variants.items():
        grid = one.fused({**variant, "fusion": {**rsf, **variant.get("fusion", {})}})
        table.add_row(name, _figures(one.row(grid)), _figures(one.row(grid), saved=True))
    return table


def truth(of: Recorded, run: FinishedRun) -> Table:
    """Three maps, and the plan bowed as they are, against the straight plan and against the bowed one."""
    straight, bowed = mapped(of, run), mapped(of, run, bowed=True)
    table = _table("truth", "map", "straight", "bowed as the map")
    maps = {
        LIDAR: straight.lidar,
        **dict(zip((RSF_ALL, OURS), _fused(straight, (RSF_ALL, OURS)), strict=True)),
    }
    for name, grid in maps.items():
        table.add_row(name, _figures(straight.row(grid)), _figures(bowed.row(grid)))
    itself = bowed.truth.grid
    rows = [replace(one, motion=(0.0, 0.0, 0.0)).row(itself) for one in (straight, bowed)]
    table.add_row("the bowed plan itself", *map(_figures, rows))
    table.add_row("the same as saved", *(_figures(row, saved=True) for row in rows))
    return table


def poses(of: Recorded, run: FinishedRun) -> Table:
    """Sonar maps pasted onto the lidar map by poses that differ in one thing at a time."""
    one = mapped(of, run)
    tracks = run.result().tracks
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
    best = _sweeps(run, tracks, "FGfit")
    title = f"poses; local and final ones are at most {drift:.1g} m apart"
    table = _table(title, "poses", "off FGfit: mean, largest (cm)", "MSE SSIM NCC mean")
    for name, (by, kind) in kinds.items():
        sweeps = _sweeps(run, by, kind)
        both, mine, theirs = np.intersect1d(sweeps.stamps, best.stamps, return_indices=True)
        off = 100.0 * np.hypot(*(sweeps.poses[mine, :2] - best.poses[theirs, :2]).T)
        pasted = fuse("attach", one.lidar, build_sonar_map(sweeps, one.base), None, one.base.fusion).map
        table.add_row(name, f"{off.mean():.1f} {off.max():.1f} ({both.size})", _figures(one.row(pasted)))
    return table


def algorithms(of: Recorded, run: FinishedRun) -> Table:
    """What each algorithm pastes, with cones as they are and made thin."""
    one = mapped(of, run, bowed=True)
    sweeps = _sweeps(run, run.result().tracks, "FGfit")
    thin = {"beam_width_deg": 1.0, "arc_thickness": 0.01, "arc_growth": 0.0}
    variants: list[tuple[str, dict[str, Any]]] = [
        *((name, {"algorithm": name}) for name in ALGORITHMS),
        ("BFA, a cone of 30 deg", {"beam_width_deg": 30.0}),
        ("ICo, a cone of 1 deg", {"algorithm": "ICo", **thin}),
        ("BFA, a cone of 1 deg", thin),
        ("ICL that forgets nothing", {"algorithm": "ICL", "old_weight": 0.999, "new_weight": 0.999}),
        ("ICo that forgets nothing", {"algorithm": "ICo", "old_weight": 0.999, "new_weight": 0.999}),
    ]
    before, true, _ = compared_cells(one, one.lidar)
    distance = ndimage.distance_transform_edt(true < SOLID)
    headings = (
        "map",
        "all",
        "on a wall",
        "1 cell off",
        "farther",
        "glass within 2 cells",
        "MSE SSIM NCC mean",
    )
    table = _table("cells pasted", *headings)
    for name, update in variants:
        config = changed(one.base, update)
        heard = build_sonar_map(sweeps, config)
        grid = fuse("attach", one.lidar, heard, None, config.fusion).map
        alone = ndimage.distance_transform_edt(compared_cells(one, heard)[0] < SOLID)
        shown = f"{100 * (alone[true == PANE] <= 2.0).mean():.0f} %"
        pasted = (compared_cells(one, grid)[0] >= SOLID) & (before < SOLID)
        off = distance[pasted]
        counts = (off.size, (off == 0).sum(), ((off > 0) & (off < 1.5)).sum(), (off >= 1.5).sum())
        table.add_row(name, *map(str, counts), shown, _figures(one.row(grid)))
    return table


EXPERIMENTS: dict[str, Callable[[Recorded, FinishedRun], Table]] = {
    "weights": weights, "regions": regions, "revisit": revisit, "truth": truth, "poses": poses,
    "algorithms": algorithms,
}  # fmt: skip


def _table(title: str, *headings: str) -> Table:
    table = Table(title=title)
    for heading in headings:
        table.add_column(heading, justify="left" if heading == headings[0] else "right")
    return table


def _figures(row: Row, *, saved: bool = False) -> str:
    errors, mean = (row.saved, row.saved_mean) if saved else (row.errors, row.mean)
    return f"{errors.mse:.0f} {errors.ssim:.3f} {errors.ncc:.3f} {mean:.3f}"


def _fused(one: Mapped, names: Sequence[str]) -> list[OccupancyMap]:
    return [one.fused(VARIANTS[name]) for name in names]


def _sweeps(run: FinishedRun, tracks: PoseTracks, kind: PoseKind) -> SonarSweeps:
    ring = run.facts.info.sonar_ring
    if ring is None:
        raise GlassSlamError("the recording holds no sonar")
    return placed_sweeps(run.sweeps, ring, tracks, kind)


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
            run = finished(one)
            for name in words.experiments or EXPERIMENTS:
                Console(width=180).print(EXPERIMENTS[name](one, run))
    except GlassSlamError as error:
        print(f"error: {error.message}" + (f" ({error.hint})" if error.hint else ""), file=sys.stderr)
        return error.exit_code
    return 0


if __name__ == "__main__":
    sys.exit(main())
