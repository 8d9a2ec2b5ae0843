"""Map buildings full of glass with every locking scheme, and lay out what they find as Weerakoon et al. do.

The rows are buildings and the columns schemes, as in Table II of their paper: length of glass, detected
glass, accuracy, and false glass. Every building is mapped twice: as it is, and with a local SLAM that trusts
the drifting odometry blindly, so that loop closure has to correct the drift after glass has been stored.

python tools/glass_schemes.py                               the two simulated buildings
python tools/glass_schemes.py --keep glass --json           keep the recordings; print the figures
python tools/glass_schemes.py run.bag=panes.geojson --schemes lite anchored --sensor utm30lx
"""

import argparse
import json
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from glassslam.api import map_recording
from glassslam.cli.settings import resolve_config, sensor_assignments
from glassslam.config import Config
from glassslam.errors import GlassSlamError
from glassslam.evaluation import GlassCellErrors, align, associate, evaluate_glass_cells, read_true_glass
from glassslam.geometry import compose, inverse
from glassslam.outputs import read_tum
from glassslam.records import FloatArray, Trajectory
from glassslam.simulation import Scene, find_scene, simulate, write_recording

SCENES = ("glass_building_1", "glass_building_2")
SCHEMES = ("local", "global", "lite", "anchored")
DRIFT = ("local.translation_weight=1000", "local.rotation_weight=1000")
PUBLISHED = (
    "Weerakoon et al. 2021, Table II, real buildings: No.1 140.5 m of glass, Cartographer_glass_lite 120.3 m"
    " = 85.9 %, slam_glass 118.2 m = 84.0 %; No.2 110.0 m, 107.2 m = 97.5 %, 49.1 m = 44.5 %"
)


@dataclass(frozen=True)
class Building:
    """A recording and its true glass; the length of everything else, m, where it is known."""

    name: str
    bag: Path
    truth: Path
    opaque: float | None


@dataclass(frozen=True)
class Run:
    """What one scheme has made of a building."""

    building: str
    scheme: str
    drift: bool
    opaque: float | None
    trajectory_rmse: float | None
    errors: GlassCellErrors

    @property
    def false_percent(self) -> float | None:
        """False glass as a share of the opaque length."""
        return 100.0 * self.errors.false_length / self.opaque if self.opaque else None


def recorded(folder: Path) -> Iterator[Building]:
    """The simulated buildings, recorded into a folder unless they are there already."""
    for name in SCENES:
        bag = folder / f"{name}.bag"
        if not bag.is_file():
            write_recording(simulate(Scene.load(find_scene(name))), bag)
        yield building(str(bag))


def building(text: str) -> Building:
    """The building of "BAG" or "BAG=TRUTH"; the truth of a simulated recording lies beside it."""
    bag, _, truth = text.partition("=")
    plan = Path(f"{bag}.truth.json")
    opaque = json.loads(plan.read_text())["opaque_m"] if plan.is_file() else None
    return Building(Path(bag).stem, Path(bag), Path(truth or f"{bag}.truth.glass.geojson"), opaque)


def true_from_map(trajectory: Trajectory, of: Building) -> tuple[FloatArray, float] | None:
    """Pose of the map in the frame of the truth, and the error of the trajectory, m; None if not known.

    The frame of a map hangs on its first pose. With drift, that pose is turned a little against all others,
    which is no fault of the glass: so the whole trajectory is laid onto the true one, without scale.
    """
    truth = Path(f"{of.bag}.truth.tum")
    if not truth.is_file():
        return None
    known = read_tum(truth)
    estimated, true = associate(trajectory, known)
    world_from_map = align(estimated, true)
    gaps = compose(world_from_map, estimated)[:, :2] - true[:, :2]
    rmse = float(np.sqrt((gaps**2).sum(axis=1).mean()))
    return compose(inverse(known.poses[0]), world_from_map), rmse


