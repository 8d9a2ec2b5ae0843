"""calibration.yaml: what is known of a lidar, as a file to look at, to correct and to use again."""

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Final

import yaml

if TYPE_CHECKING:  # runs that do not look for glass need not load what finds it
    from detectors.calibration import Calibration
    from glassslam.slam.result import MapResult

CALIBRATION_FILE: Final = "calibration.yaml"
# stamps before this year were invented or count from the start of the robot
_FIRST_YEAR = 1990
_ENDINGS = (".gz", ".bag", ".mcap", ".db3", ".clf", ".log")

_CALIBRATED = "# lidar calibration for glass, made by glassslam calibrate"
_LEARNT = (
    "# lidar calibration for glass, learnt by glassslam map from the recording itself; thresholds unproven"
)
_USE = "use it with glassslam map --calibration"


def as_yaml(calibration: "Calibration", *, learnt: bool = False) -> str:
    """The calibration as it is written: lists of numbers on one line.

    Parameters
    ----------
    calibration : Calibration
        What is known of the lidar.
    learnt : bool
        Whether a run has found it out on its way.
    """
    head = f"{_LEARNT if learnt else _CALIBRATED}; {_USE}\n"
    return head + yaml.safe_dump(
        calibration.to_dict(), sort_keys=False, allow_unicode=True, default_flow_style=None, width=110
    )


def write_learnt(result: "MapResult", path: Path) -> Path | None:
    """Write the calibration that a run has made of its own lidar, named and dated by the recording.

    Parameters
    ----------
    result : MapResult
        The finished run.
    path : Path
        The file.

    Returns
    -------
    Path or None
        The file; None, and no file, where the run has made no calibration.
    """
    learnt = None if result.glass is None else result.glass.calibration
    if learnt is None:
        return None
    date = recording_day(float(result.trajectory.stamps.min()))
    named = replace(learnt, date=date)
    if result.info:
        names = [Path(name).resolve().name for name in result.info.paths]
        evidence = {"recordings": names, **learnt.evidence}
        named = replace(named, sensor=recording_name(names[0]), evidence=evidence)
    path.write_text(as_yaml(named, learnt=True), encoding="utf-8")
    return path


def recording_name(path: str | Path) -> str:
    """Base name of a recording without the endings of its format."""
    name = Path(path).resolve().name
    for ending in _ENDINGS:
        name = name.removesuffix(ending) or name
    return name


def recording_day(stamp: float) -> str:
    """Day (UTC) of a stamp in unix time, ISO 8601; empty where no recording can be that old.

    Parameters
    ----------
    stamp : float
        s.

    Examples
    --------
    >>> from glassslam.outputs.calibration_file import recording_day
    >>> recording_day(1_600_000_000.0), recording_day(12.5)
    ('2020-09-13', '')
    """
    try:
        moment = datetime.fromtimestamp(stamp, UTC)
    except (OverflowError, ValueError, OSError):
        return ""
    return moment.date().isoformat() if moment.year >= _FIRST_YEAR else ""
