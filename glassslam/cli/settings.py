"""What the options of the command line say about the configuration."""

import math
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import yaml

from glassslam.config import Config
from glassslam.errors import ConfigError, UsageError
from glassslam.yamltext import parse_yaml


def resolve_config(file: Path | None, assignments: Sequence[str]) -> Config:
    """Configuration of a file, or the defaults, with single values replaced.

    Parameters
    ----------
    file : Path or None
        A YAML file.
    assignments : sequence of str
        "section.name=value", the value as in YAML.

    Raises
    ------
    ConfigError
        An assignment has another form, or a name or value is refused.
    """
    return assigned(Config.load(file) if file else Config(), assignments)


def assigned(config: Config, assignments: Sequence[str]) -> Config:
    """A configuration with single values replaced.

    Parameters
    ----------
    config : Config
        The configuration.
    assignments : sequence of str
        "section.name=value", the value as in YAML.

    Raises
    ------
    ConfigError
        An assignment has another form, or a name or value is refused.
    """
    if not assignments:
        return config
    data = config.model_dump(mode="json")
    for assignment in assignments:
        _assign(data, assignment)
    return Config.from_mapping(data, origin="--set")


def sensor_assignments(sensor: str | None) -> list[str]:
    """Assignments that look for glass with a lidar of a kind; none when no kind is named.

    Cheap lidars show panes as narrow returns only; the others by their calibrated intensity.

    Raises
    ------
    UsageError
        The kind is not known.
    """
    if sensor is None:
        return []
    from detectors.profiles import PROFILES  # noqa: PLC0415  (loads numpy)

    if sensor not in PROFILES:
        raise UsageError(f"--sensor {sensor}: not known", f"known are {', '.join(PROFILES)}")
    if sensor == "rplidar":
        return ["glass.detector=narrow_return"]
    return ["glass.detector=calibrated_peak", f"glass.sensor={sensor}"]


def calibration_assignments(file: Path | None, sensor: str | None, config: Path | None = None) -> list[str]:
    """Assignments that look for glass with a calibration, which becomes part of the configuration.

    The errors of the beams go to the section `sensor`, apart from those that a file of parameters sets.

    Parameters
    ----------
    file : Path or None
        A calibration or its directory; None for no assignments.
    sensor : str or None
        Kind of lidar that is named besides.
    config : Path or None
        The file of parameters.

    Raises
    ------
    UsageError
        A kind of lidar is named as well.
    ConfigError
        The file is no calibration, or an entry of it is wrong; or the file of parameters is refused.
    """
    if file is None:
        return []
    if sensor is not None:
        raise UsageError("--calibration and --sensor exclude each other", "a calibration is of one sensor")
    from glassslam.calibration.files import read_calibration  # noqa: PLC0415  (loads numba)

    calibration = read_calibration(file)
    values: dict[str, Any] = {"detector": calibration.detector, "calibration": calibration.to_dict()}
    plain = {"thresh": calibration.thresh, "grad": calibration.grad, "width": calibration.width}
    if all(plain.values()):
        values |= plain
    stated = Config.load(config).sensor.model_fields_set if config else set()
    errors = calibration.beam_errors.settings if calibration.beam_errors else {}
    return [
        *(f"glass.{name}={_on_one_line(value)}" for name, value in values.items()),
        *(f"sensor.{name}={_on_one_line(value)}" for name, value in errors.items() if name not in stated),
    ]


def calibration_warnings(config: Config) -> list[str]:
    """That a calibration rules out that glass is seen, or that the beams are corrected in another way."""
    calibration = config.glass.calibration
    if calibration is None:
        return []
    warnings = []
    if config.glass.detector == calibration["detector"] == "off":
        name = calibration["sensor"]
        warnings.append(
            f"glass is not looked for: by its calibration the intensities of {name} cannot show it"
        )
    if others := _other_beams(config, calibration["beam_errors"] or {}):
        warnings.append(f"the beams are not corrected as calibrated: {', '.join(others)}")
    return warnings


