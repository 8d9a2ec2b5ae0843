"""A calibration as a picture: panes and thresholds, walls and the diffuse curve, the lobe of the panes."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from detectors.calibration import Calibration
from detectors.pane_lobe import SHOULDER, core, faces
from detectors.panes import PaneProfile
from glassslam.calibration.result import CalibrationResult
from glassslam.records import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_INK, _FAINT, _WALL = "#333333", "#999999", "#7a7a7a"
_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
_GROUP_WIDTHS = (0.1, 0.25, 0.5, 1.0, 2.0, 5.0)
_MOST_POINTS = 4000
_MOST_VIEWS = 8
_NARROW, _WIDE = 15.0, 50.0
_NEARLY_NORMAL = math.radians(35.0)


def write_figure(result: CalibrationResult, path: Path) -> None:
    """Draw a calibration as PNG.

    Left the intensity of the panes around their normal with the thresholds, as in Fig. 1 of Weerakoon et al.
    (Cartographer_glass); in the middle walls against range with the diffuse curve; right the level of the
    panes against incidence with the lobe model.

    Raises
    ------
    OSError
        The file cannot be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: PLC0415  (slow to import)
    from matplotlib.figure import Figure  # noqa: PLC0415

    figure = Figure(figsize=(16.0, 6.4), layout="constrained")
    FigureCanvasAgg(figure)
    profiles, walls, lobe = figure.subplots(1, 3)
    groups = by_distance(result.panes)
    _draw_profiles(profiles, result, groups)
    _draw_walls(walls, result)
    _draw_lobe(lobe, result, groups)
    for axes in (profiles, walls, lobe):
        axes.grid(alpha=0.25)
    figure.suptitle(_title(result), fontsize=12)
    # no name of the program's version: same calibration, same bytes
    figure.savefig(path, dpi=110, metadata={"Software": None})


def by_distance(panes: Sequence[PaneProfile]) -> dict[str, list[PaneProfile]]:
    """Views of panes by distance, nearest first, in at most six groups with their names."""
    facing = [pane for pane in panes if faces(pane)] or list(panes)
    for width in _GROUP_WIDTHS:
        groups: dict[int, list[PaneProfile]] = {}
        for pane in facing:
            groups.setdefault(round(pane.distance / width), []).append(pane)
        if len(groups) <= len(_COLOURS):
            break
    kept = sorted(groups)[: len(_COLOURS)]
    return {_named(groups[key]): groups[key] for key in kept}


def _named(panes: Sequence[PaneProfile]) -> str:
    views = f"{len(panes)} view{'s' * (len(panes) != 1)}"
    return f"{np.median([pane.distance for pane in panes]):.2f} m ({views})"


def _draw_profiles(axes: "Axes", result: CalibrationResult, groups: dict[str, list[PaneProfile]]) -> None:
    axes.set(title="panes around their normal", xlabel="angle to the normal [deg]")
    axes.set(ylabel="intensity [unit of the sensor]", xlim=(-_NARROW, _NARROW))
    for colour, (name, panes) in zip(_COLOURS, groups.items(), strict=False):
        for k, pane in enumerate(_some(panes)):
            # beams that saw through leave gaps in the line
            heard = np.where(pane.answered, pane.intensities, np.nan)
            axes.plot(
                np.degrees(pane.angles),
                heard,
                ".-",
                color=colour,
                ms=3,
                lw=0.9,
                alpha=0.7,
                label="" if k else name,
            )
    if not groups:
        _say(axes, "no pane was seen")
        return
    _draw_thresholds(axes, result.calibration)
    axes.set_ylim(bottom=0.0)
    _legend(axes)


def _draw_thresholds(axes: "Axes", calibration: Calibration) -> None:
    if not calibration.thresh:
        return
    thresh, grad = calibration.thresh, calibration.grad
    axes.axhline(thresh, color=_INK, ls="--", lw=1.2, label=f"thresh {thresh:g}")
    label = f"grad {grad:g} high, width {calibration.width} beams wide"
    half = 0.5 * math.degrees(calibration.width * calibration.angle_increment)
    axes.fill_between([-half, half], thresh - grad, thresh, color=_INK, alpha=0.2, lw=0, label=label)


