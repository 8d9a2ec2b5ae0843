"""The files of a calibration: written at once, read back with every wrong entry named."""

from pathlib import Path

import yaml

from detectors.calibration import Calibration
from glassslam.calibration.result import CalibrationResult
from glassslam.errors import ConfigError
from glassslam.outputs.calibration_file import CALIBRATION_FILE, as_yaml
from glassslam.outputs.directory import staged_directory
from glassslam.regularfile import regular
from glassslam.yamltext import parse_yaml, unreadable

FILES = (CALIBRATION_FILE, "calibration.png")
"""What a calibration directory holds."""


def write_calibration(
    result: CalibrationResult, directory: str | Path, *, overwrite: bool = False
) -> list[Path]:
    """Write calibration.yaml and calibration.png, both or none.

    Parameters
    ----------
    result : CalibrationResult
        A finished calibration.
    directory : str or Path
        The directory; it and its parents are made.
    overwrite : bool
        Whether an earlier calibration there may be replaced.

    Returns
    -------
    list of Path
        The files written.

    Raises
    ------
    UsageError
        The directory holds an earlier calibration and `overwrite` is False.
    OutputError
        Something cannot be written; nothing is left behind.
    """
    from glassslam.calibration.figure import write_figure  # noqa: PLC0415  (loads matplotlib)

    target = Path(directory)
    with staged_directory(target, overwrite=overwrite, files=FILES) as folder:
        (folder / FILES[0]).write_text(as_yaml(result.calibration), encoding="utf-8")
        write_figure(result, folder / FILES[1])
    return [target / name for name in FILES]


def read_calibration(path: str | Path) -> Calibration:
    """Read a calibration from its file, or from the directory that holds it.

    Raises
    ------
    ConfigError
        There is none, or an entry of it is wrong; the entry is named.
    """
    file = Path(path) / FILES[0] if Path(path).is_dir() else Path(path)
    hint = "it is written by glassslam calibrate"
    try:
        content = parse_yaml(regular(file).read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(f"cannot read calibration {file}: {error.strerror}", hint) from error
    except (UnicodeDecodeError, yaml.YAMLError) as error:
        raise ConfigError(
            f"{file} is no YAML file: {unreadable(error)}", f"a calibration is; {hint}"
        ) from error
    if not isinstance(content, dict) or "diffuse" not in content:
        raise ConfigError(f"{file} is no calibration", hint)
    try:
        return Calibration.from_dict(content)
    except ValueError as error:
        raise ConfigError(f"calibration {file}: {error}", hint) from error
