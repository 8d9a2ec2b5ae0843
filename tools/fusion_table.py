"""Maps of lidar and sonar by every rule, laid out as in Tables I to III of the pi-map paper.

Every recording goes through SLAM once; all rows come from the same poses and the same beams, and the truth is
laid onto the map of the lidar once for all of them. Tables I and II are of the real hallway (scene 4), Table
III of eight simulated scenes of the same kinds. Below them: the other decision layers, and two side sonars.

All of it comes twice: drawn as in pi-map, with the probabilities of Cartographer, and drawn as by default.
Unknown cells have the grey 128; figures of the files that map_server saves, where it is 205, stand beside.

python tools/fusion_table.py --data DATA                      everything; DATA holds pimap/scene4.bag
python tools/fusion_table.py --scenes 1 4 --keep recordings   two simulated scenes; keep their recordings
python tools/fusion_table.py --data DATA --scenes --json      the hallway alone; print the figures
python tools/fusion_table.py --data DATA --scenes --bowed     the plan of the hallway bowed as the map is
"""

import argparse
import contextlib
import json
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from fusion_rows import (
    ALGORITHMS,
    CLEARED,
    DRAWN,
    HELD_OUT,
    LAYERS,
    LIDAR,
    OURS,
    POSES,
    RSF_ALL,
    RSF_CLEARED,
    RSF_GLASS,
    SCENES,
    SIDES,
    VARIANTS,
    Measured,
    hallway,
    measure,
    simulated,
)
from pimap_truth import PLAN, Plan, write
from rich.console import Console
from rich.table import Table

from glassslam.errors import GlassSlamError
from glassslam.yamlmodel import load_yaml_model

TABLE_I = (LIDAR, *POSES, RSF_GLASS, RSF_ALL, OURS)
TABLE_II = ALGORITHMS
TABLE_III = (LIDAR, "Loc", "PG", RSF_ALL, OURS)
OTHERS = (CLEARED, RSF_CLEARED, *LAYERS)
PUBLISHED = {
    LIDAR: "1142.70 0.8924 0.8090", "Loc": "1255.71 0.8965 0.7957", "PG": "1255.71 0.8965 0.7957",
    "FG": "1232.11 0.8971 0.7999",
    "FGfit": "1189.09 0.9016 0.8072", "FGfit+RSF+Glass": "361.96 0.9370 0.9417",
    RSF_ALL: "229.60 0.9636 0.9631", "ICL": "1700.18 0.8775 0.7278", "ICo": "1764.99 0.8749 0.7186",
    "DS": "1264.07 0.8962 0.7948", "BFA": "1189.09 0.9016 0.8072",
}  # fmt: skip


def table_of(scene: Measured, names: Sequence[str], title: str) -> Table:
    """Variants down, metrics across, with the figures of the paper where it has them."""
    table = Table(title=f"{title}: {scene.name}")
    headings = ("map", "MSE", "SSIM", "NCC", "mean", "saved: SSIM NCC mean", "s", "pi-map: MSE SSIM NCC")
    for heading in headings:
        table.add_column(heading, justify="left" if heading == "map" else "right")
    for name in names:
        if name in scene.rows:
            row = scene.rows[name]
            e, saved = row.errors, row.saved
            beside = f"{saved.ssim:.4f} {saved.ncc:.4f} {row.saved_mean:.4f}"
            cells = (f"{e.mse:.2f}", f"{e.ssim:.4f}", f"{e.ncc:.4f}", f"{row.mean:.4f}", beside)
            table.add_row(name, *cells, f"{row.seconds:.2f}", PUBLISHED.get(name, ""))
    return table


def table_iii(scenes: Sequence[Measured], names: Sequence[str], title: str) -> Table:
    """Scenes down, variants across: SSIM, NCC and their mean."""
    table = Table(title=title)
    for heading in ("scene", "glass %", *names):
        table.add_column(heading, justify="left" if heading == "scene" else "right")
    for scene in scenes:
        cells = [
            f"{row.errors.ssim:.4f} {row.errors.ncc:.4f}\n{row.mean:.4f}"
            for row in (scene.rows[name] for name in names)
        ]
        table.add_row(scene.name, f"{100 * scene.glass_share:.1f}", *cells)
    for label, group in groups(scenes):
        rows = [[scene.rows[name] for scene in group] for name in names]
        means = (f"{np.mean([row.mean for row in one]):.4f}" for one in rows)
        table.add_row(label, "", *means)
        saved = (f"{np.mean([row.saved_mean for row in one]):.4f}" for one in rows)
        table.add_row(f"  {label}, as saved", "", *saved)
    return table


