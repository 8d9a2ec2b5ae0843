"""The part of `glassslam evaluate` that compares the labels of single beams with the truth."""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.table import Table

    from detectors.rates import Rate
    from glassslam.evaluation.beam_labels import Band, BeamErrors, LabelScore

LabelFile = Annotated[
    Path | None,
    typer.Option(
        "--labels",
        metavar="FILE",
        help="True labels of all beams [default: the .truth.labels.npz beside --glass, where there is one].",
    ),
]

_GLASS_ENDING, _LABELS_ENDING = ".truth.glass.geojson", ".truth.labels.npz"
_BEAMS = "glass_beams.npz"


def label_file(results: Path, glass: Path | None, labels: Path | None) -> Path | None:
    """The true labels to compare with; None where none are given or lie beside the true glass.

    Labels that merely lie there are used only for a run that has labels as well.
    """
    if labels is not None or glass is None or not glass.name.endswith(_GLASS_ENDING):
        return labels
    beside = glass.with_name(glass.name.removesuffix(_GLASS_ENDING) + _LABELS_ENDING)
    return beside if beside.is_file() and (results / _BEAMS).is_file() else None


def beam_errors(results: Path, labels: Path) -> "BeamErrors":
    """Compare the labels in a results directory, or in a file of its kind, with the truth.

    Raises
    ------
    OutputError, EvaluationError
        A file cannot be read, or they do not belong together.
    """
    from glassslam.evaluation.beam_labels import evaluate_beams, read_true_labels  # noqa: PLC0415
    from glassslam.outputs.beam_labels import read_beam_labels  # noqa: PLC0415

    found = read_beam_labels(results / _BEAMS if results.is_dir() else results)
    return evaluate_beams(found, read_true_labels(labels))


def plain_beam_errors(errors: "BeamErrors") -> dict[str, Any]:
    """The errors ready for JSON: the share of nothing is null."""
    return _plain(asdict(errors))  # type: ignore[no-any-return]


def beam_table(errors: "BeamErrors") -> "Table":
    """One row for every label, and for every band of range and of incidence."""
    from rich.table import Table  # noqa: PLC0415

    table = Table(title=f"beams: {errors.beams} in {errors.scans} scans", pad_edge=False)
    table.add_column("label", no_wrap=True)
    for heading in ("right", "wrong", "missed", "precision %", "recall %"):
        table.add_column(heading, justify="right")
    _row(table, "glass", errors.glass)
    for bands, unit in ((errors.by_range, "m"), (errors.by_incidence, "deg")):
        _rows(table, bands, unit)
    _row(table, "ghosts", errors.ghosts)
    return table


def beam_line(errors: "BeamErrors") -> str:
    """What the beams wrongly labelled glass have met."""
    met = ", ".join(f"{count} {name}" for name, count in errors.false_glass.items()) or "none"
    return f"wrongly labelled glass: {met}"


def _rows(table: "Table", bands: "Sequence[Band]", unit: str) -> None:
    for band in bands:
        border = f"{band.low:g} to {band.high:g} {unit}" if band.high else f"from {band.low:g} {unit}"
        # nothing that is no glass has an incidence on it
        _row(table, f" {border}", band.score, recall_only=unit == "deg")


def _row(table: "Table", name: str, score: "LabelScore", *, recall_only: bool = False) -> None:
    wrong = "" if recall_only else str(score.false_positives)
    precision = "" if recall_only else _percent(score.precision)
    counts = (str(score.true_positives), wrong, str(score.false_negatives))
    table.add_row(name, *counts, precision, _percent(score.recall))


def _percent(rate: "Rate") -> str:
    if not rate.trials:
        return "-"
    return f"{100.0 * rate.value:.1f} ({100.0 * rate.low:.1f}-{100.0 * rate.high:.1f})"


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _plain(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and value != value else value  # noqa: PLR0124