def _other_beams(config: Config, errors: dict[str, Any]) -> list[str]:
    used = config.sensor.model_dump()
    pairs = [(name, used[name], value) for name, value in errors.items() if name in used]
    return [f"sensor.{name} is {mine:g}, not {its:g}" for name, mine, its in pairs if mine != its]


def intensity_assignments(*, required: bool) -> list[str]:
    """Assignments that make intensities which tell nothing an error; none unless it is asked for."""
    return ["glass.require_intensity=true"] if required else []


def check_intensity_use(config: Config) -> None:
    """Make sure that intensities are not required by a run that does not look at them.

    Raises
    ------
    UsageError
        They are.
    """
    glass = config.glass
    if glass.require_intensity and glass.detector in ("off", "narrow_return"):
        raise UsageError(
            f"--require-intensity: the detector {glass.detector} uses no intensities",
            "leave one of them out, or choose another detector",
        )


def _on_one_line(value: Any) -> str:
    # quoted where YAML would read something else: `off` is no text but false
    return yaml.safe_dump(value, default_flow_style=True, width=math.inf).removesuffix("...\n").strip()


def _assign(data: dict[str, Any], assignment: str) -> None:
    name, equals, text = assignment.partition("=")
    *sections, last = name.strip().split(".")
    if not equals or not all((*sections, last)):
        raise ConfigError(f"--set {assignment}: not of the form section.name=value")
    for section in sections:
        # An unknown section is left to the validation, which knows how to correct its spelling.
        data = data.setdefault(section, {})
        if not isinstance(data, dict):
            raise ConfigError(f"--set {assignment}: {section!r} is a value, not a section")
    try:
        data[last] = parse_yaml(text)
    except yaml.YAMLError as error:
        raise ConfigError(f"--set {assignment}: the value is not YAML") from error


def parse_pose(text: str | None) -> tuple[float, float, float] | None:
    """Pose of an option "x,y,yaw", m and rad.

    Raises
    ------
    UsageError
        The text is not three finite numbers, or its angle is more than a turn.
    """
    if text is None:
        return None
    try:
        x, y, yaw = (float(part) for part in text.split(","))
    except ValueError:
        x = y = yaw = math.nan
    if not all(math.isfinite(value) for value in (x, y, yaw)):
        raise UsageError(
            f"--laser-pose {text}: not three numbers x,y,yaw", "in m and rad, like 0.1,0,3.14159"
        )
    if abs(yaw) > 2.0 * math.pi:
        raise UsageError(
            f"--laser-pose {text}: a yaw of {yaw:g} rad is more than a turn",
            f"{yaw:g} deg is {math.radians(yaw):.4f} rad",
        )
    return x, y, yaw


def check_elsewhere(directory: Path) -> None:
    """Make sure that results do not take the place of the working directory.

    A finished directory appears by being renamed: the shell would be left standing in one that is gone.

    Raises
    ------
    UsageError
        They would.
    """
    check_not_root(directory)
    with suppress(FileNotFoundError):  # the working directory is gone already
        if Path.cwd().is_relative_to(directory.resolve()):
            raise UsageError(
                f"-o {directory}: results would replace the directory you are in",
                "choose a directory inside it, like -o results",
            )


def check_not_root(directory: Path) -> None:
    """Make sure that results have a directory with a name.

    Raises
    ------
    UsageError
        It is the root of all directories.
    """
    if not directory.resolve().name:
        raise UsageError(f"-o {directory}: no place for results", "name a directory, like -o results")


def default_directory(recordings: Sequence[Path], kind: str = "map") -> Path:
    """Name of the results directory when none is given: NAME-map in the working directory."""
    from glassslam.outputs.calibration_file import recording_name  # noqa: PLC0415  (loads numpy)

    return Path(f"{recording_name(recordings[0])}-{kind}")
