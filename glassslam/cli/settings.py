"""What the options of the command line say about the configuration."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import yaml

from glassslam.config import Config
from glassslam.errors import ConfigError, UsageError


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
    config = Config.load(file) if file else Config()
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


def calibration_assignments(file: Path | None, sensor: str | None) -> list[str]:
    """Assignments that look for glass with a calibration, which becomes part of the configuration.

    Raises
    ------
    UsageError
        A kind of lidar is named as well.
    ConfigError
        The file is no calibration, or an entry of it is wrong.
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
    return [f"glass.{name}={_on_one_line(value)}" for name, value in values.items()]


def calibration_warnings(config: Config) -> list[str]:
    """That a calibration was given but rules out that glass is seen; empty otherwise."""
    glass = config.glass
    if glass.calibration is None or glass.detector != "off" or glass.calibration["detector"] != "off":
        return []
    name = glass.calibration["sensor"]
    return [f"glass is not looked for: by its calibration the intensities of {name} cannot show it"]


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
        data[last] = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise ConfigError(f"--set {assignment}: the value is not YAML") from error


def parse_pose(text: str | None) -> tuple[float, float, float] | None:
    """Pose of an option "x,y,yaw", m and rad.

    Raises
    ------
    UsageError
        The text is not three finite numbers.
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
    return x, y, yaw


def default_directory(recordings: Sequence[Path], kind: str = "map") -> Path:
    """Name of the results directory when none is given: NAME-map in the working directory."""
    name = recordings[0].resolve().name
    for suffix in (".gz", ".bag", ".mcap", ".db3", ".clf", ".log"):
        name = name.removesuffix(suffix) or name
    return Path(f"{name}-{kind}")
