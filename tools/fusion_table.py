"""Maps of lidar and sonar by every rule, laid out as in Tables I to III of the pi-map paper.

Every recording goes through SLAM once; all rows come from the same poses and the same beams, and the truth is
laid onto the map of the lidar once for all of them. Tables I and II are of the real hallway (scene 4), Table
III of eight simulated scenes of the same kinds. Below them: the other decision layers, and two side sonars.

python tools/fusion_table.py --data DATA                      everything; DATA holds pimap/scene4.bag
python tools/fusion_table.py --scenes 1 4 --keep recordings   two simulated scenes; keep their recordings
python tools/fusion_table.py --data DATA --scenes --json      the hallway alone; print the figures
"""

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, get_args

import numpy as np
from rich.console import Console
from rich.table import Table

from glassslam.api import run_slam
from glassslam.cli.settings import resolve_config
from glassslam.config import FusionConfig, SonarConfig
from glassslam.errors import GlassSlamError, RecordingError
from glassslam.evaluation import ImageErrors, align_maps, evaluate_image, read_glass_cells, read_map
from glassslam.simulation import Scene, find_scene, simulate, write_recording
from glassslam.slam.result import OccupancyMap
from glassslam.sources import SourceOptions

SCENES = {
    1: "pimap_1_room", 2: "pimap_2_three_rooms", 3: "pimap_3_hallway_rooms", 4: "pimap_4_hallway",
    5: "pimap_5_office", 6: "pimap_6_two_rooms", 7: "pimap_7_lounge", 8: "pimap_8_lobby",
}  # fmt: skip
HELD_OUT = (5, 6, 7, 8)
RING = "pioneer-3dx"
# the simulated ring is four times as noisy as the recorded one (errors up to 11 cm): a reading tells less;
# chosen on scenes 1-4 in favour of the rules that use the sonar map, which ours does not
RING_BELIEFS = ("sonar.occupied_belief=0.2", "sonar.empty_belief=0.3")
# what `glassslam calibrate scene4.bag --geometry` finds for the lidar of the hallway, and where it stands
HALLWAY_BEAMS = (
    "sensor.bearing_cosine=0.0079", "sensor.bearing_sine=0.0022", "sensor.lateral_offset=-0.0233",
    "sensor.range_offset=-0.0048",
)  # fmt: skip
HALLWAY_LASER = (0.12, 0.0, 0.0)

LIDAR, OURS, RSF_ALL = "lidar", "ours", "FGfit+RSF+All"
# in pi-map beams without echo clear nothing; the other way is shown beside it
CLEARED, RSF_CLEARED = "lidar, silence clears", "RSF+All, silence clears"
ON_CLEARED = (RSF_CLEARED,)
TABLE_I = (LIDAR, "Loc", "PG", "FG", "FGfit", "FGfit+RSF+Glass", RSF_ALL, OURS)
TABLE_II = ("ICL", "ICo", "DS", "BFA")
TABLE_III = (LIDAR, "Loc", "PG", RSF_ALL, OURS)
LAYERS = (CLEARED, RSF_CLEARED, "overlay", "pessimistic", "minmax", "lop", "liop", "iop", "bayes")
SIDES = {f"{name}, 2 sonars": name for name in (RSF_ALL, OURS)}
FUSIONS = get_args(FusionConfig.model_fields["method"].annotation)
VARIANTS: dict[str, dict[str, Any]] = {
    **{kind: {"pose_kind": kind, "fusion": {"method": "attach"}} for kind in ("Loc", "PG", "FG", "FGfit")},
    **{name: {"algorithm": name, "fusion": {"method": "attach"}} for name in TABLE_II},
    "FGfit+RSF+Glass": {"fusion": {"method": "rsf_glass"}},
    RSF_ALL: {"fusion": {"method": "rsf_all"}},
    OURS: {"fusion": {"method": "walls"}},
    RSF_CLEARED: {"fusion": {"method": "rsf_all"}},
    **{name: {"fusion": {"method": name}} for name in LAYERS[2:]},
    f"{RSF_ALL}, 2 sonars": {"fusion": {"method": "rsf_all", "sonars": "sides"}},
    f"{OURS}, 2 sonars": {"fusion": {"method": "walls", "sonars": "sides"}},
}
PUBLISHED = {
    LIDAR: "1142.70 0.8924 0.8090", "Loc": "1255.71 0.8965 0.7957", "PG": "1255.71 0.8965 0.7957",
    "FG": "1232.11 0.8971 0.7999",
    "FGfit": "1189.09 0.9016 0.8072", "FGfit+RSF+Glass": "361.96 0.9370 0.9417",
    RSF_ALL: "229.60 0.9636 0.9631", "ICL": "1700.18 0.8775 0.7278", "ICo": "1764.99 0.8749 0.7186",
    "DS": "1264.07 0.8962 0.7948", "BFA": "1189.09 0.9016 0.8072",
}  # fmt: skip