def run(of: Building, scheme: str, config: Config, *, drift: bool) -> Run:
    """Map a building with one scheme and compare the cells that are glass at the end."""
    result = map_recording(of.bag, config)
    cells = np.empty((0, 2)) if result.glass is None else result.glass.locked_cells
    placed = true_from_map(result.trajectory, of)
    errors = evaluate_glass_cells(
        cells,
        read_true_glass(of.truth),
        resolution=result.map.resolution,
        true_from_map=None if placed is None else placed[0],
    )
    return Run(of.name, scheme, drift, of.opaque, None if placed is None else placed[1], errors)


def build_table(runs: Sequence[Run], tolerance: int) -> Table:
    """Buildings down, schemes across; the tolerance as its rank among those evaluated."""
    schemes = list(dict.fromkeys(one.scheme for one in runs))
    limit = runs[0].errors.within[tolerance].tolerance
    table = Table(
        title=f"detected glass (m), accuracy (%) within {limit:.2f} m, false glass (m, % of opaque)"
    )
    for heading in ("building", "glass (m)", "drift", *schemes):
        table.add_column(heading, justify="left" if heading == "building" else "right")
    for name, drift in dict.fromkeys((one.building, one.drift) for one in runs):
        row = {one.scheme: one for one in runs if (one.building, one.drift) == (name, drift)}
        length = next(iter(row.values())).errors.true_length
        cells = [_cell(row[scheme], tolerance) if scheme in row else "-" for scheme in schemes]
        table.add_row(name, f"{length:.1f}", "yes" if drift else "no", *cells)
    return table


def _cell(one: Run, tolerance: int) -> str:
    within = one.errors.within[tolerance]
    percent = "-" if within.found_percent is None else f"{within.found_percent:.1f} %"
    false = "" if one.false_percent is None else f" = {one.false_percent:.2f} %"
    return f"{within.found:.1f} = {percent}\nfalse {one.errors.false_length:.1f}{false}"


def parse_arguments() -> argparse.Namespace:
    """Options of the program."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("recordings", nargs="*", help="BAG, or BAG=TRUTH [default: two simulated buildings]")
    parser.add_argument("--schemes", nargs="+", choices=("off", *SCHEMES), default=list(SCHEMES))
    parser.add_argument("--drift", choices=("both", "no", "yes"), default="both", help="which variants")
    parser.add_argument("--sensor", help="kind of lidar, as in glassslam map [default: found out]")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="change a parameter")
    parser.add_argument("--within", type=int, choices=(10, 15, 25), default=10, help="tolerance, cm")
    parser.add_argument("--keep", type=Path, help="simulate into this folder; what is there is used again")
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    return parser.parse_args()


def main() -> int:
    """Map everything; 1 when a recording fails."""
    arguments = parse_arguments()
    drifts = {"both": (False, True), "no": (False,), "yes": (True,)}[arguments.drift]
    runs: list[Run] = []
    with tempfile.TemporaryDirectory() as scratch:
        folder = arguments.keep or Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        try:
            for of in map(building, arguments.recordings) if arguments.recordings else recorded(folder):
                for drift in drifts:
                    for scheme in arguments.schemes:
                        words = [*sensor_assignments(arguments.sensor), f"glass.scheme='{scheme}'"]
                        config = resolve_config(None, [*words, *(DRIFT if drift else ()), *arguments.set])
                        runs.append(run(of, scheme, config, drift=drift))
        except GlassSlamError as error:
            print(f"error: {error.message}", file=sys.stderr)
            return error.exit_code
    _show(runs, arguments.json, (10, 15, 25).index(arguments.within))
    return 0


def _show(runs: Sequence[Run], as_json: bool, tolerance: int) -> None:
    if as_json:
        rows = [{**asdict(one), "false_percent": one.false_percent} for one in runs]
        print(json.dumps(rows, indent=2))
        return
    console = Console(width=None if sys.stdout.isatty() else 160)
    console.print(build_table(runs, tolerance))
    console.print(PUBLISHED)


if __name__ == "__main__":
    sys.exit(main())
