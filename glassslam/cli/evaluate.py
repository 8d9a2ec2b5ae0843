"""`glassslam evaluate`: compare a trajectory and glass with the truth."""

from math import degrees
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from glassslam.cli.evaluate_beams import (
    LabelFile,
    beam_errors,
    beam_line,
    beam_table,
    label_file,
    plain_beam_errors,
)
from glassslam.cli.evaluate_image import Resolution, TruthMap, alignment_line, map_errors, map_table
from glassslam.errors import UsageError

if TYPE_CHECKING:
    from rich.table import Table

    from glassslam.evaluation import ErrorSummary, GlassErrors, RelationErrors
    from glassslam.records import Trajectory

EXAMPLES = """\
  glassslam evaluate run-map --relations intel.relations
  glassslam evaluate run-map --trajectory truth.tum
  glassslam evaluate other.tum --relations intel.relations --json
  glassslam evaluate run-map --glass glass.geojson
  glassslam evaluate run-map --glass run.bag.truth.glass.geojson --labels run.bag.truth.labels.npz
  glassslam evaluate run-map --truth run.bag.truth.map.yaml
"""

Results = Annotated[
    Path,
    typer.Argument(
        metavar="DIR",
        help="Results directory of map, a TUM file, or for --glass a GeoJSON file.",
        show_default=False,
    ),
]
RelationFile = Annotated[
    Path | None,
    typer.Option("--relations", metavar="FILE", help="True relations: t1 t2 x y z roll pitch yaw."),
]
TrajectoryFile = Annotated[
    Path | None,
    typer.Option("--trajectory", metavar="TUM", help="True trajectory: t x y z qx qy qz qw."),
]
GlassFile = Annotated[
    Path | None,
    typer.Option("--glass", metavar="FILE", help="True glass: GeoJSON lines of kind wall or glass, in m."),
]
Align = Annotated[
    bool,
    typer.Option("--align", help="Lay the glass onto the truth first, for a truth in another frame."),
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON.")]
Verbose = Annotated[
    bool, typer.Option("--verbose", help="Also the relation error as Cartographer's tool computes it.")
]


def evaluate(
    results: Results,
    relations: RelationFile = None,
    trajectory: TrajectoryFile = None,
    glass: GlassFile = None,
    labels: LabelFile = None,
    truth: TruthMap = None,
    resolution: Resolution = None,
    align: Align = False,
    json: Json = False,
    verbose: Verbose = False,
) -> None:
    """Compare a run with true relations (Kuemmerle et al. 2009), a true trajectory, or true glass.

    The error of a relation is inv(true) * estimated; means and standard deviations in m and deg.
    A trajectory is aligned without scale (ATE) and compared step by step (RPE over 1 pose and 1 m).
    Glass counts as found where a wall is within 0.10, 0.15 or 0.25 m of it, by points every centimetre.
    Labels of beams are counted one by one; intervals are of 95 %.
    A true map is laid onto the map; MSE of grey values 0 to 255, SSIM, NCC, and the overlap of each class.
    """
    if all(given is None for given in (relations, trajectory, glass, labels, truth)):
        raise UsageError(
            "nothing to compare with", "give --relations FILE, --trajectory TUM, --glass FILE or --truth MAP"
        )
    if resolution is not None and truth is None:
        raise UsageError("--resolution needs --truth", "it is the cell size of a picture")
    if align and glass is None:
        raise UsageError("--align needs --glass", "a trajectory is always aligned")
    errors = _errors(results, relations, trajectory, verbose)
    if glass is not None:
        errors["glass"] = _glass_errors(results, glass, align)
    if (true_labels := label_file(results, glass, labels)) is not None:
        errors["beams"] = beam_errors(results, true_labels)
    if truth is not None:
        errors["image"] = map_errors(results, truth, resolution)
    _show(errors, json)


def _errors(results: Path, relations: Path | None, trajectory: Path | None, verbose: bool) -> dict[str, Any]:
    """Errors of the trajectory against the truths that are given."""
    if relations is None and trajectory is None:
        return {}
    from glassslam.outputs import read_tum  # noqa: PLC0415  (loads numpy)

    estimate = read_tum(results / "trajectory.tum" if results.is_dir() else results)
    errors: dict[str, Any] = {}
    if relations is not None:
        errors.update(_relation_errors(estimate, relations, verbose))
    if trajectory is not None:
        errors.update(_trajectory_errors(estimate, trajectory))
    return errors


def _show(errors: dict[str, Any], as_json: bool) -> None:
    from dataclasses import asdict  # noqa: PLC0415
    from json import dumps  # noqa: PLC0415

    from glassslam.cli.terminal import emit, emit_rich  # noqa: PLC0415

    if as_json:
        plain = {name: plain_beam_errors if name == "beams" else asdict for name in errors}
        emit(dumps({name: plain[name](error) for name, error in errors.items()}, indent=2) + "\n")
        return
    listed = {name: error for name, error in errors.items() if name not in {"glass", "beams", "image"}}
    emit("".join(line for name, error in listed.items() for line in _lines(name, error)))
    if "glass" in errors:
        emit_rich(_glass_table(errors["glass"]), _glass_line(errors["glass"]))
    if "beams" in errors:
        emit_rich(beam_table(errors["beams"]), beam_line(errors["beams"]))
    if "image" in errors:
        emit_rich(map_table(errors["image"]), alignment_line(errors["image"]))


def _glass_errors(results: Path, path: Path, align: bool) -> "GlassErrors":
    from glassslam.evaluation import evaluate_glass, read_glass_walls, read_true_glass  # noqa: PLC0415

    walls = read_glass_walls(results / "glass.geojson" if results.is_dir() else results)
    return evaluate_glass(walls, read_true_glass(path), align=align)


def _glass_table(errors: "GlassErrors") -> "Table":
    from rich.table import Table  # noqa: PLC0415

    table = Table(title=f"glass: {errors.true_length:.2f} m true, {errors.wall_length:.2f} m of walls")
    for heading in ("within", "found", "of true", "panes", "false"):
        table.add_column(heading, justify="right")
    for row in errors.within:
        percent = "-" if row.found_percent is None else f"{row.found_percent:.1f} %"
        panes = f"{row.panes_found} of {errors.panes}"
        found, false = f"{row.found:.2f} m", f"{row.false:.2f} m"
        table.add_row(f"{row.tolerance:.2f} m", found, percent, panes, false)
    return table


def _glass_line(errors: "GlassErrors") -> str:
    limit = errors.within[-1].tolerance
    line = f"false glass: {errors.false_length:.2f} m, more than {limit:.2f} m from all true glass"
    if errors.true_from_map is None:
        return line
    x, y, theta = errors.true_from_map
    return f"{line}\naligned by {x:.3f} m, {y:.3f} m, {degrees(theta):.2f} deg"


def _relation_errors(estimate: "Trajectory", path: Path, verbose: bool) -> dict[str, Any]:
    from glassslam.evaluation import evaluate_relations, read_relations  # noqa: PLC0415

    truth = read_relations(path)
    errors = {"relations": evaluate_relations(estimate, truth)}
    if verbose:
        errors["relations_cartographer"] = evaluate_relations(estimate, truth, cartographer=True)
    return errors


def _trajectory_errors(estimate: "Trajectory", path: Path) -> dict[str, Any]:
    from glassslam.evaluation import absolute_trajectory_error, relative_pose_error  # noqa: PLC0415
    from glassslam.outputs import read_tum  # noqa: PLC0415

    truth = read_tum(path)
    return {
        "ate": absolute_trajectory_error(estimate, truth),
        "rpe_pose": relative_pose_error(estimate, truth),
        "rpe_metre": relative_pose_error(estimate, truth, unit="metres"),
    }


_TITLES = {
    "relations": "relations, error inv(true) * estimated",
    "relations_cartographer": "relations, error estimated * inv(true) (Cartographer's tool)",
    "ate": "absolute trajectory error, aligned without scale",
    "rpe_pose": "relative pose error, steps of 1 pose",
    "rpe_metre": "relative pose error, steps of 1 m",
}


def _lines(name: str, errors: Any) -> list[str]:
    if name.startswith("relations"):
        return _relation_lines(_TITLES[name], errors)
    return [
        f"{_TITLES[name]}: {errors.count} compared\n",
        f"  translation  {_summary(errors.translation, 'm')}\n",
        f"  rotation     {_summary(errors.rotation, 'deg')}\n",
    ]


def _relation_lines(title: str, errors: "RelationErrors") -> list[str]:
    return [
        f"{title}: {errors.count} compared, {errors.unmatched} unmatched\n",
        f"  translation  {errors.translation.mean:.5f} +- {errors.translation.std:.5f} m,"
        f"  squared {errors.translation_squared.mean:.6f} +- {errors.translation_squared.std:.6f} m^2\n",
        f"  rotation     {errors.rotation.mean:.4f} +- {errors.rotation.std:.4f} deg,"
        f"  squared {errors.rotation_squared.mean:.5f} +- {errors.rotation_squared.std:.5f} deg^2\n",
    ]


def _summary(summary: "ErrorSummary", unit: str) -> str:
    return (
        f"rmse {summary.rmse:.5f} {unit}, mean {summary.mean:.5f}, median {summary.median:.5f}, "
        f"std {summary.std:.5f}, min {summary.min:.5f}, max {summary.max:.5f}"
    )
