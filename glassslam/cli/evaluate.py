"""`glassslam evaluate`: compare a trajectory with the truth."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from glassslam.errors import UsageError

if TYPE_CHECKING:
    from glassslam.evaluation import ErrorSummary, RelationErrors
    from glassslam.records import Trajectory

EXAMPLES = """\
  glassslam evaluate run-map --relations intel.relations
  glassslam evaluate run-map --trajectory truth.tum
  glassslam evaluate other.tum --relations intel.relations --json
"""

Results = Annotated[
    Path, typer.Argument(metavar="DIR", help="Results directory of map, or a TUM file.", show_default=False)
]
RelationFile = Annotated[
    Path | None,
    typer.Option("--relations", metavar="FILE", help="True relations: t1 t2 x y z roll pitch yaw."),
]
TrajectoryFile = Annotated[
    Path | None,
    typer.Option("--trajectory", metavar="TUM", help="True trajectory: t x y z qx qy qz qw."),
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON.")]
Verbose = Annotated[
    bool, typer.Option("--verbose", help="Also the relation error as Cartographer's tool computes it.")
]


def evaluate(
    results: Results,
    relations: RelationFile = None,
    trajectory: TrajectoryFile = None,
    json: Json = False,
    verbose: Verbose = False,
) -> None:
    """Compare the trajectory of a run with true relations (Kuemmerle et al. 2009) or a true trajectory.

    The error of a relation is inv(true) * estimated; means and standard deviations in m and deg.
    A trajectory is aligned without scale (ATE) and compared step by step (RPE over 1 pose and 1 m).
    """
    if relations is None and trajectory is None:
        raise UsageError("nothing to compare with", "give --relations FILE or --trajectory TUM")
    from dataclasses import asdict  # noqa: PLC0415

    from glassslam.cli.terminal import emit  # noqa: PLC0415
    from glassslam.outputs import read_tum  # noqa: PLC0415  (loads numpy)

    estimate = read_tum(results / "trajectory.tum" if results.is_dir() else results)
    errors: dict[str, Any] = {}
    if relations is not None:
        errors.update(_relation_errors(estimate, relations, verbose))
    if trajectory is not None:
        errors.update(_trajectory_errors(estimate, trajectory))
    if json:
        from json import dumps  # noqa: PLC0415

        emit(dumps({name: asdict(error) for name, error in errors.items()}, indent=2) + "\n")
    else:
        emit("".join(line for name, error in errors.items() for line in _lines(name, error)))


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