@dataclass(frozen=True)
class Recorded:
    """A recording with lidar and sonar, and its true map."""

    name: str
    bag: Path
    truth: Path
    sonar: Path | None = None
    laser_pose: tuple[float, float, float] | None = None
    assignments: tuple[str, ...] = ()


@dataclass(frozen=True)
class Row:
    """One map against the truth, and the seconds of all that followed SLAM."""

    errors: ImageErrors
    seconds: float

    @property
    def mean(self) -> float:
        """Mean of SSIM and NCC, by which Table III of the paper ranks."""
        return 0.5 * (self.errors.ssim + self.errors.ncc)


@dataclass(frozen=True)
class Measured:
    """All rows of a recording; the share of its true walls that is glass."""

    name: str
    glass_share: float
    rows: dict[str, Row]


def hallway(data: Path, truth: Path) -> Recorded:
    """The real scene 4.

    Raises
    ------
    RecordingError
        The folder does not hold it.
    """
    bag, sonar = data / "pimap" / "scene4.bag", data / "pimap" / "scene4_sonar.txt"
    if not (bag.is_file() and sonar.is_file()):
        raise RecordingError(f"{data} does not hold pimap/scene4.bag", "see datasets/pi-map.yaml")
    return Recorded("scene 4, real", bag, truth, sonar, HALLWAY_LASER, HALLWAY_BEAMS)


def simulated(number: int, folder: Path) -> Recorded:
    """A simulated scene, recorded into a folder unless it is there already."""
    bag = folder / f"{SCENES[number]}.bag"
    if not bag.is_file():
        write_recording(simulate(Scene.load(find_scene(SCENES[number])), sonar=RING), bag)
    return Recorded(SCENES[number], bag, Path(f"{bag}.truth.map.yaml"), assignments=RING_BELIEFS)


def measure(of: Recorded, names: Sequence[str], assignments: Sequence[str] = ()) -> Measured:
    """Map a recording once and compare every variant with the truth."""
    config = resolve_config(None, [*of.assignments, *assignments])
    options = SourceOptions(sonar=of.sonar, laser_pose=of.laser_pose)
    run = run_slam(of.bag, config, source_options=options)
    truth, glass = read_map(of.truth), read_glass_cells(of.truth)
    base, lidar, cleared = config.sonar, run.returns_map(), run.result().lidar_map
    motion = align_maps(cleared, truth)

    def compared(grid: OccupancyMap, seconds: float) -> Row:
        return Row(evaluate_image(grid, truth, map_from_truth=motion), seconds)

    rows = {LIDAR: compared(lidar, 0.0), CLEARED: compared(cleared, 0.0)}
    for name in names:
        if name in VARIANTS:
            began = time.perf_counter()
            result = run.result(_changed(base, VARIANTS[name]), cleared if name in ON_CLEARED else lidar)
            seconds = time.perf_counter() - began
            if result.sonar is None:
                raise RecordingError(f"{of.bag} holds no sonar")
            rows[name] = compared(result.sonar.fused_map, seconds)
    share = float("nan") if glass is None else glass.sum() / (truth.probability > 0.5).sum()
    return Measured(of.name, float(share), rows)


