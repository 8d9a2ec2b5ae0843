"""`glassslam simulate`: a recording of a robot in a scene, with the truth beside it."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from glassslam.errors import UsageError

if TYPE_CHECKING:
    from glassslam.simulation import Simulation, WrittenRecording

EXAMPLES = """\
  glassslam simulate office -o office.bag
  glassslam simulate office -o office.bag --sensor rplidar --seed 3
  glassslam simulate glass_building_1 -o glass.bag --rate 20
  glassslam simulate pimap_4_hallway -o hall.bag --sonar pioneer-3dx
  glassslam simulate my_floor.yaml -o my_floor.bag --overwrite
"""

SceneName = Annotated[
    str,
    typer.Argument(
        metavar="SCENE", help="Name of a shipped scene (office), or a YAML file.", show_default=False
    ),
]
Bag = Annotated[Path, typer.Option("--output", "-o", metavar="BAG", help="The ROS 1 bag to write.")]
Sensor = Annotated[
    str | None,
    typer.Option(metavar="NAME", help="ust10lx, utm30lx, lms200 or rplidar [default: that of the scene]."),
]
Sonar = Annotated[
    str | None,
    typer.Option(
        metavar="RING",
        help="Also a ring of sonars: pioneer-3dx, pioneer-2dx, turtlebot-9 or a YAML file [default: none].",
        show_default=False,
    ),
]
Seed = Annotated[int, typer.Option(min=0, metavar="N", help="Seed of all noise: same seed, same bytes.")]
Rate = Annotated[
    float | None,
    typer.Option(metavar="HZ", help="Scans recorded per second [default: that of the scene, or all]."),
]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace an existing bag.")]
Json = Annotated[bool, typer.Option("--json", help="Print what was written as JSON.")]


def simulate(
    scene: SceneName,
    output: Bag,
    sensor: Sensor = None,
    sonar: Sonar = None,
    seed: Seed = 0,
    rate: Rate = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:
    """Write a recording of a robot driving through a simulated building.

    Beside the bag stand the true pose at every scan (BAG.truth.tum), the true walls (BAG.truth.json),
    the true glass (BAG.truth.glass.geojson), what every beam met (BAG.truth.labels.npz) and the true map
    (BAG.truth.map.yaml), which evaluate --truth reads.
    """
    from glassslam.cli.settings import check_not_root  # noqa: PLC0415  (loads pydantic)
    from glassslam.cli.terminal import emit  # noqa: PLC0415
    from glassslam.outputs.lock import locked  # noqa: PLC0415
    from glassslam.simulation import Scene, find_scene  # noqa: PLC0415  (loads numba)
    from glassslam.simulation import simulate as prepare  # noqa: PLC0415

    check_not_root(output)
    with locked(output):
        if output.suffix.lower() != ".bag":
            raise UsageError(f"-o {output}: a ROS 1 bag is written", "give it a name that ends in .bag")
        if output.exists() and not overwrite:
            raise UsageError(f"{output} exists already", "use --overwrite to replace it")
        simulation = prepare(Scene.load(find_scene(scene)), sensor, seed, rate, sonar)
        written = record(simulation, output, quiet=json)
    if json:
        from json import dumps  # noqa: PLC0415

        emit(dumps(_summary(simulation, written), indent=2) + "\n")
    else:
        emit(describe(simulation, written))


def record(simulation: "Simulation", bag: Path, *, quiet: bool = False) -> "WrittenRecording":
    """Write a simulation, with a progress bar where there is a terminal."""
    from glassslam.simulation import write_recording  # noqa: PLC0415

    with _recording_bar(float(simulation.motion.times[-1]), quiet) as progress:
        return write_recording(simulation, bag, progress)


def describe(simulation: "Simulation", written: "WrittenRecording") -> str:
    """What was written, for the terminal."""
    seconds = float(simulation.motion.times[-1])
    scans = f"{written.scans} scans of a {simulation.sensor.name}"
    lines = [f"simulated {simulation.scene.name}: {scans}, {simulation.driven:.1f} m in {seconds:.0f} s"]
    paths = (
        *(written.bag, written.true_trajectory, written.true_plan, written.true_labels, written.true_glass),
        *(written.true_map, written.true_image, written.true_classes),
    )
    return "".join(f"{line}\n" for line in (*lines, *(f"wrote {path}" for path in paths)))


def _summary(simulation: "Simulation", written: "WrittenRecording") -> dict[str, Any]:
    return {
        "bag": str(written.bag),
        "true_trajectory": str(written.true_trajectory),
        "true_plan": str(written.true_plan),
        "true_labels": str(written.true_labels),
        "true_glass": str(written.true_glass),
        "true_map": str(written.true_map),
        "true_image": str(written.true_image),
        "true_classes": str(written.true_classes),
        "scene": simulation.scene.name,
        "sensor": simulation.sensor.name,
        "sonar": None if simulation.sonar is None else simulation.sonar.ring.name,
        "seed": simulation.seed,
        "scans": written.scans,
        "driven_m": round(simulation.driven, 3),
        "duration_s": round(float(simulation.motion.times[-1]), 3),
    }


@contextmanager
def _recording_bar(total: float, quiet: bool) -> Iterator[Callable[[float], None] | None]:
    if quiet or sys.stderr is None or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console  # noqa: PLC0415  (40 ms)
    from rich.progress import Progress  # noqa: PLC0415

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("simulating", total=total)
        yield lambda seconds: bar.update(task, completed=seconds)
