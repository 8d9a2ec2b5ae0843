"""A calibration as tables: what was seen in the recordings, and what came of it."""

from math import degrees
from typing import TYPE_CHECKING, Any

from rich.table import Table

if TYPE_CHECKING:
    from detectors.beam_errors import BeamErrors
    from detectors.diffuse import DiffuseCurve
    from glassslam.calibration import CalibrationResult


def recordings_table(result: "CalibrationResult") -> Table:
    """One row for every recording: what was stated, and what was seen."""
    table = Table(box=None, padding=(0, 2, 0, 0))
    table.add_column("recording", overflow="fold")
    table.add_column("material")
    for heading in ("stated", "found", "scans", "seen", "square", "places"):
        table.add_column(heading, justify="right")
    for row in result.recordings:
        faced = row.material not in ("no-glass", "unknown")
        table.add_row(
            row.recording,
            row.material,
            "-" if row.distance is None else f"{row.distance:g} m",
            "-" if row.measured is None else f"{row.measured:.2f} m",
            str(row.scans),
            str(row.with_surface) if faced else "-",
            str(row.at_normal) if faced and row.material != "matte" else "-",
            str(row.places),
        )
    return table


def values_table(result: "CalibrationResult") -> Table:
    """The calibration, one value a row."""
    table = Table(box=None, show_header=False, padding=(0, 2, 0, 0))
    table.add_column(style="bold")
    table.add_column(overflow="fold")
    for name, value in value_rows(result):
        table.add_row(name, value)
    return table


def value_rows(result: "CalibrationResult") -> list[tuple[str, str]]:
    """Lines of the summary as pairs of name and value."""
    own = result.calibration
    unproven = "" if result.proven else " (unproven)"
    step = f"{degrees(own.angle_increment):.4g} deg" if own.angle_increment else "varying"
    rows = [
        ("sensor", f"{own.sensor}, {own.beams or 'varying'} beams, step {step}, {own.date or 'no date'}"),
        ("limits", f"{own.range_min:g} to {own.range_max:g} m, no echo: {_silent(own.no_echo)}"),
        *([("diffuse level", _level(own.diffuse))] if result.has_curve else []),
        ("detector", own.detector),
        *_beam_rows(own.beam_errors),
    ]
    if not result.has_curve:
        return rows
    if own.thresh:
        rows.append(("intensity_peak", f"thresh {own.thresh:g}, grad {own.grad:g}, width {own.width} beams"))
    shape = f"faint below {own.faint:g}, decay above {own.weakest_decay:g} per rad"
    rows.append(("calibrated_peak", shape + unproven))
    if result.proven:
        pane = own.pane
        rows.append(("pane", f"haze {pane.haze:g}, decay {pane.decay:g} per rad, mirror peak {pane.peak:g}"))
    names = ("intensity_peak", "calibrated_peak", "narrow_return")
    rows += [(f"{name} rates", _rates(own.evidence[name])) for name in names if name in own.evidence]
    return rows + (_reach_rows(own.evidence[own.detector]) if own.detector in own.evidence else [])


def _level(curve: "DiffuseCurve") -> str:
    reach = f"from {curve.ranges[0]:g} to {curve.ranges[-1]:g} m"
    return f"{float(curve.level(1.0)):.0f} at 1 m, {reach}, spread {curve.spread:.0%}"


def _beam_rows(errors: "BeamErrors | None") -> list[tuple[str, str]]:
    if errors is None:
        return []
    values = zip(errors.settings.items(), errors.sigma, strict=True)
    rows = [(name, _with_sigma(name, value, sigma)) for (name, value), sigma in values]
    before, after = (f"{1e3 * bend:.2f}" for bend in (errors.bend_before, errors.bend_after))
    return [*rows, ("bend of walls", f"{before} mm without, {after} mm with it, {errors.walls} walls")]


def _with_sigma(name: str, value: float, sigma: float) -> str:
    if name.startswith("bearing"):
        return f"{value:.4f} +- {sigma:.4f} rad ({degrees(value):.2f} deg)"
    return f"{1e3 * value:.1f} +- {1e3 * sigma:.1f} mm"


def _reach_rows(rates: dict[str, Any]) -> list[tuple[str, str]]:
    return [(f"up to {rate['to']:g} m", f"panes {_rate(rate)}") for rate in rates.get("by_distance", ())]


def _silent(no_echo: float | None) -> str:
    return "infinite or not seen" if no_echo is None else f"{no_echo:g} m"


def _rates(rates: dict[str, Any]) -> str:
    found, alarm = (_rate(rates[name]) for name in ("detection", "false_alarm"))
    return f"panes {found}; scans with a false alarm {alarm}"


def _rate(rate: dict[str, Any]) -> str:
    if not rate["trials"]:
        return "not tried"
    counts = f"{rate['successes']} of {rate['trials']}"
    return f"{counts} = {rate['value']:.1%} ({rate['low']:.0%} to {rate['high']:.0%})"