def _draw_walls(axes: "Axes", result: CalibrationResult) -> None:
    calibration, samples = result.calibration, result.surfaces
    square = samples.incidences < _NEARLY_NORMAL
    ranges, values = samples.ranges[square], samples.intensities[square]
    axes.set(title="surfaces against range", xlabel="range [m]", ylabel="intensity [unit of the sensor]")
    if not result.has_curve:
        _say(axes, "intensities tell nothing")
        return
    farthest = max(float(np.percentile(ranges, 99.5)), calibration.diffuse.ranges[-1]) if ranges.size else 1.0
    near = ranges <= farthest
    _dots(axes, ranges[near], values[near], _WALL, name="flat surfaces, below 35 deg")
    places = np.linspace(0.0, 1.05 * farthest, 300)
    axes.plot(places, calibration.diffuse.level(places), color=_INK, lw=2.0, label="diffuse curve")
    faced = [pane for pane in result.panes if faces(pane)]
    if faced:
        peaks = [float(pane.intensities[core(pane)].max()) for pane in faced]
        distances = [pane.distance for pane in faced]
        axes.plot(distances, peaks, "x", color=_COLOURS[1], ms=6, label="mirror peaks of panes")
    if calibration.thresh:
        axes.axhline(calibration.thresh, color=_INK, ls="--", lw=1.2, label=f"thresh {calibration.thresh:g}")
    if math.isfinite(calibration.saturation):
        axes.axhline(calibration.saturation, color=_COLOURS[3], ls=":", label="saturation")
    axes.set(xlim=(0.0, 1.05 * farthest), ylim=(0.0, _ceiling(result)))
    _legend(axes)


def _draw_lobe(axes: "Axes", result: CalibrationResult, groups: dict[str, list[PaneProfile]]) -> None:
    calibration = result.calibration
    axes.set(title="level of panes against incidence", xlabel="incidence [deg]", xlim=(0.0, _WIDE))
    axes.set(ylabel="level [diffuse level at that range = 1]")
    if not groups:
        _say(axes, "no pane was seen")
        return
    axes.set_yscale("log")
    for colour, (name, panes) in zip(_COLOURS, groups.items(), strict=False):
        angles, levels = _answers(panes, "levels")
        _dots(axes, np.degrees(np.abs(angles)), levels, colour, name=name)
    pane = calibration.pane
    places = np.linspace(0.0, _WIDE, 200)
    label = f"lobe {pane.haze:.2f} exp(-{pane.decay:.1f} angle / rad)"
    axes.plot(places, pane.haze * np.exp(-pane.decay * np.radians(places)), color=_INK, lw=2.0, label=label)
    axes.plot([0.0], [pane.peak], "_", color=_INK, ms=22, mew=2.5, clip_on=False, label=f"peak {pane.peak:g}")
    axes.axhline(1.0, color=_WALL, lw=1.2, label="matte wall")
    axes.axhline(calibration.faint, color=_INK, ls="--", lw=1.2, label=f"faint below {calibration.faint:g}")
    axes.axvspan(*np.degrees(SHOULDER), color=_FAINT, alpha=0.12, lw=0, label="shoulders")
    axes.set_ylim(0.01, 2.0 * max(pane.peak, 2.0))
    _legend(axes)


def _answers(panes: Sequence[PaneProfile], name: str) -> tuple[FloatArray, FloatArray]:
    angles = np.concatenate([pane.angles[pane.answered] for pane in panes])
    values = np.concatenate([np.asarray(getattr(pane, name))[pane.answered] for pane in panes])
    return angles, values


def _dots(axes: "Axes", x: FloatArray, y: FloatArray, colour: str, *, name: str = "") -> None:
    stride = max(1, len(x) // _MOST_POINTS)
    alpha = min(0.8, max(0.15, 400.0 / max(len(x) // stride, 1)))
    axes.plot(x[::stride], y[::stride], ".", color=colour, ms=4, alpha=alpha, mew=0, rasterized=True)
    if name:
        axes.plot([], [], "o", color=colour, ms=5, label=name)


def _some(panes: Sequence[PaneProfile]) -> Sequence[PaneProfile]:
    """A few views from all over the recording: more would hide each other."""
    return panes[:: max(1, math.ceil(len(panes) / _MOST_VIEWS))]


def _legend(axes: "Axes") -> None:
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=2, fontsize=9, frameon=False)


def _ceiling(result: CalibrationResult) -> float:
    peaks = [float(pane.intensities[core(pane)].max()) for pane in result.panes if faces(pane)]
    walls = float(np.percentile(result.surfaces.intensities, 99.0)) if result.surfaces.ranges.size else 1.0
    return 1.1 * max([walls, max(result.calibration.diffuse.levels), result.calibration.thresh, *peaks])


def _say(axes: "Axes", text: str) -> None:
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", color=_FAINT, fontsize=12)


def _title(result: CalibrationResult) -> str:
    calibration = result.calibration
    day = f", {calibration.date}" if calibration.date else ""
    if not result.has_curve:
        return f"{calibration.sensor}{day}: beams only"
    text = f"{calibration.sensor}{day}: diffuse level at 1 m {calibration.intensity_scale:.0f}"
    rates = calibration.evidence.get(calibration.detector)
    if rates is None or not rates["detection"]["trials"]:
        return f"{text}, thresholds unproven"
    found = rates["detection"]
    return (
        f"{text}, {calibration.detector} finds {found['successes']} of {found['trials']} views of panes "
        f"({found['low']:.0%} to {found['high']:.0%})"
    )
