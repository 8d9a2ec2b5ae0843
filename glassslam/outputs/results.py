"""All files of a results directory, written at once."""

import json
from pathlib import Path
from typing import TYPE_CHECKING

from glassslam.outputs.calibration_file import CALIBRATION_FILE, write_learnt
from glassslam.outputs.directory import staged_directory, working_directory
from glassslam.outputs.g2o import write_g2o
from glassslam.outputs.glass_geojson import write_glass
from glassslam.outputs.html_report import write_html_report
from glassslam.outputs.labels import write_labels
from glassslam.outputs.map_server import write_map
from glassslam.outputs.picture import write_picture
from glassslam.outputs.report import Stopwatch, build_report
from glassslam.outputs.sonar_maps import write_sonar_maps
from glassslam.outputs.trajectory import write_tum
from glassslam.outputs.volume_maps import write_volume_maps
from glassslam.slam.result import MapResult

if TYPE_CHECKING:
    from glassslam.session import Session


def write_results(
    result: MapResult,
    directory: str | Path,
    *,
    overwrite: bool = False,
    stopwatch: Stopwatch | None = None,
    session: "Session | None" = None,
) -> list[Path]:
    """Write map, picture, trajectory, pose graph, configuration and report; all of them or none.

    Parameters
    ----------
    result : MapResult
        The finished run.
    directory : str or Path
        The results directory; it and its parents are made.
    overwrite : bool
        Whether earlier results there may be replaced.
    stopwatch : Stopwatch, optional
        Started at the beginning of the run; its reading goes into report.json.
    session : Session, optional
        The session of the run, which is closed and becomes one of the results. Its folder becomes the results
        directory, unless it is a results directory itself.

    Returns
    -------
    list of Path
        The files written.

    Raises
    ------
    UsageError
        The directory holds earlier results and `overwrite` is False.
    OutputError
        Something cannot be written; nothing but the session is left behind and earlier results stay as they
        were.
    """
    target = Path(directory)
    home = None if session is None else session.path.parent
    working = home if home == working_directory(target) else None
    with staged_directory(target, overwrite=overwrite, working=working) as folder:
        written = write_files(result, folder, stopwatch)
        if session is not None:
            written.append(session.settle_in(folder))
    return [target / path.name for path in written]


def write_files(result: MapResult, folder: Path, stopwatch: Stopwatch | None = None) -> list[Path]:
    """Write the files of a run into a folder that exists, one after the other.

    Parameters
    ----------
    result : MapResult
        The run.
    folder : Path
        The folder.
    stopwatch : Stopwatch, optional
        Started at the beginning of the run.

    Raises
    ------
    OSError
        One cannot be written.
    """
    written = [
        *write_map(result.map, folder / "map.yaml"),
        write_picture(result.map, result.trajectory, folder / "map.png", result.glass),
        write_tum(result.trajectory, folder / "trajectory.tum"),
        *_glass_files(result, folder),
        *write_sonar_maps(result, folder),
        *write_volume_maps(result, folder),
        write_g2o(result.node_poses, result.constraints, folder / "graph.g2o"),
        folder / "config.yaml",
        folder / "report.json",
    ]
    (folder / "config.yaml").write_text(result.config.dump(), encoding="utf-8")
    # The report comes last, but for the page made of it: it tells what everything before it has cost.
    report = build_report(result, stopwatch.read() if stopwatch else None)
    (folder / "report.json").write_text(
        json.dumps(report, indent=2, allow_nan=False) + "\n", encoding="utf-8"
    )
    return [*written, write_html_report(result, report, folder)]


def _glass_files(result: MapResult, folder: Path) -> list[Path]:
    if result.glass is None:
        return []
    from glassslam.outputs.beam_labels import write_beam_labels  # noqa: PLC0415  (loads the detectors)

    beams, learnt = result.glass.beams, write_learnt(result, folder / CALIBRATION_FILE)
    return [
        write_glass(result.glass, folder / "glass.geojson"),
        *([] if beams is None else [write_beam_labels(beams, folder / "glass_beams.npz")]),
        write_labels(result.map, result.glass, folder / "labels.png"),
        *([] if learnt is None else [learnt]),
    ]
