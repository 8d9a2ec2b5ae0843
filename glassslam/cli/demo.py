"""`glassslam demo`: simulate a building, map it, compare the result with the truth."""

from pathlib import Path
from typing import Annotated

import typer

from glassslam.errors import OutputError

EXAMPLES = """\
  glassslam demo                    everything into demo_out/
  glassslam demo -o /tmp/first      somewhere else
"""

_SCENE = "office"
_LIDAR = "ust10lx"
_SONARS = "pioneer-3dx"

Output = Annotated[Path, typer.Option("--output", "-o", metavar="DIR", help="Where everything is written.")]


def demo(output: Output = Path("demo_out")) -> int:
    """Record a robot in a simulated office, map the recording, and compare the result with the truth.

    The robot has a lidar with intensities, odometry and a ring of sonars. DIR holds the recording with its
    truth, and DIR/map the results, as glassslam map writes them.
    """
    from glassslam.cli.map import map_command  # noqa: PLC0415
    from glassslam.cli.settings import check_not_root  # noqa: PLC0415  (loads pydantic)
    from glassslam.cli.simulate import describe, record  # noqa: PLC0415
    from glassslam.cli.terminal import emit  # noqa: PLC0415
    from glassslam.outputs.lock import locked  # noqa: PLC0415
    from glassslam.simulation import Scene, find_scene, simulate  # noqa: PLC0415  (loads numba)

    check_not_root(output)
    bag, results = output / "demo.bag", output / "map"
    with locked(output):
        _check_own(output, bag)
        simulation = simulate(Scene.load(find_scene(_SCENE)), _LIDAR, sonar=_SONARS)
        written = record(simulation, bag)
        emit(describe(simulation, written) + "\n")
        code = map_command([bag], output=results, overwrite=True)
        emit(_verdict(results / "trajectory.tum", written.true_trajectory))
        emit(_glass_verdict(results / "glass.geojson", written.true_glass))
    emit(f"\nlook at {results / 'map.png'}\nnext: glassslam map YOUR.bag -o DIR\n")
    return code


def _check_own(output: Path, bag: Path) -> None:
    """An earlier demo may be replaced; anything else in the folder is not ours to mix with."""
    from glassslam.simulation import truth_paths  # noqa: PLC0415

    if output.exists() and not output.is_dir():
        raise OutputError(f"{output} is a file", "name a directory for the demo")
    known = {bag, *truth_paths(bag), bag.parent / "map", bag.parent / "map.partial"}
    present = sorted(set(output.iterdir()) - known) if output.exists() else []
    # A run that was killed may have left its lock, which begins with a dot.
    if foreign := [path for path in present if not path.name.startswith(".")]:
        raise OutputError(f"{output} holds other files: {foreign[0].name}", "choose a new directory")


def _verdict(estimate: Path, truth: Path) -> str:
    from glassslam.evaluation import absolute_trajectory_error  # noqa: PLC0415
    from glassslam.outputs import read_tum  # noqa: PLC0415

    errors = absolute_trajectory_error(read_tum(estimate), read_tum(truth))
    shift, turn = errors.translation, errors.rotation
    return (
        f"\nagainst the truth: {100 * shift.rmse:.1f} cm rms, {100 * shift.max:.1f} cm at most; "
        f"{turn.rmse:.2f} deg rms, over {errors.count} scans\n"
    )


def _glass_verdict(walls: Path, truth: Path) -> str:
    from glassslam.evaluation.glass import evaluate_glass  # noqa: PLC0415
    from glassslam.evaluation.glass_lines import read_glass_walls, read_true_glass  # noqa: PLC0415

    errors = evaluate_glass(read_glass_walls(walls), read_true_glass(truth))
    nearest = errors.within[0]
    return (
        f"glass: {nearest.found:.1f} of {errors.true_length:.1f} m found within "
        f"{100 * nearest.tolerance:.0f} cm, {errors.false_length:.1f} m of false glass\n"
    )