def _changed(base: SonarConfig, variant: dict[str, Any]) -> SonarConfig:
    fusion = base.fusion.model_copy(update=variant.get("fusion", {}))
    return base.model_copy(update={**variant, "fusion": fusion})


def table_of(scene: Measured, names: Sequence[str], title: str) -> Table:
    """Variants down, metrics across, with the figures of the paper where it has them."""
    table = Table(title=f"{title}: {scene.name}")
    for heading in ("map", "MSE", "SSIM", "NCC", "mean", "s", "pi-map: MSE SSIM NCC"):
        table.add_column(heading, justify="left" if heading == "map" else "right")
    for name in names:
        if name in scene.rows:
            row = scene.rows[name]
            e = row.errors
            cells = (f"{e.mse:.2f}", f"{e.ssim:.4f}", f"{e.ncc:.4f}", f"{row.mean:.4f}", f"{row.seconds:.2f}")
            table.add_row(name, *cells, PUBLISHED.get(name, ""))
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
        means = (float(np.mean([scene.rows[name].mean for scene in group])) for name in names)
        table.add_row(label, "", *(f"{mean:.4f}" for mean in means))
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
        console.print(table_of(real, LAYERS, "other decision layers"))
        console.print(table_of(real, (RSF_ALL, OURS, *SIDES), "all sonars and two at the sides"))
    if scenes:
        console.print(table_iii(scenes, TABLE_III, "Table III: SSIM, NCC, and their mean"))
        for names, title in (
            (TABLE_I, "poses"),
            (TABLE_II, "sonar algorithms"),
            (LAYERS, "other layers"),
            ((RSF_ALL, OURS, *SIDES), "two sonars"),
        ):
            console.print(table_iii(scenes, names, f"the same for: {title}"))


def figures(one: Measured) -> dict[str, Any]:
    """Plain data for JSON."""
    rows = {
        name: {**asdict(row.errors), "mean": row.mean, "seconds": row.seconds}
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
    parser.add_argument("--keep", type=Path, metavar="DIR", help="use and keep simulated recordings here")
    parser.add_argument("--set", dest="assignments", action="append", default=[], metavar="NAME=VALUE")
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    return parser.parse_args(arguments)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the program."""
    words = parse_arguments(arguments)
    try:
        with tempfile.TemporaryDirectory() as scratch:
            folder = words.keep or Path(scratch)
            folder.mkdir(parents=True, exist_ok=True)
            real = None
            if words.data is not None:
                truth = words.truth or true_hallway(folder)
                real = measure(hallway(words.data, truth), tuple(VARIANTS), words.assignments)
            scenes = [measure(simulated(k, folder), tuple(VARIANTS), words.assignments) for k in words.scenes]
        if words.json:
            print(json.dumps([figures(one) for one in (*([real] if real else []), *scenes)], indent=2))
        else:
            show(Console(width=160), real, scenes)
    except GlassSlamError as error:
        print(f"error: {error.message}" + (f" ({error.hint})" if error.hint else ""), file=sys.stderr)
        return error.exit_code
    return 0


def true_hallway(folder: Path) -> Path:
    """Draw the true map of scene 4 into a folder."""
    import pimap_truth  # noqa: PLC0415  (a neighbour of this program)

    from glassslam.yamlmodel import load_yaml_model  # noqa: PLC0415

    plan = load_yaml_model(pimap_truth.PLAN, pimap_truth.Plan)
    pimap_truth.write(plan, folder, straight=True)
    return folder / f"{plan.name}.yaml"


if __name__ == "__main__":
    sys.exit(main())
