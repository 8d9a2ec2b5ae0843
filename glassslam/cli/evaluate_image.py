"""The part of `glassslam evaluate` that compares maps with a true map."""

from dataclasses import dataclass
from math import degrees
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from glassslam.errors import UsageError

if TYPE_CHECKING:
    from rich.table import Table

    from glassslam.evaluation import ImageErrors

TruthMap = Annotated[
    Path | None,
    typer.Option(
        "--truth", metavar="MAP", help="True map: YAML of map_server, or a PGM or PNG with --resolution."
    ),
]
Resolution = Annotated[
    float | None,
    typer.Option("--resolution", metavar="M", help="Metres per cell of a --truth that is a plain picture."),
]


@dataclass(frozen=True, slots=True)
class MapErrors:
    """Likeness of the maps of a run with the truth, by the name of the map."""

    maps: "dict[str, ImageErrors]"


def map_errors(results: Path, truth: Path, resolution: float | None) -> MapErrors:
    """Compare `map.yaml` and every other `*_map.yaml` of a results directory, or one map, with the truth.

    All maps of a run share its frame, so the truth is laid onto the first and compared as it lies with all.

    Raises
    ------
    UsageError
        The directory holds no map, or the resolution does not fit the truth.
    OutputError, EvaluationError
        A file cannot be read or compared.
    """
    from glassslam.evaluation import evaluate_image, read_glass_cells, read_map  # noqa: PLC0415

    true_map, true_glass = read_map(truth, resolution), read_glass_cells(truth)
    errors: dict[str, ImageErrors] = {}
    motion: tuple[float, float, float] | None = None
    for path in _maps(results):
        errors[path.stem] = evaluate_image(
            read_map(path, resolution if path.suffix != ".yaml" else None),
            true_map,
            glass=read_glass_cells(path),
            true_glass=true_glass,
            map_from_truth=motion,
        )
        motion = errors[path.stem].map_from_truth
    return MapErrors(errors)


def map_table(errors: MapErrors) -> "Table":
    """One row for every map."""
    from rich.table import Table  # noqa: PLC0415

    first = next(iter(errors.maps.values()))
    size = f"{first.columns} x {first.rows} cells of {first.resolution:g} m"
    table = Table(title=f"likeness with the true map, {size}")
    for heading in ("map", "MSE", "SSIM", "NCC", "IoU occupied", "free", "unknown", "glass"):
        table.add_column(heading, justify="left" if heading == "map" else "right")
    for name, row in errors.maps.items():
        overlaps = (row.iou_occupied, row.iou_free, row.iou_unknown, row.iou_glass)
        shown = ("-" if share is None else f"{share:.3f}" for share in overlaps)
        table.add_row(name, f"{row.mse:.2f}", f"{row.ssim:.4f}", f"{row.ncc:.4f}", *shown)
    return table


def alignment_line(errors: MapErrors) -> str:
    """How the truth was moved."""
    x, y, theta = next(iter(errors.maps.values())).map_from_truth
    return f"truth moved by {x:.3f} m, {y:.3f} m, {degrees(theta):.2f} deg"


def _maps(results: Path) -> list[Path]:
    if not results.is_dir():
        return [results]
    maps = [results / "map.yaml", *sorted(results.glob("*_map.yaml"))]
    found = [path for path in maps if path.is_file()]
    if not found:
        raise UsageError(f"{results} holds no map", "name a results directory of map, or a map")
    return found
