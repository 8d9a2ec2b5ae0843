"""`glassslam calibrate`: what a lidar answers to glass and to walls, from recordings."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from glassslam.calibration import CalibrationResult

EXAMPLES = """\
  glassslam calibrate one.bag two.bag --distance 1 --distance 2 --material glass
  glassslam calibrate run.bag --distance 1.1 --roi -110:-70      a pane to the right
  glassslam calibrate run.bag --panes glass.geojson --align      panes known in a map
  glassslam calibrate w1.bag w2.bag --material matte --distance 0.5 --distance 1
  glassslam calibrate run.bag                                    walls only, no known pane
  glassslam calibrate pane.bag office.bag --distance 1 --distance - --material glass --material no-glass
  glassslam calibrate run.bag --geometry                         the map bends: correct the beams as well
  glassslam map run.bag --calibration one-calibration            use it
"""

Recordings = Annotated[
    list[Path],
    typer.Argument(
        metavar="RECORDING...",
        help="ROS 1 bags, ROS 2 bags (file or directory), mcap or CARMEN logs of one lidar.",
        show_default=False,
    ),
]
Materials = Annotated[
    list[str] | None,
    typer.Option(
        "--material",
        metavar="NAME",
        help="glass, acrylic or polycarbonate (a pane), matte (a wall), no-glass or unknown "
        "[default: glass with --distance or --panes, else unknown].",
        show_default=False,
    ),
]
Distances = Annotated[
    list[str] | None,
    typer.Option("--distance", metavar="M", help="From the lidar to the pane or wall it faces, m."),
]
PaneFiles = Annotated[
    list[str] | None,
    typer.Option(
        "--panes", metavar="FILE", help="Panes in the map frame: GeoJSON lines of kind wall or glass."
    ),
]
Rois = Annotated[
    list[str] | None,
    typer.Option(
        "--roi",
        metavar="REGION",
        help="Where the pane or wall is, in the frame of the lidar: LOW:HIGH in deg or X0,Y0,X1,Y1 in m "
        "[default: 30 deg to both sides of straight ahead].",
        show_default=False,
    ),
]
Align = Annotated[
    bool, typer.Option("--align", help="Lay the map onto the panes first, for panes in another frame.")
]
Geometry = Annotated[
    bool,
    typer.Option(
        "--geometry",
        help="Estimate the errors of the beams as well, from walls that come out bent; for maps that bend.",
    ),
]
Name = Annotated[
    str, typer.Option("--name", metavar="NAME", help="Name of the sensor [default: of the first recording].")
]
Output = Annotated[
    Path | None,
    typer.Option(
        "--output", "-o", metavar="DIR", help="Directory to write [default: RECORDING-calibration]."
    ),
]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace an earlier calibration in DIR.")]
ScanTopic = Annotated[str | None, typer.Option(help="Topic of the laser scans.", metavar="TOPIC")]
Start = Annotated[float, typer.Option(metavar="SECONDS", help="Leave out the first seconds of each.")]
Duration = Annotated[
    float | None, typer.Option(metavar="SECONDS", help="Use so many seconds of each [default: all].")
]
Json = Annotated[bool, typer.Option("--json", help="Print the calibration as JSON instead of the summary.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")]


def calibrate_command(
    recordings: Recordings,
    material: Materials = None,
    distance: Distances = None,
    panes: PaneFiles = None,
    roi: Rois = None,
    align: Align = False,
    geometry: Geometry = False,
    name: Name = "",
    output: Output = None,
    overwrite: Overwrite = False,
    scan_topic: ScanTopic = None,
    start: Start = 0.0,
    duration: Duration = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Calibrate a lidar for glass, and write calibration.yaml and calibration.png to DIR.

    The robot stands still in front of a pane, at 1 m and at 2 m, squarely; or drives where panes are known;
    recordings of matte walls and of places without glass make the result better. Each of --material,
    --distance, --panes and --roi is given once for all recordings or once for each, in their order, with -
    where there is none.
    """
    from glassslam.calibration import FILES, make_sessions, write_calibration  # noqa: PLC0415  (loads numba)
    from glassslam.calibration import calibrate as run  # noqa: PLC0415
    from glassslam.cli.progress import progress_bar  # noqa: PLC0415
    from glassslam.cli.settings import check_elsewhere, default_directory  # noqa: PLC0415
    from glassslam.errors import UsageError  # noqa: PLC0415
    from glassslam.outputs import check_directory  # noqa: PLC0415
    from glassslam.outputs.lock import locked  # noqa: PLC0415
    from glassslam.sources import SourceOptions  # noqa: PLC0415

    sessions = make_sessions(
        recordings, materials=material or (), distances=distance or (), panes=panes or (), rois=roi or ()
    )
    if align and not any(session.panes for session in sessions):
        raise UsageError("--align needs --panes", "a faced pane needs no alignment")
    directory = output or default_directory(recordings, "calibration")
    check_elsewhere(directory)
    check_directory(directory, overwrite=overwrite, files=FILES)
    options = SourceOptions(scan_topic=scan_topic, start=start, duration=duration)
    with locked(directory):
        with progress_bar(quiet=quiet) as progress:
            result = run(
                sessions, name=name, options=options, align=align, geometry=geometry, progress=progress
            )
        written = write_calibration(result, directory, overwrite=overwrite)
    if json:
        _print_json(result, directory)
    elif not quiet:
        _show(result, written)


def _print_json(result: "CalibrationResult", directory: Path) -> None:
    from json import dumps  # noqa: PLC0415

    from glassslam.cli.terminal import emit  # noqa: PLC0415

    report = {
        "directory": str(directory),
        "proven": result.proven,
        "warnings": list(result.warnings),
        "calibration": _finite(result.calibration.to_dict()),
    }
    emit(dumps(report, indent=2, allow_nan=False) + "\n")


def _finite(value: Any) -> Any:
    """JSON knows no infinity: null says that there is no limit."""
    if isinstance(value, dict):
        return {name: _finite(entry) for name, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(entry) for entry in value]
    if isinstance(value, float) and value - value != 0.0:
        return None
    return value


def _show(result: "CalibrationResult", written: list[Path]) -> None:
    from glassslam.cli.calibrate_tables import recordings_table, values_table  # noqa: PLC0415  (loads rich)
    from glassslam.cli.terminal import emit_rich  # noqa: PLC0415

    emit_rich(
        recordings_table(result),
        "",
        values_table(result),
        "",
        *(f"warning: {text}" for text in result.warnings),
        *(f"wrote {path}" for path in written),
    )