def groups(scenes: Sequence[Measured]) -> Iterator[tuple[str, list[Measured]]]:
    """All scenes; and, where there are both, those used for development and those held out."""
    held = {SCENES[number] for number in HELD_OUT}
    new = [scene for scene in scenes if scene.name in held]
    old = [scene for scene in scenes if scene.name not in held]
    if old and new:
        yield "mean of 1-4 (development)", old
        yield "mean of 5-8 (held out)", new
    yield "mean", list(scenes)


def show(console: Console, real: Measured | None, scenes: Sequence[Measured]) -> None:
    """Print all tables for which there are figures."""
    if real is not None:
        console.print(table_of(real, TABLE_I, "Table I"))
        console.print(table_of(real, TABLE_II, "Table II"))
        console.print(table_of(real, OTHERS, "other decision layers"))
        console.print(table_of(real, (RSF_ALL, OURS, *SIDES), "all sonars and two at the sides"))
    if scenes:
        console.print(table_iii(scenes, TABLE_III, "Table III: SSIM, NCC, and their mean"))
        for names, title in (
            (TABLE_I, "poses"),
            (TABLE_II, "sonar algorithms"),
            (OTHERS, "other layers"),
            ((RSF_ALL, OURS, *SIDES), "two sonars"),
        ):
            console.print(table_iii(scenes, names, f"the same for: {title}"))


def figures(one: Measured) -> dict[str, Any]:
    """Plain data for JSON."""
    rows = {
        name: {
            **asdict(row.errors),
            "mean": row.mean,
            "saved": {**asdict(row.saved), "mean": row.saved_mean},
            "seconds": row.seconds,
        }
        for name, row in one.rows.items()
    }
    return {"name": one.name, "glass_share": one.glass_share, "rows": rows}


def parse_arguments(arguments: Sequence[str] | None = None) -> argparse.Namespace:
    """Options of the program."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path, metavar="DIR", help="folder with pimap/scene4.bag and its sonar")
    parser.add_argument(
        "--truth", type=Path, metavar="MAP", help="its truth [default: made by pimap_truth.py]"
    )
    parser.add_argument(
        "--scenes", type=int, nargs="*", choices=SCENES, default=list(SCENES), help="simulated scenes [all]"
    )
    parser.add_argument("--bowed", action="store_true", help="bow the plan of the hallway as the map is")
    parser.add_argument("--keep", type=Path, metavar="DIR", help="use and keep simulated recordings here")
    parser.add_argument("--set", dest="assignments", action="append", default=[], metavar="NAME=VALUE")
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    return parser.parse_args(arguments)


def measured(words: argparse.Namespace, folder: Path) -> list[dict[str, Measured]]:
    """The hallway, if asked for, and the simulated scenes; their recordings are kept in the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    names, more = tuple(VARIANTS), words.assignments
    out = []
    if words.data is not None:
        one = hallway(words.data, words.truth or true_hallway(folder))
        out.append(measure(one, names, more, bowed=words.bowed))
    return out + [measure(simulated(k, folder), names, more) for k in words.scenes]


def true_hallway(folder: Path) -> Path:
    """Draw the true map of scene 4 into a folder."""
    plan = load_yaml_model(PLAN, Plan)
    with contextlib.redirect_stdout(sys.stderr):
        write(plan, folder, straight=True)
    return folder / f"{plan.name}.yaml"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the program."""
    words = parse_arguments(arguments)
    try:
        with tempfile.TemporaryDirectory() as scratch:
            found = measured(words, words.keep or Path(scratch))
        if words.json:
            plain = [{"drawn": way, **figures(one)} for of in found for way, one in of.items()]
            print(json.dumps(plain, indent=2))
        else:
            console = Console(width=180)
            for way in DRAWN:
                console.rule(way)
                scenes = [of[way] for of in found]
                real = scenes.pop(0) if words.data is not None else None
                show(console, real, scenes)
    except GlassSlamError as error:
        print(f"error: {error.message}" + (f" ({error.hint})" if error.hint else ""), file=sys.stderr)
        return error.exit_code
    return 0


if __name__ == "__main__":
    sys.exit(main())
